"""Line breaks in Chinese: between two characters, and never inside a name, a number or an option."""

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult

_WIDE = "\u2e80-\u9fff\uf900-\ufaff\uff00-\uffef"
_OPENING = r"（“《【\["
_CLOSING = "，。、；：？！）”》】"
#: What stays together: opening marks, one wide character or a run of others, closing marks.
_PIECES = re.compile(f"\\s*[{_OPENING}]*(?:[^\\s{_WIDE}{_OPENING}{_CLOSING}]+|[{_WIDE}])?[{_CLOSING}]*|\\s+")


def broken(words: str, width: int) -> str:
    """Return a text with line ends, none of its lines wider than so many columns unless one word is."""
    return "\n".join(line for paragraph in words.split("\n") for line in _lines(paragraph, width))


class Broken:
    """A text that is laid out anew at the width that it is drawn in."""

    def __init__(self, words: str) -> None:
        self._words = words

    def __rich_console__(self, console: "Console", options: "ConsoleOptions") -> "RenderResult":
        from rich.text import Text

        yield Text(broken(self._words, options.max_width))


def _lines(words: str, width: int) -> list[str]:
    from rich.cells import cell_len

    lines = [""]
    for piece in filter(None, _PIECES.findall(words)):
        if lines[-1] and cell_len(lines[-1] + piece) > width:
            lines.append(piece.lstrip())
        else:
            lines[-1] += piece
    return lines
