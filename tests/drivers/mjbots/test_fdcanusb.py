"""A moteus behind an fdcanusb: lines of text on a serial port, to the byte."""

import os
import pty
import select
import threading
import tty
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from drivers.interfaces import CommunicationError
from drivers.transport.can.buses import CanBuses
from drivers.transport.can.fdcanusb import FdcanusbNode
from drivers.transport.canonical_address import canonical_addresses, is_serial_line
from tests.drivers.mjbots.conftest import Moteus


class Adapter:
    """An fdcanusb with a moteus behind it."""

    def __init__(self, moteus: Moteus) -> None:
        self.lines: list[str] = []
        self.acknowledges = b"OK\r\n"
        self.first = b""
        self._moteus = moteus
        self._end, other = pty.openpty()
        tty.setraw(other)
        self.port = os.ttyname(other)
        self._other = other
        self._stopping = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        rest = b""
        while not self._stopping:
            if not select.select([self._end], [], [], 0.02)[0]:
                continue
            rest += os.read(self._end, 4096)
            while b"\n" in rest:
                line, _, rest = rest.partition(b"\n")
                self._take(line.decode())

    def _take(self, line: str) -> None:
        self.lines.append(line)
        _, _, identifier, data, _ = line.split(" ")
        reply = self._moteus.take(int(identifier, 16), bytes.fromhex(data))
        came = b"" if reply is None else f"rcv {reply[0]:x} {reply[1].hex()} E B F f3\r\n".encode()
        os.write(self._end, self.first + self.acknowledges + came)

    def close(self) -> None:
        self._stopping = True
        self._thread.join()
        os.close(self._other)
        os.close(self._end)


@pytest.fixture
def adapter(moteus: Moteus) -> Iterator[Adapter]:
    made = Adapter(moteus)
    yield made
    made.close()


@pytest.fixture
def at(clock: Any, adapter: Adapter) -> Iterator[Callable[..., Any]]:
    from drivers.catalogue import Surroundings
    from drivers.mjbots.inverter import MjbotsMoteus
    from drivers.mjbots.options import MoteusOptions

    made: list[Any] = []

    def open_it(**known: Any) -> Any:
        address = f"fdcanusb://{adapter.port}?node=1"
        made.append(
            MjbotsMoteus.open(
                address, MoteusOptions(20.0), Surroundings(clock, can_buses=CanBuses(), **known), "inverter"
            )
        )
        return made[-1]

    yield open_it
    for one in made:
        one.close()


def test_currents_over_lines_of_text(at: Callable[..., Any], adapter: Adapter, moteus: Moteus) -> None:
    inverter = at()
    adapter.lines.clear()
    with inverter.driving_dq_current(-2.0, 1.5):
        assert (moteus.d, moteus.q) == (-2.0, 1.5)
        assert inverter.measure_dq().q_voltage == 3.5
    assert moteus.mode == 0
    stop, command = adapter.lines[0].split(" "), adapter.lines[2].split(" ")
    assert stop[:2] == ["can", "send"]
    assert (stop[2][:1], stop[2][2:], stop[3], stop[4]) == ("9", "01", "0100001100110F50"[:14], "BF")
    assert command[3] == "0100090E1C0000C03F000000C01100110F505050"


def test_what_comes_between_is_kept_and_what_is_for_others_is_not(
    at: Callable[..., Any], adapter: Adapter, moteus: Moteus
) -> None:
    inverter = at()
    adapter.first = b"rcv 2ff 00 F\r\nrcv xyz\r\n\r\n"
    assert inverter.measure_current().value == 0.0


def test_what_goes_over_the_port_is_told(at: Callable[..., Any]) -> None:
    told: list[tuple[str, str, bytes]] = []
    inverter = at(wire=lambda *one: told.append(one))
    told.clear()
    inverter.measure_current()
    assert [(carrier, direction) for carrier, direction, _ in told] == [
        ("serial", ">"),
        ("serial", "<"),
        ("serial", "<"),
    ]
    assert told[0][2].startswith(b"can send 9")
    assert told[1][2] == b"OK\r\n"
    assert told[2][2].startswith(b"rcv 11")


def test_an_adapter_that_refuses_or_does_not_acknowledge(at: Callable[..., Any], adapter: Adapter) -> None:
    inverter = at()
    adapter.acknowledges = b"ERR bus off\r\n"
    with pytest.raises(CommunicationError, match=r"the adapter refuses a frame \(ERR bus off\). Check that the bus is"):
        inverter.measure_current()
    adapter.acknowledges = b""
    with pytest.raises(CommunicationError, match="the adapter does not acknowledge a frame"):
        inverter.measure_current()
    adapter.acknowledges = b"OK\r\n"
    inverter.make_safe()


@pytest.mark.parametrize(
    "address", ["fdcanusb:///dev/x", "fdcanusb:///dev/x?node=0", "fdcanusb:///dev/x?node=128", "fdcanusb://?node=1"]
)
def test_addresses_that_are_none(address: str) -> None:
    with pytest.raises(CommunicationError, match=r"is no address of a node behind an fdcanusb. Write fdcanusb:///dev"):
        FdcanusbNode(address, "inverter")


def test_a_misspelt_key_and_a_port_that_is_not_there(adapter: Adapter) -> None:
    with pytest.raises(CommunicationError, match="unknown key baudrat; is baudrate meant"):
        FdcanusbNode(f"fdcanusb://{adapter.port}?node=1&baudrat=9600", "inverter")
    with pytest.raises(CommunicationError, match=r"cannot be opened at fdcanusb:///dev/absent\?node=1"):
        FdcanusbNode("fdcanusb:///dev/absent?node=1", "inverter")


def test_it_is_a_serial_line_as_others_are() -> None:
    assert canonical_addresses("fdcanusb:///dev/ttyACM0?node=1") == canonical_addresses("/dev/ttyACM0")
    assert is_serial_line("FDCANUSB:///dev/ttyACM0?node=1")
