"""What a person can put right: bad files, bad arguments, runs that cannot go on."""


class InputError(Exception):
    """Something given by the user cannot be used; the message names the file, the key, what was given and what is allowed."""


class UsageError(InputError):
    """The command line asks for something that does not exist or does not go together."""
