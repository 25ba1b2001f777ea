"""A relay on a Beckhoff coupler: what is sent to the byte, and what becomes of a coupler that does otherwise."""

from collections.abc import Iterator

import pytest

from drivers.beckhoff.bk9000 import BeckhoffRelay, open_beckhoff_relay
from drivers.delta.options import BeckhoffRelayOptions
from drivers.interfaces import CommunicationError, ReportedError, SetpointError, Watchdog, WhenSilent
from tests.drivers.modbus.units import TcpServer

STATUS, TIME, RESET, TYPE = 0x100C, 0x1120, 0x1121, 0x1122


class Coupler:
    """Registers and coils that keep what is written; what must not be is refused by an exception."""

    def __init__(self) -> None:
        self.registers = {STATUS: 0, TIME: 1000, RESET: 0, TYPE: 1}
        self.coils = {0: False, 3: False}
        self.keeps: set[int] = set()
        self.deaf = False  # whether coils acknowledge a write and stay what they are
        self.refuse: dict[int, int] = {}  # function → exception

    def answer(self, unit: int, pdu: bytes) -> bytes | None:
        function, address, third = pdu[0], int.from_bytes(pdu[1:3], "big"), int.from_bytes(pdu[3:5], "big")
        if code := self.refuse.get(function):
            return bytes([function | 0x80, code])
        if function == 3:
            return bytes([3, 2]) + self.registers[address].to_bytes(2, "big")
        if function == 1:
            return bytes([1, 1, self.coils[address]])
        if function == 5:
            self.coils[address] = self.coils[address] if self.deaf else third == 0xFF00
        elif address not in self.keeps:
            self.registers[address] = third
            if address == RESET and third == 0xAFFE:
                self.registers[STATUS] = 0
        return pdu


@pytest.fixture
def coupler() -> Coupler:
    return Coupler()


@pytest.fixture
def server(coupler: Coupler) -> Iterator[TcpServer]:
    made = TcpServer(coupler)  # type: ignore[arg-type]  it answers as units do
    yield made
    made.close()


def opened(server: TcpServer, **options: float) -> BeckhoffRelay:
    return open_beckhoff_relay(server.address, BeckhoffRelayOptions(**options), name="relay")  # type: ignore[arg-type]


def said(server: TcpServer) -> list[str]:
    """Return unit, function and data of every request so far, and forget them."""
    requests, server.requests[:] = [request[18:] for request in server.requests], []
    return requests


def test_the_bytes_of_a_relay_that_picks_up_is_fed_and_drops_out(server: TcpServer, coupler: Coupler) -> None:
    relay = opened(server, output=3, watchdog_time=0.5)
    assert said(server) == ["01 03 10 0c 00 01"]
    assert relay.watchdog == Watchdog(0.5, WhenSilent.CONTACT_OPENS, "0x1120, 0x1122")
    assert relay.picked_up() is False
    said(server)
    relay.pick_up()
    assert said(server) == [
        "01 03 11 22 00 01",
        "01 03 11 20 00 01",
        "01 06 11 21 be cf",
        "01 06 11 21 af fe",
        "01 06 11 22 00 00",
        "01 03 11 22 00 01",
        "01 06 11 20 01 f4",
        "01 03 11 20 00 01",
        "01 05 00 03 ff 00",
        "01 01 00 03 00 01",
    ]
    relay.feed()
    assert said(server) == ["01 03 10 0c 00 01", "01 05 00 03 ff 00", "01 01 00 03 00 01"]
    assert coupler.coils[3]
    relay.drop_out()
    assert said(server) == ["01 05 00 03 00 00", "01 03 10 0c 00 01", "01 01 00 03 00 01"]
    assert not coupler.coils[3]
    relay.close()
    assert (coupler.registers[TYPE], coupler.registers[TIME]) == (1, 1000)
    assert said(server) == ["01 06 11 21 be cf", "01 06 11 21 af fe", "01 06 11 22 00 01", "01 06 11 20 03 e8"]
    relay.close()
    assert said(server) == []


def test_what_is_set_already_is_not_written(server: TcpServer, coupler: Coupler) -> None:
    coupler.registers[TYPE] = 0
    relay = opened(server)
    relay.pick_up()
    relay.close()
    assert not [request for request in said(server) if request.startswith("01 06")]


def test_a_coupler_whose_watchdog_has_run_out_is_reset_before_it_picks_up(server: TcpServer, coupler: Coupler) -> None:
    coupler.registers |= {TYPE: 0, STATUS: 0x8001}
    relay = opened(server)
    assert relay.picked_up() is False
    relay.pick_up()
    assert coupler.registers[STATUS] == 0
    assert relay.picked_up() is True
    relay.close()


def test_a_relay_that_has_dropped_out_is_told_of_and_never_switched_on_again(
    server: TcpServer, coupler: Coupler
) -> None:
    relay = opened(server)
    relay.pick_up()
    coupler.registers[STATUS] = 0x8000
    coupler.coils[0] = False
    with pytest.raises(ReportedError, match="has dropped out: it was not fed for 1 s"):
        relay.feed()
    assert not coupler.coils[0]
    coupler.registers[STATUS], coupler.deaf = 0, True
    with pytest.raises(ReportedError, match="has dropped out: its output is off"):
        relay.feed()
    relay.close()


def test_an_output_that_does_not_follow(server: TcpServer, coupler: Coupler) -> None:
    relay = opened(server)
    coupler.deaf = True
    with pytest.raises(ReportedError, match="output 0 stays off"):
        relay.pick_up()
    coupler.coils[0] = True
    with pytest.raises(ReportedError, match=r"output 0 stays on.*Press the emergency stop"):
        relay.drop_out()
    relay.close()


def test_a_coupler_that_refuses_process_data_because_its_watchdog_has_run_out_is_off(
    server: TcpServer, coupler: Coupler
) -> None:
    relay = opened(server)
    relay.pick_up()
    coupler.registers[STATUS] = 0x8000
    coupler.refuse |= {1: 4, 5: 4}
    relay.drop_out()
    relay.close()


def test_a_setting_that_the_coupler_does_not_keep(server: TcpServer, coupler: Coupler) -> None:
    coupler.keeps.add(TIME)
    relay = opened(server, watchdog_time=2.0)
    with pytest.raises(ReportedError, match="register 1120H is 1000 after 2000 was written"):
        relay.pick_up()
    assert not coupler.coils[0]
    relay.close()
    assert coupler.registers[TYPE] == 1


def test_it_drops_out_over_a_connection_that_was_lost(server: TcpServer, coupler: Coupler) -> None:
    relay = opened(server)
    relay.pick_up()
    server.hang_up_on = 1
    relay.drop_out()
    assert not coupler.coils[0]
    relay.close()


def test_the_settings_are_put_back_over_a_connection_that_was_lost(server: TcpServer, coupler: Coupler) -> None:
    relay = opened(server)
    relay.pick_up()
    relay.drop_out()
    assert coupler.registers[TYPE] == 0
    server.hang_up_on = 1
    relay.close()
    assert (coupler.registers[TYPE], coupler.registers[TIME]) == (1, 1000)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"watchdog_time": 0.1}, r"watchdog_time = 0.1 s is outside 0.2 … 65 s"),
        ({"watchdog_time": float("nan")}, "watchdog_time = nan"),
        ({"output": -1}, "output = -1"),
        ({"unit": 256}, "unit = 256"),
    ],
)
def test_options_that_cannot_be(server: TcpServer, options: dict[str, float], message: str) -> None:
    with pytest.raises(SetpointError, match=message):
        opened(server, **options)
    assert said(server) == []


def test_nobody_there(server: TcpServer) -> None:
    server.hang_up_on = 2
    with pytest.raises(CommunicationError, match="no usable reply"):
        opened(server)
    with pytest.raises(CommunicationError, match="cannot be opened"):
        open_beckhoff_relay("tcp://127.0.0.1:9", BeckhoffRelayOptions(), name="relay")
