"""Records of motors that no line has measured."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

from bench.eol.record import MotorRecord
from bench.eol.verdict import Verdict

NOON = datetime(2026, 11, 21, 12, 0, 0, 123456, tzinfo=UTC)


def motor_record(number: int = 1, **changes: Any) -> MotorRecord:
    """A motor of one batch that failed, without figures and checks."""
    created = MotorRecord(
        identifier=f"{number:036d}",
        batch="B1",
        number=number,
        plan="Pump",
        plan_sha256="0" * 64,
        station="S",
        socket="1",
        person="王工",
        model="LG-400W",
        serial_number=f"P-{number:04d}",
        started=NOON,
        ended=NOON + timedelta(seconds=3),
        verdict=Verdict.FAIL,
        first_pass=False,
        bench_time=12.5,
    )
    return replace(created, **changes)
