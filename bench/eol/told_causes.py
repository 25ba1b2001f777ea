"""Why a motor did not pass, as its record keeps it: in the batch's language, and for readers of any."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from bench.eol.record import MotorRecord
from bench.i18n.errors import untranslated
from bench.journal.stored_result import restore_text, store_text
from drivers.interfaces.text import Text


def told_causes(cause: Text, diagnosis: Sequence[Text], attempts: Mapping[tuple[str, int], Text]) -> str:
    """Return as a record's `told` what its cause, its diagnosis and, by procedure and number, its attempts' causes say.

    Empty where nothing is said, as of most motors that pass.
    """
    content: dict[str, Any] = {
        "cause": store_text(cause) if cause.render() else None,
        "diagnosis": [store_text(each) for each in diagnosis],
        "attempts": [[procedure, number, store_text(each)] for (procedure, number), each in attempts.items()],
    }
    return json.dumps(content, separators=(",", ":")) if any(content.values()) else ""


def cause_of(record: MotorRecord) -> Text:
    """Return why the motor did not pass, for a reader of any language; older records have the batch's only."""
    return cause_told(record.told, record.cause)


def cause_told(told: str, words: str) -> Text:
    """Return a record's cause by what of it is `told`, else its `words`."""
    stored = _content(told).get("cause")
    return untranslated(words) if stored is None else _restored(stored, words)


def diagnosis_of(record: MotorRecord) -> tuple[Text, ...]:
    """Return the parts at fault with the figures behind, one each, for a reader of any language; older records as `cause_of`."""
    stored = _content(record.told).get("diagnosis") or ()
    older = [words for words in record.diagnosis.split("; ") if words]
    return tuple(_restored(each, record.diagnosis) for each in stored) or tuple(map(untranslated, older))


def last_causes(record: MotorRecord) -> dict[str, Text]:
    """Return by procedure why its last attempt did not pass, for a reader of any language; older records as `cause_of`."""
    stored = {(procedure, number): each for procedure, number, each in _content(record.told).get("attempts", ())}
    last = {attempt.procedure: attempt for attempt in record.checks}
    return {
        name: _restored(stored[name, attempt.attempt], attempt.cause)
        if (name, attempt.attempt) in stored
        else untranslated(attempt.cause)
        for name, attempt in last.items()
        if attempt.cause
    }


def _content(told: str) -> Mapping[str, Any]:
    try:
        content = json.loads(told or "{}")
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}


def _restored(stored: Mapping[str, Any], words: str) -> Text:
    """Return a sentence; one that cannot be said stands in the batch's language, for a record is read whatever became of it."""
    try:
        return restore_text(stored)
    except (ValueError, KeyError, TypeError, AttributeError, IndexError):
        return untranslated(words)
