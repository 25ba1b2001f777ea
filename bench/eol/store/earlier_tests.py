"""The records of one serial number: each of its tests with its place and result."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import Engine, bindparam, select

from bench.eol.record import MotorRecord
from bench.eol.serial_number import in_other_capitals, spelled, spellings
from bench.eol.store.records import utc
from bench.eol.store.schema import MOTOR
from bench.eol.verdict import Verdict


@dataclass(frozen=True)
class EarlierTest:
    """A test of a motor of the type `model`: where and when (UTC) it began, its number in its batch, and the verdict.

    `again_by` names the person who had it tested again, empty where it was the first test or the plan allowed it. `test_number`
    counts the motor's tests as far as they were known when it was admitted. `serial_number` is as the record has it.
    """

    identifier: str
    batch: str
    number: int
    plan: str
    model: str
    station: str
    socket: str
    started: datetime
    verdict: Verdict
    again_by: str = ""
    test_number: int = 1
    serial_number: str = ""

    def is_of(self, serial_number: str) -> bool:
        """Tell whether it is this motor's, and not one's whose serial number has other capitals."""
        return not self.serial_number or spelled(self.serial_number) == spelled(serial_number)


_COLUMNS = tuple(MOTOR.c[name] for name in EarlierTest.__dataclass_fields__)
#: Built once: it is asked for every motor.
_TESTS = select(*_COLUMNS).where(MOTOR.c.serial_number.in_(bindparam("of", expanding=True)), MOTOR.c.golden.is_(False))


def earlier_tests(engine: Engine, serial_number: str) -> list[EarlierTest]:
    """Return the tests of a serial number in a database, golden motors' not among them, in any order.

    Those of serial numbers that differ from it in capitals only are among them: see `EarlierTest.is_of`.
    """
    of = (*spellings(serial_number), *in_other_capitals(serial_number))
    with engine.connect() as connection:
        return [
            EarlierTest(**{**row, "started": utc(row["started"]), "verdict": Verdict(row["verdict"])})
            for row in connection.execute(_TESTS, {"of": of}).mappings()
        ]


def earlier_test_of(record: MotorRecord) -> EarlierTest:
    """Return what a record says of its test."""
    return EarlierTest(**{name: getattr(record, name) for name in EarlierTest.__dataclass_fields__})


@dataclass(frozen=True)
class PlanUse:
    """The latest test by a plan of some name: its batch, its type, and the plan's content."""

    batch: str
    model: str
    plan_sha256: str


def latest_of_plan(engine: Engine, name: str) -> PlanUse | None:
    """Return the latest use of a plan's name, None where there is none."""
    columns = (MOTOR.c.batch, MOTOR.c.model, MOTOR.c.plan_sha256)
    query = select(*columns).where(MOTOR.c.plan == name).order_by(MOTOR.c.id.desc()).limit(1)
    with engine.connect() as connection:
        row = connection.execute(query).first()
    return None if row is None else PlanUse(*row)


def in_order(tests: Iterable[EarlierTest]) -> list[EarlierTest]:
    """Return tests in the order in which they were admitted, each once however many databases have it.

    A clock may have been put back between two of them: it decides only where both knew of equally many before them.
    """
    each = {test.identifier: test for test in tests}
    return sorted(each.values(), key=lambda test: (test.test_number, test.started, test.identifier))
