"""Inverter and six-step drive as two nodes of one bus."""

from typing import Any

import pytest
from can.interfaces import virtual

from drivers.catalogue import Surroundings
from drivers.cia402.inverter import Cia402Inverter
from drivers.cia402.options import Cia402Options, Cia402SixStepOptions
from drivers.cia402.power_state import PowerState
from drivers.cia402.six_step import Cia402SixStep
from drivers.interfaces import CommunicationError
from drivers.transport.can.buses import CanBuses
from tests.drivers.can_bus.conftest import SIX_STEP, STATED

CHANNEL = "six-step"
ADDRESS = f"can://virtual/{CHANNEL}?node=6"
INVERTER = f"can://virtual/{CHANNEL}?node=5"
OPTIONS = Cia402SixStepOptions(**SIX_STEP)


@pytest.fixture
def other(make_node: Any) -> Any:
    return make_node(5)


LIMITS = Cia402Options(**STATED)


@pytest.mark.parametrize("shared", [True, False])
@pytest.mark.parametrize("first", ["drive", "inverter"])
def test_inverter_and_drive_on_one_bus_close_in_any_order(
    node: Any, other: Any, clock: Any, shared: bool, first: str
) -> None:
    buses = CanBuses()
    drive = Cia402SixStep.open(ADDRESS, OPTIONS, Surroundings(clock, can_buses=buses), "drive")
    inverter = Cia402Inverter.open(
        INVERTER, LIMITS, Surroundings(clock, can_buses=buses if shared else CanBuses()), "inverter"
    )
    with drive.running():
        assert (node.state, other.state) == (PowerState.OPERATION_ENABLED, PowerState.SWITCH_ON_DISABLED)
        assert inverter.measure_frequency().value == 0.0
    assert len(virtual.channels[CHANNEL]) == 2 + (1 if shared else 2)  # the two nodes' own, and ours
    for instrument in (drive, inverter) if first == "drive" else (inverter, drive):
        instrument.make_safe()
        instrument.close()
    again = Cia402SixStep.open(ADDRESS, OPTIONS, Surroundings(clock, can_buses=buses), "drive")
    assert again.hall_state() == (False, False, False)
    again.close()


def test_what_fails_to_open_leaves_the_bus_to_the_other(node: Any, clock: Any) -> None:
    buses = CanBuses()
    drive = Cia402SixStep.open(ADDRESS, OPTIONS, Surroundings(clock, can_buses=buses), "drive")
    with pytest.raises(CommunicationError, match="no usable reply"):
        Cia402Inverter.open(INVERTER, LIMITS, Surroundings(clock, can_buses=buses), "inverter")
    with pytest.raises(CommunicationError, match=r"node 6 .* is in use"):
        Cia402SixStep.open(ADDRESS, OPTIONS, Surroundings(clock, can_buses=buses), "drive")
    with pytest.raises(CommunicationError, match="open with 500000 bit/s already"):
        Cia402Inverter.open(f"{INVERTER}&bitrate=250000", LIMITS, Surroundings(clock, can_buses=buses), "inverter")
    assert drive.hall_state() == (False, False, False)
    drive.close()


def test_a_bus_opened_anew_serves_both_nodes(node: Any, other: Any, clock: Any) -> None:
    buses = CanBuses()
    drive = Cia402SixStep.open(ADDRESS, OPTIONS, Surroundings(clock, can_buses=buses), "drive")
    inverter = Cia402Inverter.open(INVERTER, LIMITS, Surroundings(clock, can_buses=buses), "inverter")
    drive._node._connection._bus.disconnect()
    inverter.make_safe()
    drive.make_safe()
    assert (node.writes[-1], other.writes[-1]) == ((0x6040, b"\x00\x00"),) * 2
    inverter.close()
    drive.close()
