"""Which serial number comes next: those that were cut off first, and none that may not be measured."""

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from bench.eol.line.batch_log import Begun
from bench.eol.line.serials import Serials
from bench.eol.store.records import Passage
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError, said_by
from drivers.interfaces.text import Text, text

_VERDICTS = {
    Verdict.PASS: text("pass"),
    Verdict.FAIL: text("fail"),
    Verdict.ERROR: text("error"),
    Verdict.ABORTED: text("aborted"),
}


@dataclass(frozen=True)
class Refused:
    """A serial number that is not measured, and why."""

    serial_number: str
    why: Text


class Admission:
    """Gives the batch's motors one by one.

    `check` refuses a serial number that the plan does not allow (InputError), `earlier` finds its last passage, `batch` is this one's
    name; what had a record in it up to number `known` is passed over in silence. With `again`, motors are measured anew.
    """

    def __init__(
        self,
        serials: Serials,
        cut_off: Iterable[Begun],
        check: Callable[[str], None],
        earlier: Callable[[str], Passage | None],
        *,
        batch: str,
        known: int,
        again: bool,
    ) -> None:
        self._serials = serials
        self._cut_off = deque(cut_off)
        self._check = check
        self._earlier = earlier
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

    def take(self) -> Begun | Refused | None:
        """Return the next motor, or a serial number that is refused; None where there is none now."""
        if self._cut_off:
            motor = self._cut_off.popleft()
            self._under_way.add(motor.serial_number)
            return motor
        while (given := self._serials.take()) is not None:
            try:
                self._check(given)
            except InputError as error:
                return Refused(given, said_by(error))
            if given in self._under_way:
                return Refused(given, text("serial number {serial}: this motor is being measured now", serial=given))
            passage = None if self._again else self._earlier(given)
            if passage is None:
                self._last += 1
                self._under_way.add(given)
                return Begun(self._last, given)
            if passage.batch == self._batch and passage.number <= self._known:
                continue
            said = text(
                "serial number {serial} was measured already: {verdict} as motor {number} of batch {batch}; "
                "measure it again with --again",
                serial=given,
                verdict=_VERDICTS[passage.verdict],
                number=passage.number,
                batch=passage.batch,
            )
            return Refused(given, said)
        return None

    def done(self, serial_number: str) -> None:
        """Know that a motor has its record."""
        self._under_way.discard(serial_number)
