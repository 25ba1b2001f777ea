"""The output of a run: a terminal, a file or a pipe."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

#: Width of what is written into a file or a pipe, where no terminal sets one.
_PLAIN_WIDTH = 120


def console_on(stream: Any, *, markup: bool = True) -> "Console":
    """Return a console on a stream; one that is no terminal is 120 columns wide.

    Without `markup`, what stands in brackets is printed as it is: serial numbers and names may have any.
    """
    from rich.console import Console

    width = None if stream.isatty() else _PLAIN_WIDTH
    return Console(file=stream, width=width, highlight=False, soft_wrap=False, markup=markup)
