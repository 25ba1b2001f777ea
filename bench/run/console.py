"""The output of a run: a terminal, a file or a pipe."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

#: Width of what is written into a file or a pipe, where no terminal sets one.
_PLAIN_WIDTH = 120


def console_on(stream: Any) -> "Console":
    """Return a console on a stream; one that is no terminal is 120 columns wide."""
    from rich.console import Console

    width = None if stream.isatty() else _PLAIN_WIDTH
    return Console(file=stream, width=width, highlight=False, soft_wrap=False)
