"""The designs of the catalogue, one file each."""
