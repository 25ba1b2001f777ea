"""A recording served on real endpoints: the drivers read the same figures there, and what is unknown is refused as the protocol has it."""

import socket
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import can
import pytest
import serial
from pymodbus.client import ModbusTcpClient
from pyvisa import ResourceManager

from bench.station.clock import SystemClock
from bench.traffic.recorder import TrafficRecorder
from bench.traffic.sessions import session_of
from bench.traffic.traffic_file import SessionRecording, TrafficLine
from bench.virtual.virtual_station import as_text
from drivers.catalogue import Surroundings
from drivers.interfaces import ChannelSettings, Role, Trigger
from drivers.transport.can.buses import CanBuses
from sim_instruments.recorded.served import ServedRecording


@pytest.fixture(scope="module")
def served(recording: SessionRecording) -> Iterator[ServedRecording]:
    sessions = {role.value: session_of(recording, role, tolerant=False) for role in recording.carriers}
    with ServedRecording(sessions) as made:
        yield made


@pytest.fixture(scope="module")
def manager() -> Iterator[ResourceManager]:
    made = ResourceManager("@py")
    yield made
    made.close()


def address(served: ServedRecording, role: Role, way: str = "") -> str:
    ways = served.addresses[role.value]
    return as_text(ways[way or next(iter(ways))])


def measure(role: Role, instrument: Any) -> None:
    """Do what was recorded."""
    match role:
        case Role.SUPPLY:
            instrument.configure(1.0, 0.5)
            with instrument.energised(1.0, 0.5):
                instrument.measure_current()
        case Role.VOLTMETER:
            instrument.configure(0.1)
            instrument.measure_voltage()
        case Role.OSCILLOSCOPE:
            for channel in (1, 2):
                instrument.configure_channel(channel, ChannelSettings(10.0))
            instrument.configure_acquisition(0.02, 1000)
            instrument.configure_trigger(Trigger(None))
            instrument.initiate()
            instrument.fetch([1, 2], 2.0)
        case Role.DYNAMOMETER:
            with instrument.driving_speed(50.0):
                instrument.measure()
        case Role.INVERTER:
            with instrument.driving_frequency(2.0, 1.0):
                instrument.measure_frequency()


def figure(lines: Sequence[TrafficLine]) -> str:
    """Return the first thing that an instrument gave, a waveform with its hash."""
    return next(line.words for line in lines if line.words.startswith("gave "))


@pytest.mark.parametrize(
    ("role", "way"),
    [
        (Role.SUPPLY, "hislip"),
        (Role.VOLTMETER, "socket"),
        (Role.OSCILLOSCOPE, "hislip"),
        (Role.DYNAMOMETER, "tcp"),
        (Role.INVERTER, "can"),
    ],
)
def test_the_same_figures(recording: SessionRecording, manager: ResourceManager, role: Role, way: str) -> None:
    entry, clock = recording.station().entries[role], SystemClock()
    recorder = TrafficRecorder(clock.now)
    with ServedRecording({role.value: session_of(recording, role, tolerant=False)}) as served:
        around = Surroundings(clock, lambda: manager, can_buses=CanBuses())
        opener = partial(entry.driver.open, address(served, role, way), entry.options, around, name=entry.name)
        instrument = recorder.opened(role, opener)
        try:
            measure(role, instrument)
        finally:
            instrument.close()
    assert figure(recorder.lines(role)) == figure(recording.of(role))


def test_unknown_messages_are_queued_errors(served: ServedRecording) -> None:
    host, port = address(served, Role.SUPPLY, "socket").split("::")[1:3]
    with socket.create_connection((host, int(port)), timeout=5.0) as line, line.makefile("rb") as replies:
        line.sendall(b"*IDN?\n")
        assert replies.readline() == b"Keysight Technologies,E36313A,XXXXXXXXXX,2.1.0-1.0.4-1.12\n"
        line.sendall(b"MAKE:COFFEE?\nSYST:ERR?\n")
        assert replies.readline() == b'-113,"Undefined header"\n'
        line.sendall(b"SYST:ERR?\n")
        assert replies.readline() == b'+0,"No error"\n'


def test_unknown_requests_are_exception_1(served: ServedRecording) -> None:
    host, port = address(served, Role.DYNAMOMETER, "tcp").removeprefix("tcp://").split(":")
    with ModbusTcpClient(host, port=int(port), timeout=5.0, retries=0) as client:
        refused = client.read_holding_registers(0x1234, count=1, device_id=1)
        assert refused.isError()
        assert refused.exception_code == 1
        for _ in range(3):
            assert client.read_holding_registers(0x2100, count=1, device_id=1).registers == [0]


def test_a_node_answers_what_it_knows(served: ServedRecording) -> None:
    ways: Any = served.addresses[Role.INVERTER.value]["can"]
    with can.Bus(interface=ways["interface"], channel=ways["channel"], sleep_after_open=0.0) as bus:
        for data in ("4099990000000000", "4000100000000000"):
            bus.send(can.Message(arbitration_id=0x605, is_extended_id=False, data=bytes.fromhex(data)))
        answer = bus.recv(5.0)
    assert answer is not None
    assert (answer.arbitration_id, answer.data.hex()) == (0x585, "4300100092010200")


def test_what_streams_streams_on(served: ServedRecording) -> None:
    with serial.Serial(address(served, Role.TACHOMETER), timeout=5.0) as port:
        assert port.read_until(b"\r") == b"\x0241220100000000\r"


def test_a_port_that_is_taken(recording: SessionRecording) -> None:
    sessions = {"supply": session_of(recording, Role.SUPPLY, tolerant=False)}
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(OSError, match="in use"):
            ServedRecording(sessions, base_port=taken.getsockname()[1])
