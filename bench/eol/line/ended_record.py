"""What the record of every motor says, whether its passage came to its end or was cut off."""

from datetime import UTC, datetime

from bench.eol.line.messages import Batch, Task
from bench.eol.line.unit_names import identifier
from bench.eol.record import MotorRecord
from bench.eol.verdict import Verdict


def ended_record(
    batch: Batch, socket: str, task: Task, started: datetime, verdict: Verdict, *, first_pass: bool, bench_time: float
) -> MotorRecord:
    """Return the record of a motor whose passage ends now, without what was measured; `bench_time` in s."""
    return MotorRecord(
        identifier=identifier(batch.uid, task.number),
        batch=batch.name,
        number=task.number,
        plan=batch.plan.name,
        plan_sha256=batch.plan.sha256,
        station=batch.line,
        socket=socket,
        person=batch.person,
        model=batch.motor.nameplate.name,
        serial_number=task.serial_number,
        started=started,
        ended=datetime.now(UTC),
        verdict=verdict,
        first_pass=first_pass,
        bench_time=bench_time,
    )
