"""Our writer: 30 figures a motor judged by a plan's limits, made a record, durable in SQLite before the motor is told done.

Prints a motor's serial number when its record is kept.
"""

import itertools
import sys
import uuid
from datetime import UTC, datetime

from bench.eol.limits import GuardBand, ParameterLimits
from bench.eol.line.judging import MotorJudge
from bench.eol.record import CheckRecord, MotorRecord
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from procedures.core.result import Parameter

COUNT = 30
LIMITS = {f"parameter_{n:02d}": ParameterLimits(0.9 * (n + 1), 1.1 * (n + 1)) for n in range(COUNT)}


def figures() -> list[Parameter]:
    return [
        Parameter(
            f"parameter_{n:02d}",
            (n + 1) * 1.01,
            "Ω",
            (n + 1) * 1e-3,
            9.0,
            ((n + 1) * 1.008, (n + 1) * 1.012),
            "study",
            "3",
            "none",
        )
        for n in range(COUNT)
    ]


def record(number: int) -> MotorRecord:
    started = datetime.now(UTC)
    judge = MotorJudge((), LIMITS, GuardBand.STRICT, 1.0)
    measured = tuple(judge.measured(figure) for figure in figures())
    verdict = judge.verdict(measured, aborted=False, planned=0)
    if verdict is not Verdict.PASS:
        raise SystemExit("the motor did not pass")
    return MotorRecord(
        identifier=str(uuid.uuid4()),
        batch="study",
        number=number,
        plan="study",
        plan_sha256="0" * 64,
        station="S",
        socket="1",
        person="",
        model="M",
        serial_number=f"P-{number:07d}",
        started=started,
        ended=datetime.now(UTC),
        verdict=verdict,
        first_pass=True,
        bench_time=1.0,
        measured=measured,
        checks=(CheckRecord("study", 1, verdict, 1.0),),
    )


def main() -> None:
    folder, motors = sys.argv[1], int(sys.argv[2])
    records = Records(open_database(folder + "/records.sqlite"))
    for number in itertools.islice(itertools.count(1), motors or None):
        made = record(number)
        records.save(made)
        print(made.serial_number, flush=True)


if __name__ == "__main__":
    main()
