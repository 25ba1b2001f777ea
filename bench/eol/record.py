"""Record that is kept of every motor, plain: stores, statistics and exports all take this."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime

from bench.eol.verdict import Verdict


@dataclass(frozen=True)
class MeasuredFigure:
    """One figure of a motor: value and standard uncertainty in `unit`, expanded uncertainty (95 %), limits, verdict.

    `low` and `high` are infinite where there is no limit. `label` is what readers call a parameter that is not in the table.
    """

    parameter: str
    value: float
    unit: str
    standard_uncertainty: float
    expanded: float
    low: float
    high: float
    verdict: Verdict
    label: str = ""


@dataclass(frozen=True)
class CheckRecord:
    """One attempt at one procedure of the plan: how long it took (s of bench time), what came of it, and why not."""

    procedure: str
    attempt: int
    verdict: Verdict
    duration: float
    cause: str = ""


@dataclass(frozen=True)
class MotorRecord:
    """One motor's test by a plan. `identifier` is its own for ever: a record that arrives twice is stored once.

    `started` and `ended` are UTC. `number` counts within the batch from 1; `first_pass` tells whether it passed with every
    check's first attempt. `run` names the run's folder, `journal_sha256` its journal's end, `waveforms` each file's SHA-256.
    Of one that failed `diagnosis` names the parts at fault with the figures behind, `rework` their codes, both the likeliest first.
    Causes and diagnosis are in the batch's language; `told` has them for readers of any (`bench.eol.told_causes`).
    `test_number` counts the tests of the serial number as far as they were known when it was admitted; `again_by` names the
    person who had it tested again. A `golden` motor is tested to watch the station, and counts in no yield.
    """

    identifier: str
    batch: str
    number: int
    plan: str
    plan_sha256: str
    station: str
    socket: str
    person: str
    model: str
    serial_number: str
    started: datetime
    ended: datetime
    verdict: Verdict
    first_pass: bool
    bench_time: float
    measured: tuple[MeasuredFigure, ...] = ()
    checks: tuple[CheckRecord, ...] = ()
    cause: str = ""
    run: str = ""
    journal_sha256: str = ""
    diagnosis: str = ""
    rework: str = ""
    waveforms: Mapping[str, str] = field(default_factory=dict)
    test_number: int = 1
    again_by: str = ""
    golden: bool = False
    # A record without it has the same content, and digest, as an older program's.
    told: str = field(default="", metadata={"optional": True})


def label_of(record: MotorRecord) -> str:
    """Return a motor's label: serial number, type, verdict, when (UTC), plan, socket, and the record's first eight digits.

    One that failed has the rework codes of the parts at fault in the end.
    """
    return " | ".join(
        (
            record.serial_number,
            record.model,
            record.verdict.value.upper(),
            record.ended.strftime("%Y-%m-%d %H:%M UTC"),
            record.plan,
            f"socket {record.socket}",
            record.identifier[:8],
            *((record.rework,) if record.rework else ()),
        )
    )
