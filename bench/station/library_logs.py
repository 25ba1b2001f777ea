"""The logs of libraries while instruments are used."""

import logging


def quieten_libraries() -> None:
    """Route the logs of libraries to configured handlers, not into the program's own output.

    What they complain of is in the errors that the drivers raise.
    """
    root = logging.getLogger()
    if not root.handlers:
        root.addHandler(logging.NullHandler())
