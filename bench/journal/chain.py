"""The first place at which a journal is not as it was written."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bench.journal.journal_file import JournalLine
from drivers.interfaces.text import Text, text


@dataclass(frozen=True)
class ChainFault:
    """A line, from 1, and what is wrong with it."""

    line: int
    what: Text


def first_fault(lines: Sequence[JournalLine], known: Mapping[int, str]) -> ChainFault | None:
    """Return the first fault in the lines of a journal, None if each line follows from the one before.

    `known` holds hashes of lines, by place, that the result holds: with them even the last line can be told from a changed one.
    """
    for index, line in enumerate(lines):
        due = index + 1
        if line.event is None or line.torn:
            return ChainFault(due, text("was changed: it is not an event"))
        number = line.event.number
        before = lines[index - 1] if index else None
        if number < due:
            return _put_in(lines, index)
        if number > due:
            return _missing(lines, index)
        if line.previous != (before.sha256 if before else ""):
            if before is None:
                return ChainFault(
                    due,
                    text(
                        "was changed: it is not the line that was written first, or carries the hash of a line before "
                        "it"
                    ),
                )
            if _vouched_for(lines, index, known):
                return ChainFault(before.place, text("was changed: the next line carries the hash of another"))
            return ChainFault(
                before.place, text("was changed, or the next line was, which carries the hash of another")
            )
    last = len(lines)
    if last in known and lines and lines[-1].sha256 != known[last]:
        return ChainFault(
            last, text("was changed, or result.json was, which contains the hash {hash}… of it", hash=known[last][:12])
        )
    return None


def _vouched_for(lines: Sequence[JournalLine], index: int, known: Mapping[int, str]) -> bool:
    """Return whether the line after this one, or the result that holds its hash, shows that it is as it was."""
    if index + 1 < len(lines):
        return lines[index + 1].previous == lines[index].sha256
    return known.get(index + 1) == lines[index].sha256


def _put_in(lines: Sequence[JournalLine], index: int) -> ChainFault:
    line = lines[index]
    number = line.event.number if line.event else 0
    if number == index and line.previous == (lines[index - 2].sha256 if index >= 2 else ""):
        # This one follows from the last but one: what stands between them does not belong there.
        return ChainFault(index, text("was inserted: the next line follows from the line before it"))
    return ChainFault(
        index + 1,
        text(
            "contains event {number} where event {due} is expected: it was inserted, or moved",
            number=number,
            due=index + 1,
        ),
    )


def _missing(lines: Sequence[JournalLine], index: int) -> ChainFault:
    due = index + 1
    event = lines[index].event
    number = event.number if event else due
    later = {line.event.number for line in lines[index:] if line.event}
    gone = [missing for missing in range(due, min(number, due + len(lines) + 1)) if missing not in later]
    if not gone:
        what = text(
            "contains event {number} where event {due} is expected: the order of the lines was changed",
            number=number,
            due=due,
        )
    elif number == due + 1:
        what = text(
            "contains event {number} where event {due} is expected: event {due} was removed", number=number, due=due
        )
    else:
        what = text(
            "contains event {number} where event {due} is expected: events {due} to {last} were removed",
            number=number,
            due=due,
            last=number - 1,
        )
    return ChainFault(due, what)
