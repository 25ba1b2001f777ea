"""CiA 402 inverter against a canopen node on a virtual bus: payloads, states, faults, and off at the end."""

from collections.abc import Iterator
from typing import Any

import can
import pytest
from canopen.objectdictionary import INTEGER16, ODVariable

from drivers.catalogue import Surroundings
from drivers.cia402.inverter import Cia402Inverter
from drivers.cia402.options import Cia402Options
from drivers.cia402.power_state import PowerState
from drivers.interfaces import (
    Accuracy,
    CommunicationError,
    Identity,
    IdentityError,
    MeasurementError,
    ReportedError,
    SetpointError,
)
from tests.drivers.can_bus.conftest import CHANNEL, STATED, Node, paired

NODE = 5


class Drive(Node):
    """The inverter's side: what is commanded is there at once."""

    def __init__(self) -> None:
        self.follows = True
        super().__init__(NODE, channel=CHANNEL)

    def written(self, *, index: int, subindex: int, od: Any, data: bytes) -> None:
        super().written(index=index, subindex=subindex, od=od, data=data)
        if self.follows:
            enabled = self.state is PowerState.OPERATION_ENABLED
            for actual, target in ((0x606C, 0x60FF), (0x6077, 0x6071)):
                self.values[actual, 0] = self.values[target, 0] if enabled else 0


@pytest.fixture
def drive() -> Iterator[Drive]:
    made = Drive()
    yield made
    made.network.disconnect()


OPTIONS = Cia402Options(**STATED)
ADDRESS = f"can://virtual/{CHANNEL}?node={NODE}"


@pytest.fixture
def inverter(drive: Drive, clock: Any) -> Iterator[Cia402Inverter]:
    made = Cia402Inverter.open(ADDRESS, OPTIONS, Surroundings(clock), "inverter")
    yield made
    made.close()
    made.close()


def test_a_drive_that_tells_no_more_of_itself_than_it_must(drive: Drive, clock: Any) -> None:
    drive.abort[0x1008] = 0x06020000
    drive.missing = {(0x1018, 3), (0x1018, 4)}
    inverter = Cia402Inverter.open(ADDRESS, OPTIONS, Surroundings(clock), "inverter")
    assert inverter.identity == Identity("vendor 0x0000002A", "product 0x00000006")
    inverter.close()


def test_identity_and_limits(inverter: Cia402Inverter) -> None:
    assert inverter.identity.model == "Bench drive"
    assert inverter.identity.serial_number == "815"
    assert (inverter.maximum_current, inverter.maximum_frequency) == (15.0, 400.0)


def test_payloads_of_the_frequency_mode(inverter: Cia402Inverter, drive: Drive) -> None:
    with inverter.driving_frequency(-53.76, 2.5):
        assert drive.state is PowerState.OPERATION_ENABLED
        reading = inverter.measure_frequency()
        assert (reading.value, reading.unit) == (-53.76, "Hz")
        assert reading.accuracy.resolution == 0.01
    assert drive.writes == [
        (0x6060, b"\x03"),
        (0x60FF, b"\x00\x00\x00\x00"),
        (0x2000, b"\xc4\x09\x00\x00"),  # 2500 mA
        (0x6040, b"\x06\x00"),
        (0x6040, b"\x07\x00"),
        (0x6040, b"\x0f\x00"),
        (0x60FF, b"\x00\xeb\xff\xff"),  # −5376 × 0.01 Hz
        (0x6040, b"\x00\x00"),
        (0x6040, b"\x00\x00"),
    ]
    assert drive.state is PowerState.SWITCH_ON_DISABLED


def test_payloads_of_the_current_mode(inverter: Cia402Inverter, drive: Drive) -> None:
    with inverter.driving_current(-5.0):
        assert (0x6060, b"\x04") in drive.writes
        assert drive.writes[-1] == (0x6071, b"\x06\xff")  # −250 per mille of 20 A
        inverter.set_current(4.0)
        reading = inverter.measure_current()
        assert (reading.value, reading.unit) == (pytest.approx(4.0), "A")
        assert "assumed" in reading.accuracy.source
    assert drive.state is PowerState.SWITCH_ON_DISABLED


def test_the_frames_on_the_bus(inverter: Cia402Inverter) -> None:
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        inverter.measure_frequency()
        frames = paired(bus)
    assert frames == [
        (0x605, "40 41 60 00 00 00 00 00"),
        (0x585, "4b 41 60 00 40 02 00 00"),
        (0x605, "40 6c 60 00 00 00 00 00"),
        (0x585, "43 6c 60 00 00 00 00 00"),
    ]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_off_after_an_exception(inverter: Cia402Inverter, drive: Drive, error: type[BaseException]) -> None:
    with pytest.raises(error), inverter.driving_frequency(10.0, 1.0):
        raise error
    with pytest.raises(error), inverter.driving_current(1.0):
        raise error
    assert drive.state is PowerState.SWITCH_ON_DISABLED
    assert drive.words[-1] == 0


def test_a_fault_inside_the_block_is_named_and_reset(inverter: Cia402Inverter, drive: Drive) -> None:
    def block() -> None:
        with inverter.driving_current(1.0):
            drive.fail(0x2310)
            inverter.measure_current()

    with pytest.raises(ReportedError, match=r"in fault 0x2310 \(continuous over-current\)"):
        block()
    assert drive.state is PowerState.SWITCH_ON_DISABLED
    assert 0x80 in drive.words


def test_a_fault_that_nobody_asked_about_is_not_lost(inverter: Cia402Inverter, drive: Drive) -> None:
    with pytest.raises(ReportedError, match="0x3220"), inverter.driving_current(1.0):
        drive.fail(0x3220)
    assert drive.state is PowerState.SWITCH_ON_DISABLED


def test_a_fault_before_the_start_prevents_it(inverter: Cia402Inverter, drive: Drive) -> None:
    drive.fail(0x7121)
    with pytest.raises(ReportedError, match=r"0x7121 \(motor blocked\)"), inverter.driving_current(1.0):
        pass
    assert 0x0F not in drive.words


def test_a_fault_while_switching_on(inverter: Cia402Inverter, drive: Drive) -> None:
    command = drive.command
    drive.command = lambda word: drive.fail(0x3210) if word == 0x07 else command(word)
    with pytest.raises(ReportedError, match="after '0x6040 = 7': the drive is in fault 0x3210"):
        inverter.driving_current(1.0).__enter__()
    assert drive.state is PowerState.SWITCH_ON_DISABLED


def test_a_state_that_is_not_reached(inverter: Cia402Inverter, drive: Drive, clock: Any) -> None:
    drive.deaf.add(0x07)
    with (
        pytest.raises(ReportedError, match="stays in Ready to switch on, Switched on was commanded"),
        inverter.driving_current(1.0),
    ):
        pass
    assert clock.now() == pytest.approx(1.0, abs=0.05)
    assert drive.state is PowerState.SWITCH_ON_DISABLED


def test_a_drive_that_stays_on_is_reported(inverter: Cia402Inverter, drive: Drive) -> None:
    with pytest.raises(ReportedError, match="stays in Operation enabled"), inverter.driving_current(1.0):
        drive.deaf.add(0x00)


def test_a_ramp_that_does_not_end(inverter: Cia402Inverter, drive: Drive) -> None:
    drive.follows = False
    with (
        pytest.raises(MeasurementError, match="the frequency is 0 Hz 30 s after 50 Hz was commanded"),
        inverter.driving_frequency(50.0, 1.0),
    ):
        pass
    assert drive.state is PowerState.SWITCH_ON_DISABLED


def test_a_mode_that_is_not_taken(inverter: Cia402Inverter, drive: Drive) -> None:
    drive.abort[0x6060] = 0x06090030
    with (
        pytest.raises(ReportedError, match=r"write 3 to 0x6060:00'.*SDO abort: .*Value range of parameter exceeded"),
        inverter.driving_frequency(50.0, 1.0),
    ):
        pass


@pytest.mark.parametrize(
    ("way", "values", "message"),
    [
        ("driving_frequency", (401.0, 1.0), "frequency = 401 Hz is outside -400 … 400 Hz"),
        ("driving_frequency", (10.0, -1.0), "current = -1 A is outside 0 … 15 A"),
        ("driving_current", (15.1,), "current = 15.1 A is outside -15 … 15 A"),
        ("driving_current", (float("inf"),), "current = inf A"),
    ],
)
def test_limits(inverter: Cia402Inverter, drive: Drive, way: str, values: Any, message: str) -> None:
    with pytest.raises(SetpointError, match=message), getattr(inverter, way)(*values):
        pass
    assert drive.writes == []


def test_make_safe(inverter: Cia402Inverter, drive: Drive) -> None:
    drive.values[0x6041, 0] = 0x237
    inverter.make_safe()
    assert drive.state is PowerState.SWITCH_ON_DISABLED


def test_command_zero_leaves_no_target(inverter: Cia402Inverter, drive: Drive) -> None:
    with inverter.driving_current(2.0):
        inverter.command_zero()
        assert (drive.values[0x6071, 0], drive.values[0x60FF, 0]) == (0, 0)
        assert drive.state is PowerState.OPERATION_ENABLED


def test_another_node_is_refused(drive: Drive, clock: Any) -> None:
    drive.values[0x1000, 0] = 0x00020191
    with pytest.raises(IdentityError, match="device type is 0x00020191, expected profile 402"):
        Cia402Inverter.open(ADDRESS, OPTIONS, Surroundings(clock), "inverter")


def test_another_serial_number_is_refused(drive: Drive, clock: Any) -> None:
    options = Cia402Options(**STATED, serial_number="1")
    with pytest.raises(IdentityError, match="serial number 815 answers, expected 1"):
        Cia402Inverter.open(ADDRESS, options, Surroundings(clock), "inverter")


def test_a_drive_without_a_rating_is_refused(drive: Drive, clock: Any) -> None:
    drive.values[0x6075, 0] = 0
    with pytest.raises(ReportedError, match="rated current"):
        Cia402Inverter.open(ADDRESS, OPTIONS, Surroundings(clock), "inverter")


def test_a_node_that_is_silent(drive: Drive, clock: Any) -> None:
    with pytest.raises(CommunicationError, match=r"read 0x1000:00': no usable reply .*Check node id"):
        Cia402Inverter.open(f"can://virtual/{CHANNEL}?node=9", OPTIONS, Surroundings(clock), "inverter")


def test_rms_drives_are_scaled_and_calibrations_used(drive: Drive, clock: Any) -> None:
    accuracy = Accuracy(gain=1e-2, source="certificate")
    options = Cia402Options(
        **{**STATED, "maximum_current": 30.0, "current_scale": 2**0.5, "current_accuracy": accuracy}
    )
    inverter = Cia402Inverter.open(ADDRESS, options, Surroundings(clock), "inverter")
    with inverter.driving_current(20.0):
        assert drive.values[0x6071, 0] == 707
        assert inverter.measure_current().value == pytest.approx(20.0, abs=0.03)
        assert inverter.measure_current().accuracy is accuracy
    with inverter.driving_frequency(1.0, 10.0):
        assert drive.values[0x2000, 0] == 7071
    inverter.close()


def test_a_bus_that_cannot_be_opened(clock: Any) -> None:
    with pytest.raises(CommunicationError, match="cannot be opened at can://nothing/x"):
        Cia402Inverter.open("can://nothing/x?node=1", OPTIONS, Surroundings(clock), "inverter")


def test_a_guardian_commands_zero_to_a_drive_that_has_the_velocity_mode_only(drive: Drive, clock: Any) -> None:
    drive.abort |= {0x6071: 0x06020000, 0x60FF: 0x06020000}
    drive.values |= {(0x6041, 0): 0x237, (0x6042, 0): 1500}
    vl_target_velocity = ODVariable("vl target velocity", 0x6042)
    vl_target_velocity.data_type = INTEGER16
    drive.node.object_dictionary.add_object(vl_target_velocity)
    options = Cia402Options(maximum_current=15.0, maximum_frequency=400.0)
    guarding = Cia402Inverter.open(ADDRESS, options, Surroundings(clock, guarding=True), "inverter")
    guarding.command_zero()
    assert drive.values[0x6042, 0] == 0
    guarding.close()


@pytest.mark.parametrize("index", [0x6071, 0x60FF])
def test_a_guardian_tells_a_target_that_the_drive_does_not_take(drive: Drive, clock: Any, index: int) -> None:
    drive.abort[index] = 0x08000022
    options = Cia402Options(maximum_current=15.0, maximum_frequency=400.0)
    guarding = Cia402Inverter.open(ADDRESS, options, Surroundings(clock, guarding=True), "inverter")
    with pytest.raises(ReportedError, match=f"0x{index:04X}"):
        guarding.command_zero()
    assert [written for written, _ in drive.writes if written != index] == [0x60FF if index == 0x6071 else 0x6071]
    guarding.close()


def test_a_guardian_commands_zero_and_switches_off_without_asking_anything_first(drive: Drive, clock: Any) -> None:
    drive.values |= {(0x6041, 0): 0x237, (0x60FF, 0): 100, (0x6071, 0): 50}
    options = Cia402Options(maximum_current=15.0, maximum_frequency=400.0)
    guarding = Cia402Inverter.open(ADDRESS, options, Surroundings(clock, guarding=True), "inverter")
    assert drive.writes == []
    guarding.command_zero()
    assert (drive.values[0x60FF, 0], drive.values[0x6071, 0]) == (0, 0)
    guarding.make_safe()
    assert drive.state is PowerState.SWITCH_ON_DISABLED
    written = len(drive.writes)
    guarding.close()
    assert len(drive.writes) == written
