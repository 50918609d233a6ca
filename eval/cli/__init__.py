"""The `muslin` command line, one file a command."""
