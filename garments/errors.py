"""The one exception for everything a user can get wrong."""


class InputError(Exception):
    """Bad input: names the file or key and its value, what is allowed, and what to do.

    The command line prints the message on one line and exits with code 2.
    """
