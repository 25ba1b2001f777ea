"""JSON lines: one whole record a line; numbers that are none, and limits that are not there, are null."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import IO, Any

from bench.eol.record import MotorRecord
from bench.plugins.records import RecordOutput


def motor_as_dict(record: MotorRecord) -> dict[str, Any]:
    """Return a record in JSON's types, as outputs take it."""
    return {"kind": "motor", **_as_dict(record)}


def append(record: Mapping[str, Any], folder: Path) -> None:
    """Append a record to `records.jsonl` in a folder. Raises OSError where that cannot be done."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "records.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps(record, ensure_ascii=False, separators=(",", ":")) + "\n")


#: `json-lines`: a file of all records beside the runs.
RECORDS = RecordOutput("json-lines", append)


def write_json_lines(records: Iterable[MotorRecord], file: IO[bytes]) -> int:
    """Write records; return how many."""
    count = 0
    for record in records:
        line = json.dumps(_as_dict(record), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        file.write(line.encode("utf-8") + b"\n")
        count += 1
    return count


def _as_dict(record: MotorRecord) -> dict[str, Any]:
    content: dict[str, Any] = _plain(asdict(record))
    # The same again, for who reads it in another language.
    del content["told"]
    return content


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return value
