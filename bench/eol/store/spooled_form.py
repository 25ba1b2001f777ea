"""A record as it is written into a file, with its own digest."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC
from functools import cache
from typing import Any

from pydantic import TypeAdapter

from bench.eol.record import MotorRecord
from bench.journal.encoding import plain, to_bytes


def record_content(record: MotorRecord) -> dict[str, Any]:
    """Return what of a record is written, and its digest."""
    content = plain(record)
    return {"sha256": _digest(content), "record": content}


def record_of_content(content: Mapping[str, Any]) -> MotorRecord:
    """Return the record. Raises ValueError, KeyError or TypeError for what is none as it was written."""
    changed = content["sha256"] != _digest(content["record"])
    record = _form().validate_python(content["record"])
    if changed:
        raise ValueError("its content is not what was written")
    return replace(record, started=record.started.astimezone(UTC), ended=record.ended.astimezone(UTC))


def _digest(content: object) -> str:
    return hashlib.sha256(to_bytes(json.dumps(content, ensure_ascii=False, sort_keys=True))).hexdigest()


@cache
def _form() -> TypeAdapter[MotorRecord]:
    return TypeAdapter(MotorRecord)
