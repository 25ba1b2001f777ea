"""A node's heartbeat consumer (CiA 301, object 1016h) and what the drive does without a heartbeat (CiA 402, 6007h)."""

import threading
from collections.abc import Callable
from time import monotonic

from sim_instruments.instruments.cia402.power import OUT_OF_RANGE, ObjectEntry, SdoError

CONSUMER_HEARTBEAT, ABORT_CONNECTION = 0x1016, 0x6007
_HEARTBEAT = 0x700
_NO_ACTION, _QUICK_STOP, _FEWEST, _MOST = 0, 3, 0, 3
_QUICK_STOP_WORD, _DISABLE_VOLTAGE_WORD = 0x02, 0x00

#: What they add to a node's object dictionary: one entry, unused, and the profile's default, a malfunction.
ENTRIES = (
    ObjectEntry(CONSUMER_HEARTBEAT, "Consumer heartbeat time: highest subindex", "u8", "const", 0, 1),
    ObjectEntry(CONSUMER_HEARTBEAT, "Consumer heartbeat time: 1", "u32", "rw", 1, 0),
    ObjectEntry(ABORT_CONNECTION, "Abort connection option code", "i16", "rw", value=1),
)


class HeartbeatConsumer:
    """Watches for one producer's heartbeat once its first one has come; `act` is given the control word to obey without it.

    Times are of the wall's clock: it is a process that is watched, not the bench.
    """

    def __init__(
        self,
        subscribe: Callable[[int, Callable[[int, bytearray, float], None]], None],
        unsubscribe: Callable[[int], None],
        act: Callable[[int], None],
    ) -> None:
        self._subscribe, self._unsubscribe, self._act = subscribe, unsubscribe, act
        self._condition = threading.Condition()
        self._producer, self._time = 0, 0.0
        self._last: float | None = None
        self._option = 1
        self._closed = False
        self._thread: threading.Thread | None = None

    def write(self, index: int, value: int) -> bool:
        """Take a written object; return whether it is one of these. Raises SdoError for an option there is not."""
        if index == ABORT_CONNECTION:
            if not _FEWEST <= value <= _MOST:
                raise SdoError(OUT_OF_RANGE, f"object 6007h: {value} is no option of this drive")
            self._option = value
        elif index == CONSUMER_HEARTBEAT:
            self._watch(value >> 16 & 0x7F, (value & 0xFFFF) * 1e-3)
        else:
            return False
        return True

    def close(self) -> None:
        """Watch no more."""
        with self._condition:
            self._closed = True
            self._condition.notify()
        if self._thread is not None:
            self._thread.join()

    def _watch(self, producer: int, time: float) -> None:
        with self._condition:
            if self._producer:
                self._unsubscribe(_HEARTBEAT + self._producer)
            self._producer, self._time, self._last = (producer, time, None) if time else (0, 0.0, None)
            if self._producer:
                self._subscribe(_HEARTBEAT + self._producer, self._heard)
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="heartbeat consumer", daemon=True)
                self._thread.start()
            self._condition.notify()

    def _heard(self, identifier: int, data: bytearray, timestamp: float) -> None:
        with self._condition:
            self._last = monotonic()
            self._condition.notify()

    def _work(self) -> None:
        with self._condition:
            while not self._closed:
                if self._last is None:
                    self._condition.wait()
                elif (left := self._last + self._time - monotonic()) > 0.0:
                    self._condition.wait(left)
                else:
                    self._last = None
                    if self._option != _NO_ACTION:
                        self._act(_QUICK_STOP_WORD if self._option == _QUICK_STOP else _DISABLE_VOLTAGE_WORD)
