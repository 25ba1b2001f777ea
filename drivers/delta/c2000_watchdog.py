"""A Delta C2000's watch over the process that drives it: its communication time-out, armed, fed and put back.

09-02 is what the drive does without communication, 09-03 after how long (0.1 s; 0 never): the VFD-B manual, and the notes of a
program for a C2000 (adigupta2004/SRE), which call 2 a fault with coasting where that manual calls it a warning.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from drivers.bases.set_points import check_setpoint
from drivers.delta.options import communication_watchdog
from drivers.interfaces import InstrumentError, ReportedError, Watchdog
from drivers.interfaces.text import text
from drivers.transport.modbus.line import ModbusLine

TREATMENT, TIME_OUT, STATUS = 0x0902, 0x0903, 0x2101
#: Treatment "warn" (or fault) "and coast to stop".
COAST = 2
TIME_STEP = 0.1
SHORTEST_TIME, LONGEST_TIME = 0.5, 100.0
_WITHOUT = text(
    "See whether the drive has the parameter, unlocked; a drive without it has no watchdog: watchdog_time = 0"
)
#: Questions within the time after which the drive stops: two may be lost.
QUESTIONS = 3


class CommunicationWatchdog:
    """The two parameters of one drive, as they were after `disarm`."""

    def __init__(self, line: ModbusLine, unit: int) -> None:
        self._line = line
        self._unit = unit
        self._time = 0.0
        self._before: dict[int, int] = {}

    @property
    def armed(self) -> Watchdog | None:
        """Watchdog as armed."""
        return communication_watchdog(self._time)

    def arm(self, time: float) -> None:
        """Make the drive coast to a stop if it receives no request for `time` (s).

        What is set is read back. Raises SetpointError for a time that cannot be, ReportedError where the drive has no such
        parameters or does not keep them.
        """
        check_setpoint(self._line.name, "watchdog_time", time, "s", SHORTEST_TIME, LONGEST_TIME, "the model (09-03)")
        try:
            # The treatment first: a time that runs out under another one might ramp, or go on.
            self._set(TREATMENT, COAST, "09-02 treatment of lost communication")
            self._set(TIME_OUT, round(time / TIME_STEP), "09-03 communication time-out")
        except InstrumentError as error:
            self.disarm()
            if isinstance(error, ReportedError) and not error.remedy:
                raise ReportedError(error.instrument, error.what, command=error.command, remedy=_WITHOUT) from error
            raise
        self._time = time

    @contextmanager
    def fed(self) -> Iterator[None]:
        """Keep the drive's communication watchdog from acting within the block, for any waiting time of the run."""
        if not self._time:
            yield
            return
        ending = threading.Event()
        thread = threading.Thread(target=self._feed, args=(ending,), name="C2000 watchdog", daemon=True)
        thread.start()
        try:
            yield
        finally:
            ending.set()
            thread.join()

    def disarm(self) -> None:
        """Put the parameters back where the drive still answers; one that does not has stopped by itself."""
        before, self._before, self._time = self._before, {}, 0.0
        with suppress(InstrumentError):
            for address, value in reversed(before.items()):
                self._line.write(self._unit, address, value, "09-02, 09-03 as they were")

    def _set(self, address: int, value: int, what: str) -> None:
        found = self._line.read(self._unit, address, 1, what)[0]
        if found != value:
            self._before[address] = found
            self._line.write(self._unit, address, value, what)
            self._read_back(address, value, what)

    def _read_back(self, address: int, value: int, what: str) -> None:
        found = self._line.read(self._unit, address, 1, what)[0]
        if found != value:
            raise ReportedError(
                self._line.name,
                text("{what} is {found} after {value} was written", what=what, found=found, value=value),
                command=f"{address:04X}H",
                remedy=_WITHOUT,
            )

    def _feed(self, ending: threading.Event) -> None:
        while not ending.wait(self._time / QUESTIONS):
            # A question without an answer is what the drive, too, has noticed.
            with suppress(InstrumentError):
                self._line.read(self._unit, STATUS, 1, "status")
