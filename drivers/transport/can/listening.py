"""Listeners of python-can's: what the thread that waits for frames does with them, and where the line breaks."""

import threading
from time import monotonic

import can


class BrokenLine(can.Listener):
    """Lets the listening thread of a broken bus rest until the bus is left, instead of trying without end.

    Whoever waits for a reply is told by its absence.
    """

    def __init__(self, leaving: threading.Event) -> None:
        self._leaving = leaving

    def on_message_received(self, msg: can.Message) -> None:
        """Leave frames to the others."""

    def on_error(self, exc: Exception) -> None:
        """Wait until the bus is left."""
        self._leaving.wait()

    def stop(self) -> None:
        """Hold nothing that would have to be given back."""


class LatestFrame(can.Listener):
    """Keeps the latest data frame until it is taken."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._data: bytes | None = None
        self._arrived = 0.0
        self._error: Exception | None = None
        self._leaving = threading.Event()

    def take(self, timeout: float) -> bytes | None:
        """Return the bytes of a frame not taken yet and not older than `timeout` (s), or of the next one within that time.

        None where none comes. Raises what the bus raised where that is broken.
        """
        now = monotonic()
        end = now + timeout
        with self._changed:
            if now - self._arrived > timeout:
                self._data = None
            while self._data is None and self._error is None and (left := end - monotonic()) > 0.0:
                self._changed.wait(left)
            data, self._data = self._data, None
            if data is None and self._error is not None:
                raise self._error
            return data

    def on_message_received(self, msg: can.Message) -> None:
        """Keep a frame in place of the one before."""
        if msg.is_error_frame or msg.is_remote_frame:
            return
        with self._changed:
            self._data, self._arrived = bytes(msg.data), monotonic()
            self._changed.notify_all()

    def on_error(self, exc: Exception) -> None:
        """Keep an error, and rest until the bus is left."""
        with self._changed:
            self._error = exc
            self._changed.notify_all()
        self._leaving.wait()

    def leave(self) -> None:
        """End an idle thread."""
        self._leaving.set()

    def stop(self) -> None:
        """Hold nothing that would have to be given back."""
