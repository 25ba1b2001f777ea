"""The heartbeat by which a drive knows that the process which started it still lives (CiA 301, error control)."""

import threading
from collections.abc import Callable
from contextlib import suppress

from can import CanError

#: Error control messages have 0x700 + node id; their byte is the producer's NMT state.
ERROR_CONTROL, OPERATIONAL = 0x700, b"\x05"


class HeartbeatProducer:
    """Sends a heartbeat at once and every `period` (s, real time) until it is stopped; it ends with the process."""

    def __init__(self, send: Callable[[int, bytes], None], producer: int, period: float) -> None:
        self._send = send
        self._identifier = ERROR_CONTROL + producer
        self._period = period
        self._stopping = threading.Event()
        # A daemon: it must not keep a process alive whose main thread has died.
        self._thread = threading.Thread(target=self._run, name=f"heartbeat of node {producer}", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop sending; returns once the last heartbeat is out."""
        self._stopping.set()
        self._thread.join()

    def _run(self) -> None:
        while True:
            # A bus that is being opened anew takes the next one; a dead one is what the drive has to notice.
            with suppress(CanError, OSError, RuntimeError):
                self._send(self._identifier, OPERATIONAL)
            if self._stopping.wait(self._period):
                return
