"""Our drivers of contacts and relays conform, each at a place of its own; mistakes in one of them are found."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

import can
import numpy as np
import pytest

from bench.plugins.catalogues import installed
from bench.testing.conformance import ContactPlace, RelayPlace, check_interlock, check_watchdog_relay
from bench.testing.conformance import safety_devices as checked
from bench.testing.conformance.kit import Conformance
from drivers.beckhoff.bk9000 import BeckhoffRelay
from drivers.interfaces import CommunicationError
from drivers.interlocks.modbus import ModbusInterlock
from sim_instruments.clock.paced_clock import PacedClock
from sim_instruments.instruments.beckhoff.bk9000 import Bk9000
from sim_instruments.server.safety_contacts import InputModule, SafetyContacts
from sim_instruments.transports.loop_thread import LoopThread
from sim_instruments.transports.modbus.tcp import ModbusTcpServer
from sim_instruments.transports.modbus.unit import ModbusLine
from sim_instruments.transports.tcp_service import TcpService

_CHANNEL, _FRAME = "conforming-door", 0x1A0
# A busy machine holds an answer up by a tenth of a second.
OPTIONS: dict[str, dict[str, Any]] = {
    "modbus-input": {"number": 0, "timeout": 0.5},
    "can-frame": {"frame": _FRAME, "byte": 0, "bit": 0, "timeout": 0.4},
    "beckhoff-bk9000": {"watchdog_time": 1.2, "timeout": 0.5},
}


@contextmanager
def served(unit: Any) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Give a Modbus unit's address and what keeps it silent."""
    clock, loop = PacedClock(1.0), LoopThread("units")
    line = ModbusLine((unit,), clock, np.random.default_rng(1))

    async def wait(_: float) -> None:
        return

    service = TcpService(ModbusTcpServer(line, wait).serve, "127.0.0.1", connection=line.connection)
    loop.run(service.start())

    @contextmanager
    def silent() -> Iterator[None]:
        line.connection.pull()
        try:
            yield
        finally:
            line.connection.plug()

    try:
        yield f"tcp://127.0.0.1:{service.port}", silent
    finally:
        loop.run(service.stop())
        clock.close()
        loop.close()


@contextmanager
def module() -> Iterator[ContactPlace]:
    contacts = SafetyContacts()
    with served(InputModule(contacts)) as (address, silent):
        yield ContactPlace(address, partial(contacts.set, "emergency_stop"), silent)


@contextmanager
def frames() -> Iterator[ContactPlace]:
    """A sender of frames, of which the first bit is the contact."""
    now, sending, ended = [1], threading.Event(), threading.Event()
    sending.set()

    def send(bus: can.BusABC) -> None:
        while not ended.wait(0.005):
            if sending.is_set():
                bus.send(can.Message(arbitration_id=_FRAME, data=now, is_extended_id=False))

    @contextmanager
    def silent() -> Iterator[None]:
        sending.clear()
        try:
            yield
        finally:
            sending.set()

    with can.Bus(interface="virtual", channel=_CHANNEL) as bus:
        sender = threading.Thread(target=send, args=(bus,))
        sender.start()
        try:
            yield ContactPlace(f"can://virtual/{_CHANNEL}", lambda closed: now.__setitem__(0, int(closed)), silent)
        finally:
            ended.set()
            sender.join()


@contextmanager
def coupler() -> Iterator[RelayPlace]:
    found = [False]
    unit = Bk9000(lambda closed: found.__setitem__(0, closed))
    try:
        with served(unit) as (address, silent):
            yield RelayPlace(address, lambda: found[0], silent)
    finally:
        unit.close()


CONTACTS = {"modbus-input": module, "can-frame": frames}
RELAYS = {"beckhoff-bk9000": coupler}


@pytest.mark.parametrize("name", sorted(installed().interlocks))
def test_our_contacts_conform(name: str) -> None:
    with CONTACTS[name]() as place:
        report = check_interlock(name, place, options=OPTIONS[name])
    report.require()
    assert len(report.findings) == 8


@pytest.mark.parametrize("name", sorted(installed().watchdog_relays))
def test_our_relays_conform(name: str, tmp_path: Any) -> None:
    with RELAYS[name]() as place:
        report = Conformance(tmp_path).watchdog_relay(name, place, options=OPTIONS[name])
    assert len(report.findings) > 12


class Remembering(ModbusInterlock):
    """Tells what it has read before where nobody answers."""

    def closed(self) -> bool:
        try:
            self._last = super().closed()
        except CommunicationError:
            return getattr(self, "_last", True)
        return self._last


def test_a_contact_that_is_told_though_nobody_answers_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checked, "PATIENCE", 0.6)
    driver = replace(installed().interlocks["modbus-input"], opener=Remembering)
    with module() as place:
        report = check_interlock(driver, place, options=OPTIONS["modbus-input"])
    assert [one.check for one in report.failures] == ["a silence", "opened while nobody answers"]


class Wrong(BeckhoffRelay):
    """Feeds when it is asked, and does not ask before it feeds."""

    def picked_up(self) -> bool:
        found = super().picked_up()
        self._switch(found)
        return found

    def feed(self) -> None:
        self._reset()
        self._switch(True)


def test_a_relay_that_is_fed_by_questions_and_picked_up_by_food_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.beckhoff.bk9000.BeckhoffRelay", Wrong)
    with coupler() as place:
        report = check_watchdog_relay("beckhoff-bk9000", place, options=OPTIONS["beckhoff-bk9000"])
    found = {one.check for one in report.failures}
    assert {"not fed, but asked", "fed after it has dropped out"} <= found
