"""Which serial number comes next: those that were cut off first, and none that may not be measured."""

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from bench.eol.line.batch_log import BatchMotor
from bench.eol.line.serial_numbers import SerialNumbers
from bench.eol.store.records import EarlierTest
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError
from drivers.interfaces.text import Text, text, text_of

_VERDICTS = {
    Verdict.PASS: text("pass"),
    Verdict.FAIL: text("fail"),
    Verdict.ERROR: text("error"),
    Verdict.ABORTED: text("aborted"),
}


@dataclass(frozen=True)
class RefusedSerial:
    """A serial number that is not measured, and why."""

    serial_number: str
    why: Text


class Admission:
    """Gives the batch's motors one by one.

    `check` refuses a serial number that the plan does not allow (InputError), `earlier_test` finds its last test. Motors with a
    record in this `batch` up to number `known` are skipped. With `again`, motors are measured anew.
    """

    def __init__(
        self,
        serials: SerialNumbers,
        cut_off: Iterable[BatchMotor],
        check: Callable[[str], None],
        earlier_test: Callable[[str], EarlierTest | None],
        *,
        batch: str,
        known: int,
        again: bool,
    ) -> None:
        self._serials = serials
        self._cut_off = deque(cut_off)
        self._check = check
        self._earlier_test = earlier_test
        self._batch = batch
        self._known = known
        self._again = again
        self._last = known
        self._under_way: set[str] = set()

    @property
    def descriptor(self) -> int | None:
        """What becomes readable when there may be a motor; None where `take` never has to wait."""
        return self._serials.descriptor

    @property
    def ended(self) -> bool:
        """Whether there will be no more."""
        return not self._cut_off and self._serials.ended

    def take(self) -> BatchMotor | RefusedSerial | None:
        """Return the next motor, or a serial number that is refused; None where there is none now."""
        if self._cut_off:
            motor = self._cut_off.popleft()
            self._under_way.add(motor.serial_number)
            return motor
        while (serial_number := self._serials.take()) is not None:
            try:
                self._check(serial_number)
            except InputError as error:
                return RefusedSerial(serial_number, text_of(error))
            if serial_number in self._under_way:
                return RefusedSerial(
                    serial_number,
                    text("serial number {serial}: this motor is being measured now", serial=serial_number),
                )
            earlier = None if self._again else self._earlier_test(serial_number)
            if earlier is None:
                self._last += 1
                self._under_way.add(serial_number)
                return BatchMotor(self._last, serial_number)
            if earlier.batch == self._batch and earlier.number <= self._known:
                continue
            why = text(
                "serial number {serial} was measured already: {verdict} as motor {number} of batch {batch}; "
                "measure it again with --again",
                serial=serial_number,
                verdict=_VERDICTS[earlier.verdict],
                number=earlier.number,
                batch=earlier.batch,
            )
            return RefusedSerial(serial_number, why)
        return None

    def done(self, serial_number: str) -> None:
        """Note that a motor has its record."""
        self._under_way.discard(serial_number)
