"""The watch of a drive over the process that started it: armed where it has one, fed, and put back."""

from typing import Any

import can
import pytest

from drivers.catalogue import Surroundings
from drivers.cia402.options import Cia402SixStepOptions
from drivers.cia402.six_step import Cia402SixStep
from drivers.interfaces import ReportedError, SetpointError, Watchdog, WhenSilent
from tests.drivers.can_bus.conftest import SIX_STEP

CHANNEL = "six-step"
ADDRESS = f"can://virtual/{CHANNEL}?node=6"
OPTIONS = Cia402SixStepOptions(**SIX_STEP, heartbeat_time=0.0)


WATCHED = Cia402SixStepOptions(**SIX_STEP, heartbeat_time=0.15, heartbeat_node=0x7E)


def heartbeats(bus: can.BusABC, count: int) -> list[bytes]:
    found: list[bytes] = []
    while len(found) < count:
        message = bus.recv(2.0)
        assert message is not None, "no heartbeat"
        if message.arbitration_id == 0x77E:
            found.append(bytes(message.data))
    return found


@pytest.mark.parametrize("with_option", [True, False])
def test_a_consumer_heartbeat_is_armed_fed_and_put_back(clock: Any, make_node: Any, with_option: bool) -> None:
    node = make_node(consumer={1: 0x00100064, 2: 0}, abort_option=1 if with_option else None)
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        drive = Cia402SixStep.open(ADDRESS, WATCHED, Surroundings(clock), "drive")
        assert node.entry(1) == 0x00100064  # another's entry
        assert node.entry(2) == 0x7E << 16 | 150
        assert heartbeats(bus, 3) == [b"\x05"] * 3
        action, setting = (
            (WhenSilent.VOLTAGE_OFF, "0x1016, 0x6007") if with_option else (WhenSilent.AS_SET_UP, "0x1016")
        )
        assert drive.watchdog == Watchdog(0.15, action, setting)
    armed = [(0x6007, b"\x02\x00")] if with_option else []
    assert node.writes == [*armed, (0x1016, bytes.fromhex("96 00 7e 00"))]
    drive.close()
    assert drive.watchdog is None
    assert node.entry(2) == 0
    assert node.values.get((0x6007, 0)) == (1 if with_option else None)


def test_the_entry_of_a_process_that_died_is_taken_over_and_cleared(clock: Any, make_node: Any) -> None:
    node = make_node(consumer={1: 0, 2: 0x7E << 16 | 500})
    drive = Cia402SixStep.open(ADDRESS, WATCHED, Surroundings(clock), "drive")
    assert (node.entry(1), node.entry(2)) == (0, 0x7E << 16 | 150)
    drive.close()
    assert node.entry(2) == 0


def test_a_drive_without_a_watch_stays_as_it_is(node: Any, clock: Any) -> None:
    traffic: list[tuple[str, str]] = []
    drive = Cia402SixStep.open(
        ADDRESS,
        WATCHED,
        Surroundings(clock, traffic=lambda direction, text: traffic.append((direction, text))),
        "drive",
    )
    assert drive.watchdog is None
    drive.close()
    assert node.writes == []
    assert ("read", "no such object") in traffic


def test_nothing_is_asked_where_no_watch_is_wanted(clock: Any, make_node: Any) -> None:
    node = make_node(consumer={1: 0}, abort_option=1)
    drive = Cia402SixStep.open(ADDRESS, OPTIONS, Surroundings(clock), "drive")
    drive.close()
    assert node.writes == []


def test_a_heartbeat_goes_on_over_a_bus_opened_anew_and_ends_with_the_drive(clock: Any, make_node: Any) -> None:
    node = make_node(consumer={1: 0})
    drive = Cia402SixStep.open(ADDRESS, WATCHED, Surroundings(clock), "drive")
    drive._node._connection.reopen()
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        assert heartbeats(bus, 2)
    node.network.disconnect()  # the drive is gone: closing must not depend on it
    drive.close()


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"heartbeat_time": 0.01}, SetpointError, r"heartbeat_time = 0\.01 s is outside 0\.05 … 65\.535 s"),
        ({"heartbeat_time": 1.0, "heartbeat_node": 0}, SetpointError, "heartbeat_node = 0"),
        ({"heartbeat_time": 1.0}, ReportedError, r"all 1 entries .* are taken.*heartbeat_time = 0"),
    ],
)
def test_a_watch_that_cannot_be_armed_is_refused(
    clock: Any, make_node: Any, options: dict[str, Any], error: type[Exception], message: str
) -> None:
    node = make_node(consumer={1: 0x00100064}, abort_option=1)
    with pytest.raises(error, match=message):
        Cia402SixStep.open(ADDRESS, Cia402SixStepOptions(**SIX_STEP, **options), Surroundings(clock), "drive")
    assert node.writes == []


def test_an_abort_other_than_absence_is_not_passed_over(clock: Any, make_node: Any) -> None:
    node = make_node(consumer={1: 0})
    node.abort[0x1016] = 0x08000022
    with pytest.raises(ReportedError, match=r"read 0x1016:00'.*SDO abort"):
        Cia402SixStep.open(ADDRESS, WATCHED, Surroundings(clock), "drive")


@pytest.mark.parametrize(("index", "said"), [(0x1016, "0x1016:01 is 0 after"), (0x6007, "0x6007:00 is 1 after 2 was")])
def test_a_drive_that_does_not_keep_what_is_written_is_refused_and_left_as_it_was(
    clock: Any, make_node: Any, index: int, said: str
) -> None:
    node = make_node(consumer={1: 0}, abort_option=1)
    node.keeps[index] = node.values[index, 1 if index == 0x1016 else 0]
    with pytest.raises(ReportedError, match=said):
        Cia402SixStep.open(ADDRESS, WATCHED, Surroundings(clock), "drive")
    assert (node.entry(1), node.values[0x6007, 0]) == (0, 1)
