"""What libraries log while instruments are used."""

import logging


def quieten_libraries() -> None:
    """Have libraries' logs go where somebody has set them up to go, and not between the lines of ours.

    What they complain of is in the errors that the drivers raise.
    """
    root = logging.getLogger()
    if not root.handlers:
        root.addHandler(logging.NullHandler())
