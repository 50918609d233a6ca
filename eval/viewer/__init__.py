"""Moving surfaces side by side in a page: what is shown, how it is packed, the fragment of HTML."""
