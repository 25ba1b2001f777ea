"""What the tests of a batch come to."""

from collections import Counter
from dataclasses import dataclass, field

from bench.eol.admission_rule import takes_again
from bench.eol.exports.json_lines import motor_as_dict
from bench.eol.line.admission.next_motor import RefusedSerial
from bench.eol.line.batch_listener import BatchListener
from bench.eol.line.batch_log import BatchMotor
from bench.eol.line.brakes import AppliedBrake
from bench.eol.motor_yield import MotorYield
from bench.eol.plan_file import RetestSection
from bench.eol.record import MotorRecord
from bench.eol.store.waiting import Waiting
from bench.plugins.records import RecordOutputs
from drivers.interfaces.text import Text


@dataclass
class Counts:
    """Outcome of a batch's tests, by verdict, golden motors' beside them; yields by motor; serial numbers refused.

    `untested` are those refused that the batch has not tested either, before or after. `brakes` are those that applied, `undecidable`
    tells of limits that the station cannot decide; `waits` is what still waits at the end. Motors of `no_verdict` ended with an error
    or were aborted, and the plan takes them again.
    """

    verdicts: Counter[str] = field(default_factory=Counter)
    by_motor: MotorYield = field(default_factory=MotorYield)
    golden: Counter[str] = field(default_factory=Counter)
    refused: int = 0
    untested: set[str] = field(default_factory=set)
    no_verdict: set[str] = field(default_factory=set)
    brakes: list[AppliedBrake] = field(default_factory=list)
    #: Whether the line itself ended the batch before its end, and why where no brake says it.
    unfinished: bool = False
    held_up: Text | None = None
    undecidable: tuple[Text, ...] = ()
    waits: Waiting = field(default_factory=Waiting)
    bench_time: float = 0.0

    @property
    def motors(self) -> int:
        """The tests of motors with a record, golden ones' not among them."""
        return sum(self.verdicts.values())


class CountingListener(BatchListener):
    """Counts motors by verdict, and hands their records to outputs."""

    def __init__(self, counts: Counts, outputs: RecordOutputs, again: RetestSection) -> None:
        self._counts, self._outputs, self._again = counts, outputs, again

    def begun(self, motor: BatchMotor, socket: str) -> None:
        """Count a motor that was judged before."""
        if motor.judged_before:
            self._counts.by_motor.judged_before(motor.serial_number)

    def done(self, record: MotorRecord) -> None:
        """Count a test by its verdict, and hand its record to the outputs."""
        (self._counts.golden if record.golden else self._counts.verdicts)[record.verdict.value] += 1
        self._counts.by_motor.add(record)
        self._counts.untested.discard(record.serial_number)
        if not record.golden:
            self._counts.no_verdict.discard(record.serial_number)
            if takes_again(record.verdict, record.test_number, self._again):
                self._counts.no_verdict.add(record.serial_number)
        self._counts.bench_time += record.bench_time
        # It is kept already: whatever becomes of it here, no record is lost.
        if self._outputs.wanted:
            self._outputs.hand(motor_as_dict(record))

    def refused(self, refused: RefusedSerial) -> None:
        """Count a serial number that is not tested."""
        self._counts.refused += 1
        if not refused.taken:
            self._counts.untested.add(refused.serial_number)

    def braked(self, brake: AppliedBrake) -> None:
        """Keep a brake that has applied."""
        self._counts.brakes.append(brake)
