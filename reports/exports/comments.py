"""Comments of exported files: where the figures come from, in a syntax that no name can break out of."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from reports.exports.target import Sheet

#: Width to which comments are wrapped.
_WIDTH = 120


@dataclass(frozen=True)
class Syntax:
    """The syntax of a language's comment of one line; `forbidden` is what would end it, and its substitute."""

    start: str
    end: str = ""
    forbidden: tuple[tuple[str, str], ...] = ()
    ascii_only: bool = True

    def comment(self, words: str) -> str:
        """Return the words as one line of comment."""
        return f"{self.start}{self.safe(words)}{self.end}"

    def safe(self, words: str) -> str:
        """Return words that cannot end the comment: no line breaks, no control characters, nothing of `forbidden`."""
        clean = re.sub(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]+", " ", words)
        for bad, instead in self.forbidden:
            while bad in clean:
                clean = clean.replace(bad, instead)
        if self.ascii_only:
            clean = clean.encode("ascii", "backslashreplace").decode("ascii")
        # XML forbids halves of surrogate pairs as text; nothing else can carry them either.
        return clean.encode("utf-8", "backslashreplace").decode("utf-8").strip()


C = Syntax("/* ", " */", (("*/", "* /"), ("/*", "/ *"), ("??/", "? ?/")))
XML = Syntax("<!-- ", " -->", (("--", "- -"),), ascii_only=False)
HASH = Syntax("# ", ascii_only=False)
ASCII_HASH = Syntax("# ")
MATLAB = Syntax("% ")


def head(sheet: Sheet, syntax: Syntax, purpose: str) -> Iterator[str]:
    """Give the lines that say what the file is, which motor and run it is of, and what stands against it."""
    subject = sheet.subject
    motor = subject.motor + (f", serial number {subject.serial_number}" if subject.serial_number else "")
    messages = [
        f"{purpose}, written by motorbench {subject.software}",
        f"motor: {motor}",
        f"run: {subject.run}, {subject.measured_on}",
        "u: standard uncertainty (k = 1), in the unit of its field",
        *(f"left out: {reason}" for reason in sheet.left_out),
        *(f"WARNING {notice.identifier}: {notice.message}" for notice in subject.warnings),
    ]
    for words in messages:
        for line in _wrapped(syntax.safe(words)):
            yield syntax.comment(line)


def _wrapped(words: str) -> Iterator[str]:
    import textwrap

    yield from textwrap.wrap(words, _WIDTH, break_long_words=False, break_on_hyphens=False) or [""]
