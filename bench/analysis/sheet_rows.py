"""Rows of name, value and unit as data sheets are typed or copied: between marks, as a Markdown table, or with blanks only."""

import csv
import io
import re
from collections.abc import Callable, Sequence

#: A name, then the first number of the line with what follows it.
_BLANKS = re.compile(r"(.*?\S)\s+([+-]?\d[\d.,]*(?:[eE][+-]?\d+)?(?:\s.*)?)")
#: Begins a second number, which leaves open which of the two is the value; "1/min" is a unit.
_SECOND = re.compile(r"[+-]?\d(?!/)")


def rows_of(content: str, known: Callable[[Sequence[str]], bool]) -> tuple[list[list[str]], str]:
    """Return the cells of each line, and the mark between them: of all ways to part the lines the one with the most `known` rows."""
    ways = [(_marked(content, mark), mark) for mark in ("\t", ";", ",")]
    ways.append(([line.strip().strip("|").split("|") for line in content.splitlines()], "|"))
    ways.append(([_by_blanks(line) for line in content.splitlines()], " "))
    return max(ways, key=lambda way: sum(known([cell.strip() for cell in row if cell.strip()]) for row in way[0]))


def _marked(content: str, mark: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(content), delimiter=mark))


def _by_blanks(line: str) -> list[str]:
    match = _BLANKS.fullmatch(line.strip())
    if match is None or any(_SECOND.match(word) for word in match[2].split()[1:]):
        return [line]
    return [match[1], match[2]]
