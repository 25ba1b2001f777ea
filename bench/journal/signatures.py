"""Signatures of a run: each contains the hash of the journal's end at that time, so that a later change is detected."""

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from enum import Enum
from pathlib import Path

from bench.i18n.errors import InputError
from bench.i18n.hidden_signs import hidden_sign
from bench.journal.disk import write_file
from bench.journal.events.run import RunBegun, RunFinished
from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder
from bench.journal.run_result import end_of
from drivers.interfaces.text import Text, text

_FILE = "signatures.json"
_LONGEST, _LONGEST_NAME = 500, 200


class Meaning(Enum):
    """Role in which a person signs."""

    MEASURED = "measured"
    CHECKED = "checked"
    APPROVED = "approved"


#: The meanings in words, by their names in the file.
MEANINGS: Mapping[str, Text] = {
    Meaning.MEASURED.value: text("I measured this motor"),
    Meaning.CHECKED.value: text("I checked the record"),
    Meaning.APPROVED.value: text("I approve the result"),
}


@dataclass(frozen=True)
class Signature:
    """One signature: who, as what, when (ISO 8601, UTC), the words, number and hash of the journal's last event, and what it means.

    Signatures of older runs have no meaning.
    """

    person: str
    role: str
    time: str
    words: str
    events: int
    sha256: str
    holds: bool = True
    meaning: str = ""


def sign(folder: RunFolder, person: str, role: str, words: str, when: datetime, meaning: Meaning) -> None:
    """Add a signature to a run that has ended.

    Raises InputError where nobody signs, or signs the same again, the run has no end, its journal is not whole, or the
    file cannot be written.
    """
    if not person.strip():
        raise InputError(text("a signature needs the name of the person who signs"))
    hidden = hidden_sign(person.strip())
    if hidden or len(person.strip()) > _LONGEST_NAME:
        raise InputError(
            text(
                "the name of the person who signs contains the sign {sign}, which cannot be read; allowed are up to {longest} "
                "printable characters on one line",
                sign=hidden,
                longest=_LONGEST_NAME,
            )
            if hidden
            else text(
                "the name of the person who signs has {count} characters; up to {longest} are allowed",
                count=len(person.strip()),
                longest=_LONGEST_NAME,
            )
        )
    if len(words) > _LONGEST:
        raise InputError(
            text("the remark has {count} characters; up to {longest} are allowed", count=len(words), longest=_LONGEST)
        )
    journal = read_journal(folder.journal)
    if not journal.events or not isinstance(journal.events[-1].event, RunFinished):
        raise InputError(text("{name} has not ended; only a run that has ended can be signed", name=folder.path.name))
    end = end_of(journal)
    made = Signature(
        person.strip(),
        role,
        when.isoformat(timespec="seconds"),
        words.strip(),
        end["events"],
        end["sha256"],
        meaning=meaning.value,
    )
    before = _stored(_path(folder))
    if any(replace(one, time=made.time) == made for one in before):
        raise InputError(
            text("{person} has signed this already: {meaning}", person=made.person, meaning=MEANINGS[made.meaning])
        )
    kept = [*before, made]
    content = json.dumps(
        [{k: v for k, v in asdict(s).items() if k != "holds"} for s in kept], ensure_ascii=False, indent=2
    )
    try:
        write_file(_path(folder), content.encode("utf-8", "backslashreplace") + b"\n")
    except OSError as error:
        raise InputError(
            text("{path}: the signature was not written: {error}", path=_path(folder), error=error)
        ) from error


def signatures(folder: RunFolder) -> Sequence[Signature]:
    """Return a run's signatures; one whose journal went on or was changed since does not hold any more."""
    stored = _stored(_path(folder))
    if not stored:
        return ()
    end = end_of(read_journal(folder.journal))
    return [Signature(**{**asdict(s), "holds": (s.events, s.sha256) == (end["events"], end["sha256"])}) for s in stored]


def asked_of(start: RunBegun | None) -> int:
    """Return how many signatures, each by another person, the station of a run asks for."""
    try:
        station = tomllib.loads(start.station_file if start is not None else "").get("station", {})
        return int(station.get("signatures", 0))
    except (tomllib.TOMLDecodeError, AttributeError, TypeError, ValueError):
        return 0


def _path(folder: RunFolder) -> Path:
    return folder.path / _FILE


def _stored(path: Path) -> list[Signature]:
    try:
        return [Signature(**entry) for entry in json.loads(path.read_text(encoding="utf-8"))]
    except FileNotFoundError:
        return []
    except (OSError, ValueError, TypeError) as error:
        raise InputError(text("{path}: these are no signatures: {error}", path=path, error=error)) from None
