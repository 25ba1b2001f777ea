"""The next motor at a socket: those that were cut off first, golden ones when they are due, and none that may not be tested."""

from collections import deque
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, replace

from bench.eol.admission_rule import RefusedTest
from bench.eol.line.admission.admission_desk import AdmissionDesk
from bench.eol.line.admission.golden_gate import GoldenGate
from bench.eol.line.admission.serial_numbers import SerialNumbers
from bench.eol.line.batch_log import BatchMotor
from bench.eol.serial_number import in_other_capitals, spelled
from drivers.interfaces.text import Text, lines, text


@dataclass(frozen=True)
class RefusedSerial:
    """A serial number that is not measured, and why; a person may answer for it where that is said.

    Of one that was `taken` its batch has the verdict, or is measuring it: scanned twice, it lacks nothing.
    """

    serial_number: str
    why: Text
    by_person: bool = False
    taken: bool = False


class Admission:
    """Gives the batch's motors one by one; numbers go on after `last`.

    Serial numbers of a list that are `finished` already, or were cut off, are passed over where it begins anew. With
    `golden_by_itself`, golden motors come when they are due without being scanned. While it is `waiting`, none comes, and none at
    all once `refused` gives a reason.
    """

    def __init__(
        self,
        serials: SerialNumbers,
        cut_off: Iterable[BatchMotor],
        desk: AdmissionDesk,
        gate: GoldenGate,
        *,
        last: int = 0,
        finished: Collection[str] = (),
        golden_by_itself: bool = False,
        waiting: Callable[[], bool] = lambda: False,
        refused: Callable[[], Text | None] = lambda: None,
    ) -> None:
        self._serials = serials
        # A golden motor that was cut off is due all the same.
        self._cut_off = deque(motor for motor in cut_off if not motor.golden)
        self._desk, self.gate = desk, gate
        begun = (*finished, *(motor.serial_number for motor in self._cut_off))
        self._passed_over = set(map(spelled, begun)) if serials.listed else set()
        self._golden_by_itself = golden_by_itself
        self._waiting, self._refused = waiting, refused
        self._last = last
        self._next: str | None = None
        self._under_way: set[str] = set()
        self._closed: set[str] = set()
        #: Why there will be no more although serial numbers are left, None where there may be.
        self.held_up: Text | None = None

    @property
    def descriptor(self) -> int | None:
        """The descriptor that becomes readable when there may be a motor; None if `take` never has to wait."""
        return self._serials.descriptor

    @property
    def ended(self) -> bool:
        """True if there will be no more motors."""
        return self.held_up is not None or not (self._cut_off or self._look() is not None or not self._serials.ended)

    def close(self, socket: str) -> None:
        """Give a socket no more."""
        self._closed.add(socket)

    def take(self, socket: str) -> BatchMotor | RefusedSerial | None:
        """Return the next motor for a socket, or a serial number that is refused; None where there is none for it now."""
        if self._waiting() or socket in self._closed or self.ended:
            return None
        if (why := self._refused()) is not None:
            self.held_up = why
            return None
        due = self.gate.due(socket)
        if due is not None and self._golden_by_itself:
            return self._golden(self.gate.next_golden(socket))
        if self._cut_off and due is None:
            return self._admit(self._cut_off.popleft(), socket)
        serial_number = self._look()
        if serial_number is None:
            if self._cut_off and due is not None and self._serials.ended and not self._others(socket, due=False):
                self.held_up = due
            return None
        if self.gate.is_golden(serial_number):
            return self._take_golden(serial_number, socket, due)
        if due is not None:
            return self._refuse_for_golden(serial_number, socket, due)
        self._next = None
        if serial_number in self._under_way:
            return _being_measured(serial_number)
        if other := self._under_way_in_other_capitals(serial_number):
            words = text(
                "serial number {serial} differs in capitals only from {known}, which is being measured now; if it is another motor, scan "
                "it again when that one has its verdict",
                serial=serial_number,
                known=other,
            )
            return RefusedSerial(serial_number, words)
        return self._admit(BatchMotor(self._last + 1, serial_number), socket)

    def done(self, serial_number: str) -> None:
        """Note that a motor has its record."""
        self._under_way.discard(serial_number)

    def _look(self) -> str | None:
        """Return the next serial number and leave it there."""
        while self._next is None and (taken := self._serials.take()) is not None:
            serial_number = self.gate.as_listed(spelled(taken))
            if serial_number not in self._passed_over:
                self._next = serial_number
        return self._next

    def _under_way_in_other_capitals(self, serial_number: str) -> str:
        """Return the motor in a socket that this one probably is, scanned with Caps Lock on; empty where the plan says what it takes."""
        if self._desk.spelling_stated or self._desk.person:
            return ""
        return next((other for other in in_other_capitals(serial_number) if other in self._under_way), "")

    def _admit(self, motor: BatchMotor, socket: str) -> BatchMotor | RefusedSerial:
        decision = self._desk.admit(motor.serial_number, motor.number, socket, motor.again_by)
        if isinstance(decision, RefusedTest):
            return RefusedSerial(motor.serial_number, decision.why, decision.by_person, decision.judged)
        self._last = max(self._last, motor.number)
        self._under_way.add(motor.serial_number)
        return replace(
            motor,
            test_number=decision.test_number,
            again_by=decision.again_by,
            judged_before=decision.judged_before,
        )

    def _golden(self, serial_number: str) -> BatchMotor:
        self._last += 1
        self._under_way.add(serial_number)
        return BatchMotor(self._last, serial_number, golden=True)

    def _take_golden(self, serial_number: str, socket: str, due: Text | None) -> BatchMotor | RefusedSerial | None:
        if due is None and self._others(socket, due=True):
            # It is for one of them, as soon as that is free.
            return None
        self._next = None
        return _being_measured(serial_number) if serial_number in self._under_way else self._golden(serial_number)

    def _refuse_for_golden(self, serial_number: str, socket: str, due: Text) -> RefusedSerial | None:
        if self._others(socket, due=False):
            return None
        if self._serials.listed:
            # What stands in a list is not scanned again: it waits for the next time.
            self.held_up = lines(
                (due, text("scan it, or put it before {serial} in the list", serial=serial_number)), "; "
            )
            return None
        self._next = None
        words = text("serial number {serial} is not measured now: {due}; scan it first", serial=serial_number, due=due)
        return RefusedSerial(serial_number, words)

    def _others(self, socket: str, *, due: bool) -> bool:
        """Tell whether there is another socket that takes motors and where a golden one is due, or is not."""
        others = self.gate.sockets - self._closed - {socket}
        return any((self.gate.due(other) is not None) == due for other in others)


def _being_measured(serial_number: str) -> RefusedSerial:
    return RefusedSerial(
        serial_number,
        text("serial number {serial}: this motor is being measured now", serial=serial_number),
        taken=True,
    )
