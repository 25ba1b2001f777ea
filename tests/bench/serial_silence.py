"""Silence of a virtual serial line that nobody waits for: who asks is told at once that no answer will come."""

import select
import threading
import time
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pymodbus.client.serial
import pytest

from drivers.transport.modbus.tapped_client import TappedClient
from sim_instruments.transports.modbus import rtu
from sim_instruments.transports.serial.pty import PseudoTerminal


class Silence:
    """Counts what goes over one line, until its endpoint has dealt with all that was asked and answers nothing.

    Only then time passes for who waits, however busy the machine is: an answer that is late for want of a processor is no silence.
    """

    def __init__(self) -> None:
        self._asked = self._heard = self._answered = 0
        self._idle = False
        self._lock = threading.Lock()
        self._skipped = 0.0
        self._pause = threading.Event()

    def time(self) -> float:
        """Return the time (s) of who waits."""
        return time.time() + self._skipped

    def sleep(self, seconds: float) -> None:
        """Wait, and for longer than anybody's patience where no answer will come."""
        self._pause.wait(seconds)
        with self._lock:
            if self._idle and self._heard == self._asked and not self._answered:
                self._skipped += 1e3

    def asked(self, count: int) -> None:
        """Note the bytes of a question."""
        with self._lock:
            self._asked += count
            self._answered = 0

    def heard(self, count: int) -> None:
        """Note the bytes that the endpoint has taken."""
        with self._lock:
            self._heard += count

    def answered(self) -> None:
        """Note that the endpoint says something."""
        with self._lock:
            self._answered += 1

    def select(self, reading: Sequence[Any], *others: Any) -> tuple[list[Any], list[Any], list[Any]]:
        """Wait as `select.select` does; whose wait has no end has dealt with everything before."""
        with self._lock:
            self._idle = others[-1] is None
        ready = select.select(reading, *others)
        with self._lock:
            self._idle = False
        return ready


def not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have clients of the one virtual serial line of this process find at once that it stays silent."""
    silence = Silence()
    send, receive, answer = TappedClient.send, PseudoTerminal.receive, PseudoTerminal.send

    def asking(client: TappedClient, request: bytes, addr: tuple[str, int] | None = None) -> int:
        # Noted before it is sent: whoever hears it cannot be ahead of that.
        silence.asked(len(request))
        return send(client, request, addr)

    def hearing(terminal: PseudoTerminal, count: int = 4096) -> bytes:
        data = receive(terminal, count)
        silence.heard(len(data))
        return data

    def answering(terminal: PseudoTerminal, data: bytes) -> int:
        silence.answered()
        return answer(terminal, data)

    monkeypatch.setattr(TappedClient, "send", asking)
    monkeypatch.setattr(PseudoTerminal, "receive", hearing)
    monkeypatch.setattr(PseudoTerminal, "send", answering)
    monkeypatch.setattr(rtu, "select", silence)
    monkeypatch.setattr(pymodbus.client.serial, "time", SimpleNamespace(time=silence.time, sleep=silence.sleep))
