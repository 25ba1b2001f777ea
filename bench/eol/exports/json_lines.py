"""JSON lines: one whole record a line; numbers that are none, and limits that are not there, are null."""

import json
import math
from collections.abc import Iterable
from dataclasses import asdict
from datetime import datetime
from enum import Enum
from typing import IO, Any

from bench.eol.record import CheckRecord, Measured, MotorRecord
from bench.eol.verdict import Verdict


def write_json_lines(records: Iterable[MotorRecord], file: IO[bytes]) -> int:
    """Write records; return how many."""
    count = 0
    for record in records:
        line = json.dumps(_plain(asdict(record)), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        file.write(line.encode("utf-8") + b"\n")
        count += 1
    return count


def read_json_line(line: str | bytes) -> MotorRecord:
    """Return the record of a line."""
    told = json.loads(line)
    missing = {
        "value": math.nan,
        "standard_uncertainty": math.nan,
        "expanded": math.nan,
        "low": -math.inf,
        "high": math.inf,
    }
    measured = tuple(
        Measured(
            **{**figure, **{name: none for name, none in missing.items() if figure[name] is None}}
            | {"verdict": Verdict(figure["verdict"])}
        )
        for figure in told["measured"]
    )
    checks = tuple(CheckRecord(**{**check, "verdict": Verdict(check["verdict"])}) for check in told["checks"])
    times = {name: datetime.fromisoformat(told[name]) for name in ("started", "ended")}
    return MotorRecord(**{**told, **times, "verdict": Verdict(told["verdict"]), "measured": measured, "checks": checks})


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
