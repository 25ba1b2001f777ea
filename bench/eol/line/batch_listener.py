"""Listeners to the events of a batch: the terminal, panels, outputs, counts."""

from bench.eol.line.admission.next_motor import RefusedSerial
from bench.eol.line.batch_log import BatchMotor
from bench.eol.line.brakes import AppliedBrake
from bench.eol.record import MotorRecord
from bench.eol.store.waiting import Waiting
from drivers.interfaces.text import Text


class BatchListener:
    """Passes what it hears on to other listeners, in their order; one of its own has those methods that concern it."""

    _listeners: "tuple[BatchListener, ...]" = ()

    def __init__(self, *listeners: "BatchListener") -> None:
        self._listeners = listeners

    def begun(self, motor: BatchMotor, socket: str) -> None:
        """Hear that a motor is measured from now on."""
        for listener in self._listeners:
            listener.begun(motor, socket)

    def done(self, record: MotorRecord) -> None:
        """Hear that a motor's record is kept."""
        for listener in self._listeners:
            listener.done(record)

    def refused(self, refused: RefusedSerial) -> None:
        """Hear that a serial number is not measured."""
        for listener in self._listeners:
            listener.refused(refused)

    def braked(self, brake: AppliedBrake) -> None:
        """Hear that a socket or the line takes no more motors."""
        for listener in self._listeners:
            listener.braked(brake)

    def trouble(self, words: Text) -> None:
        """Hear of something that went wrong and concerns no motor's figures."""
        for listener in self._listeners:
            listener.trouble(words)

    def noted(self, words: Text) -> None:
        """Hear of something that is allowed and likely not meant, as a limit that the station cannot decide."""
        for listener in self._listeners:
            listener.noted(words)

    def waits(self, waiting: Waiting) -> None:
        """Hear what of the records waits to be stored or forwarded, at each change and from any thread."""
        for listener in self._listeners:
            listener.waits(waiting)
