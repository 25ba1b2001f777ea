"""Six-step drive against a node on a virtual bus: payloads, states, faults, and off at the end."""

from collections.abc import Iterator
from typing import Any

import can
import pytest

from drivers.catalogue import Surroundings
from drivers.cia402.options import Cia402SixStepOptions
from drivers.cia402.power_state import PowerState
from drivers.cia402.six_step import Cia402SixStep
from drivers.interfaces import Accuracy, CommunicationError, IdentityError, MeasurementError, ReportedError
from tests.drivers.can_bus.conftest import SIX_STEP, paired

CHANNEL = "six-step"
ADDRESS = f"can://virtual/{CHANNEL}?node=6"
OPTIONS = Cia402SixStepOptions(**SIX_STEP)


@pytest.fixture
def drive(node: Any, clock: Any) -> Iterator[Cia402SixStep]:
    made = Cia402SixStep.open(ADDRESS, OPTIONS, Surroundings(clock), "drive")
    yield made
    made.close()
    made.close()


def test_identity(drive: Cia402SixStep) -> None:
    assert drive.identity.model == "Bench drive"
    assert drive.identity.serial_number == "815"


def test_payloads_of_a_run(drive: Cia402SixStep, node: Any) -> None:
    with drive.running():
        assert node.state is PowerState.OPERATION_ENABLED
        assert node.values[0x6061, 0] == -1
    assert node.writes == [
        (0x6060, b"\xff"),
        (0x6040, b"\x06\x00"),
        (0x6040, b"\x07\x00"),
        (0x6040, b"\x0f\x00"),
        (0x6040, b"\x00\x00"),
        (0x6040, b"\x00\x00"),
    ]
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_the_frames_of_the_readings(drive: Cia402SixStep, node: Any, clock: Any) -> None:
    node.values |= {(0x6079, 0): 24_018, (0x2010, 0): -1250, (0x606C, 0): -12_345, (0x2011, 0): 0b101}
    clock.time = 3.0
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        readings = [drive.measure_bus_voltage(), drive.measure_bus_current(), drive.measure_frequency()]
        assert drive.hall_state() == (True, False, True)
        frames = paired(bus)
    assert [(reading.value, reading.unit, reading.time) for reading in readings] == [
        (24.018, "V", 3.0),
        (-1.25, "A", 3.0),
        (-123.45, "Hz", 3.0),
    ]
    state = [(0x606, "40 41 60 00 00 00 00 00"), (0x586, "4b 41 60 00 40 02 00 00")]
    assert frames == [
        *state,
        (0x606, "40 79 60 00 00 00 00 00"),
        (0x586, "43 79 60 00 d2 5d 00 00"),
        *state,
        (0x606, "40 10 20 00 00 00 00 00"),
        (0x586, "43 10 20 00 1e fb ff ff"),
        *state,
        (0x606, "40 6c 60 00 00 00 00 00"),
        (0x586, "43 6c 60 00 c7 cf ff ff"),
        (0x606, "40 11 20 00 00 00 00 00"),
        (0x586, "4f 11 20 00 05 00 00 00"),
    ]


@pytest.mark.parametrize("bits", range(8))
def test_hall_states(drive: Cia402SixStep, node: Any, bits: int) -> None:
    node.values[0x2011, 0] = bits
    assert drive.hall_state() == (bool(bits & 1), bool(bits & 2), bool(bits & 4))


def test_accuracies_that_are_assumed_say_so_and_a_calibration_replaces_them(
    drive: Cia402SixStep, node: Any, clock: Any
) -> None:
    assert drive.measure_bus_voltage().accuracy.source.startswith("assumed, 1 % of reading")
    assert drive.measure_bus_current().accuracy.source.startswith("assumed, 2 % of reading + 20 mA")
    assert drive.measure_frequency().accuracy.resolution == 0.01
    drive.close()
    stated = [Accuracy(gain=share, source="certificate") for share in (1e-3, 2e-3, 3e-3)]
    names = ("voltage_accuracy", "current_accuracy", "frequency_accuracy")
    options = Cia402SixStepOptions(**SIX_STEP, **dict(zip(names, stated, strict=True)))
    other = Cia402SixStep.open(ADDRESS, options, Surroundings(clock), "drive")
    readings = (other.measure_bus_voltage(), other.measure_bus_current(), other.measure_frequency())
    assert [reading.accuracy for reading in readings] == stated
    other.close()


class AccidentError(Exception):
    """Anything that may go wrong inside a block."""


@pytest.mark.parametrize("error", [AccidentError, KeyboardInterrupt, SystemExit, MemoryError])
def test_off_after_an_exception(drive: Cia402SixStep, node: Any, error: type[BaseException]) -> None:
    with pytest.raises(error), drive.running():
        raise error
    assert node.state is PowerState.SWITCH_ON_DISABLED
    assert node.writes[-1] == (0x6040, b"\x00\x00")


def test_a_bridge_that_stays_on_is_reported(drive: Cia402SixStep, node: Any) -> None:
    with pytest.raises(ReportedError, match="stays in Operation enabled"), drive.running():
        node.deaf.add(0x00)


def test_a_bridge_that_stays_on_does_not_hide_the_first_error(drive: Cia402SixStep, node: Any) -> None:
    def block() -> None:
        with drive.running():
            node.deaf.add(0x00)
            raise AccidentError

    with pytest.raises(AccidentError) as caught:
        block()
    assert "stays in Operation enabled" in caught.value.__notes__[0]


def test_a_fault_inside_the_block_is_named_and_reset(drive: Cia402SixStep, node: Any) -> None:
    def block() -> None:
        with drive.running():
            node.fail(0x7300)
            drive.measure_bus_current()

    with pytest.raises(ReportedError, match=r"in fault 0x7300 \(sensor\)"):
        block()
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_a_fault_that_nobody_asked_about_is_not_lost(drive: Cia402SixStep, node: Any) -> None:
    with pytest.raises(ReportedError, match=r"0x2310 \(continuous over-current\)"), drive.running():
        node.fail(0x2310)
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_a_fault_before_the_start_prevents_it(drive: Cia402SixStep, node: Any) -> None:
    node.fail(0x3220)
    with pytest.raises(ReportedError, match="0x3220"), drive.running():
        pass
    assert (0x6040, b"\x0f\x00") not in node.writes


def test_operation_that_is_not_reached(drive: Cia402SixStep, node: Any) -> None:
    node.deaf.add(0x07)
    with (
        pytest.raises(
            MeasurementError, match=r"after '0x6040 = 7': does not reach operation: stays in Ready to switch"
        ),
        drive.running(),
    ):
        pass
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_a_mode_that_is_not_shown(drive: Cia402SixStep, node: Any) -> None:
    node.follows_mode = False
    with pytest.raises(MeasurementError, match=r"stays in mode 0 \(0x6061\)"), drive.running():
        pass
    assert (0x6040, b"\x0f\x00") not in node.writes


def test_a_bridge_found_on_is_switched_off_before_the_mode_changes(drive: Cia402SixStep, node: Any) -> None:
    node.values[0x6041, 0] = 0x237
    with drive.running():
        pass
    assert [index for index, _ in node.writes[:3]] == [0x6040, 0x6040, 0x6060]
    assert node.writes[0] == (0x6040, b"\x00\x00")


@pytest.mark.parametrize(
    ("index", "code", "message"),
    [
        (0x6060, 0x06090030, r"write -1 to 0x6060:00'.*Value range of parameter exceeded"),
        (0x6079, 0x08000022, r"read 0x6079:00'.*SDO abort"),
    ],
)
def test_sdo_aborts_are_named(drive: Cia402SixStep, node: Any, index: int, code: int, message: str) -> None:
    node.abort[index] = code
    with pytest.raises(ReportedError, match=message), drive.running():
        drive.measure_bus_voltage()
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_another_unit_is_refused(node: Any, clock: Any) -> None:
    with pytest.raises(IdentityError, match="serial number 815 answers, expected 1"):
        Cia402SixStep.open(ADDRESS, Cia402SixStepOptions(**SIX_STEP, serial_number="1"), Surroundings(clock), "drive")


def test_off_although_a_confirmation_on_the_way_down_is_lost(drive: Cia402SixStep, node: Any, clock: Any) -> None:
    with drive.running():
        node.lost = 1
    assert node.state is PowerState.SWITCH_ON_DISABLED
    assert sum(clock.slept) < 0.3


@pytest.mark.parametrize("found", [0x240, 0x231, 0x233, 0x237])
def test_make_safe_waits_no_longer_than_the_bridge_takes(
    drive: Cia402SixStep, node: Any, clock: Any, found: int
) -> None:
    node.values[0x6041, 0] = found
    node.deaf.add(0x00)

    def turn_off_after_a_while() -> None:
        if clock.now() >= 0.1:
            node.values[0x6041, 0] = 0x240

    clock.on_sleep = turn_off_after_a_while
    drive.make_safe()
    assert node.state is PowerState.SWITCH_ON_DISABLED
    assert sum(clock.slept) < 0.12


def test_off_although_the_bus_went_down(drive: Cia402SixStep, node: Any) -> None:
    with drive.running():
        drive._node._connection._bus.disconnect()
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_a_bus_that_stays_down_is_reported_and_found_again_later(
    drive: Cia402SixStep, node: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    node.values[0x6041, 0] = 0x237
    bus = drive._node._connection._bus
    bus.disconnect()
    with monkeypatch.context() as patch:
        patch.setattr(can, "Bus", lambda **_: (_ for _ in ()).throw(OSError("No such device")))
        for _ in range(2):
            with pytest.raises(CommunicationError, match="cannot be opened at can://virtual/six-step"):
                drive.make_safe()
    drive.make_safe()
    assert node.state is PowerState.SWITCH_ON_DISABLED
