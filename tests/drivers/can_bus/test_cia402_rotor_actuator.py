"""Rotor actuator against a node on a virtual bus: frames, mechanism, refusals, and let go of whatever happens."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import can
import canopen
import pytest
from canopen.objectdictionary import INTEGER32, UNSIGNED32, ODArray, ODVariable
from canopen.sdo.exceptions import SdoAbortedError

from drivers.catalogue import Surroundings
from drivers.cia402.options import Cia402RotorActuatorOptions
from drivers.cia402.power_state import PowerState
from drivers.cia402.rotor_actuator import BRAKE, CLUTCH, COUPLING, Cia402RotorActuator
from drivers.interfaces import (
    CommunicationError,
    IdentityError,
    InstrumentError,
    MeasurementError,
    ReportedError,
    SetpointError,
)
from tests.drivers.can_bus import conftest

NUMBER = 7
ADDRESS = f"can://virtual/{conftest.CHANNEL}?node={NUMBER}"
TURN = 65_536
OPTIONS = Cia402RotorActuatorOptions(
    maximum_speed=2.0 * math.pi, timeout=1.0, heartbeat_time=0.0, velocity_unit="counts/s"
)


class Actuator(conftest.Node):
    """The actuator's side: outputs that the inputs follow, movements that end at once."""

    def __init__(self) -> None:
        self.resolution = [2, TURN, 1]
        self.stuck = 0  # bits of the mechanism that do not move
        self.moves = True
        self.taken = False
        super().__init__(NUMBER)
        self.values |= {(0x60FE, 1): 0, (0x60FE, 2): 0, (0x60FD, 0): 0, (0x6064, 0): 1000}

    def dictionary(self) -> canopen.ObjectDictionary:
        for index in (0x6064, 0x607A):
            self.types[index] = INTEGER32
        for index in (0x6081, 0x60FD):
            self.types[index] = UNSIGNED32
        for index in (0x6064, 0x607A, 0x6081, 0x60FD):
            self.values[index, 0] = 0
        dictionary = super().dictionary()
        if self.resolution:
            self.add_array(dictionary, 0x608F, self.resolution)
        outputs = ODArray("outputs", 0x60FE)
        for subindex in (0, 1, 2):
            member = ODVariable(f"member {subindex}", 0x60FE, subindex)
            member.data_type = UNSIGNED32
            outputs.add_member(member)
        dictionary.add_object(outputs)
        return dictionary

    def written(self, *, index: int, subindex: int, od: Any, data: bytes) -> None:
        super().written(index=index, subindex=subindex, od=od, data=data)
        value = int.from_bytes(data, "little")
        if (index, subindex) == (0x60FE, 1):
            self.values[0x60FD, 0] = value & ~self.stuck | self.values[0x60FD, 0] & self.stuck
        if index == 0x60FF and self.moves:
            self.values[0x606C, 0] = self.values[0x60FF, 0]
        if index == 0x6040 and value & 0x1F == 0x1F:
            self.values[0x6041, 0], self.taken = 0x237 | 1 << 12, True
            if self.moves:
                self.values[0x6064, 0] = self.values[0x607A, 0]
        if index == 0x6040 and value == 0x0F and self.taken and self.moves:
            self.values[0x6041, 0] = 0x237 | 1 << 10

    @property
    def mechanism(self) -> int:
        return self.values[0x60FD, 0]


@pytest.fixture
def node() -> Iterator[Actuator]:
    made = Actuator()
    yield made
    made.network.disconnect()


@pytest.fixture
def actuator(node: Actuator, clock: Any) -> Iterator[Cia402RotorActuator]:
    made = Cia402RotorActuator.open(ADDRESS, OPTIONS, Surroundings(clock), "rotor_actuator")
    node.writes.clear()
    yield made
    made.close()
    made.close()


def word(value: int) -> tuple[int, bytes]:
    return 0x6040, value.to_bytes(2, "little")


def outputs(value: int) -> tuple[int, bytes]:
    return 0x60FE, value.to_bytes(4, "little")


def counts(index: int, value: int) -> tuple[int, bytes]:
    return index, value.to_bytes(4, "little", signed=True)


ENABLED = [word(0x06), word(0x07), word(0x0F)]
LET_GO = [outputs(0), word(0x00), word(0x00)]
NO_TORQUE_FIRST = [word(0x00), word(0x00), outputs(0)]


def test_opening_switches_nothing(node: Actuator, clock: Any) -> None:
    made = Cia402RotorActuator.open(ADDRESS, OPTIONS, Surroundings(clock), "rotor_actuator")
    assert made.identity.serial_number == "815"
    assert node.writes == [outputs(BRAKE | CLUTCH | COUPLING)]
    assert node.values[0x60FE, 2] == BRAKE | CLUTCH | COUPLING
    assert node.mechanism == 0
    made.close()


def test_a_drive_without_a_mask_switches_every_output(node: Actuator, clock: Any) -> None:
    real = node.read

    def read(*, index: int, subindex: int, od: Any) -> Any:
        if (index, subindex) == (0x60FE, 2):
            raise SdoAbortedError(0x06090011)
        return real(index=index, subindex=subindex, od=od)

    node.node._read_callbacks[:] = [read]
    made = Cia402RotorActuator.open(ADDRESS, OPTIONS, Surroundings(clock), "rotor_actuator")
    made.lock()
    assert node.writes == [outputs(BRAKE)]
    made.close()


def test_brake(actuator: Cia402RotorActuator, node: Actuator) -> None:
    actuator.lock()
    assert node.mechanism == BRAKE
    actuator.lock()
    actuator.release()
    assert node.mechanism == 0
    assert node.writes == [outputs(BRAKE), outputs(0)]


def test_an_even_turn(actuator: Cia402RotorActuator, node: Actuator) -> None:
    actuator.turn(-math.pi)
    assert node.mechanism == CLUTCH
    assert node.state is PowerState.OPERATION_ENABLED
    actuator.stop()
    assert node.mechanism == 0
    assert node.state is PowerState.SWITCH_ON_DISABLED
    assert node.writes == [
        (0x6060, b"\x03"),
        counts(0x60FF, 0),
        *ENABLED,
        outputs(CLUTCH),
        counts(0x60FF, -TURN // 2),
        counts(0x60FF, 0),
        *LET_GO,
    ]


def test_a_movement(actuator: Cia402RotorActuator, node: Actuator) -> None:
    actuator.move_by(math.pi / 2.0)
    assert node.writes == [
        (0x6060, b"\x01"),
        *ENABLED,
        outputs(CLUTCH),
        counts(0x6081, TURN),
        counts(0x607A, 1000 + TURN // 4),
        word(0x1F),
        word(0x0F),
        *LET_GO,
    ]
    assert actuator.angle().value == pytest.approx((1000 + TURN // 4) / TURN * 2.0 * math.pi)


def test_the_frames_of_a_coupling(actuator: Cia402RotorActuator, node: Actuator) -> None:
    with can.Bus(interface="virtual", channel=conftest.CHANNEL) as bus:
        actuator.couple_dynamometer()
        frames = conftest.paired(bus)
    assert frames == [
        (0x607, "40 6c 60 00 00 00 00 00"),
        (0x587, "43 6c 60 00 00 00 00 00"),
        (0x607, "40 fe 60 01 00 00 00 00"),
        (0x587, "43 fe 60 01 00 00 00 00"),
        (0x607, "23 fe 60 01 00 00 04 00"),
        (0x587, "60 fe 60 01 00 00 00 00"),
        (0x607, "40 fd 60 00 00 00 00 00"),
        (0x587, "43 fd 60 00 00 00 04 00"),
    ]
    actuator.lock()
    actuator.uncouple_dynamometer()
    assert node.mechanism == BRAKE


def test_the_angle_does_not_wrap(actuator: Cia402RotorActuator, node: Actuator, clock: Any) -> None:
    clock.time = 3.0
    node.values[0x6064, 0] = (1 << 31) - 100
    before = actuator.angle()
    node.values[0x6064, 0] = -(1 << 31) + 100
    after = actuator.angle()
    assert after.value - before.value == pytest.approx(200 / TURN * 2.0 * math.pi, abs=1e-9)
    assert (after.unit, after.time) == ("rad", 3.0)
    assert after.accuracy.resolution == pytest.approx(2.0 * math.pi / TURN)


TURNING = TURN  # a turn a second


@pytest.mark.parametrize("name", ["lock", "couple_dynamometer", "uncouple_dynamometer"])
def test_nothing_closes_on_a_turning_shaft(actuator: Cia402RotorActuator, node: Actuator, name: str) -> None:
    node.values[0x606C, 0] = TURNING
    with pytest.raises(InstrumentError, match=r"the shaft turns at 6.28 rad/s"):
        getattr(actuator, name)()
    assert node.writes == []


@pytest.mark.parametrize("move", [lambda it: it.turn(1.0), lambda it: it.move_by(1.0)])
def test_a_braked_shaft_is_not_turned(
    actuator: Cia402RotorActuator, node: Actuator, move: Callable[[Cia402RotorActuator], None]
) -> None:
    actuator.lock()
    with pytest.raises(InstrumentError, match=r"the brake is closed. Release the shaft first"):
        move(actuator)
    assert node.mechanism == BRAKE
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_set_points_are_refused_before_anything_is_sent(actuator: Cia402RotorActuator, node: Actuator) -> None:
    for speed in (7.0, -7.0, math.nan):
        with pytest.raises(SetpointError, match="the limit of the station"):
            actuator.turn(speed)
    with pytest.raises(SetpointError, match="0x607A"):
        actuator.move_by(3e5)
    assert node.writes == []


def test_a_shaft_that_sticks_is_let_go(actuator: Cia402RotorActuator, node: Actuator, clock: Any) -> None:
    node.moves = False
    with pytest.raises(MeasurementError, match=r"the speed is 0 rad/s, 1 rad/s was commanded"):
        actuator.turn(1.0)
    assert node.writes[-3:] == NO_TORQUE_FIRST
    with pytest.raises(MeasurementError, match=r"the shaft is -57.3° from its target"):
        actuator.move_by(1.0)
    assert node.writes[-3:] == LET_GO
    assert node.state is PowerState.SWITCH_ON_DISABLED
    assert clock.time == pytest.approx(1.0 + 1.0 + 1.0 / (2.0 * math.pi), abs=0.1)


@pytest.mark.parametrize(
    ("bit", "action", "message"),
    [
        (BRAKE, lambda it: it.lock(), "the brake stays open 1 s after the command"),
        (CLUTCH, lambda it: it.turn(1.0), "the clutch stays open"),
        (COUPLING, lambda it: it.couple_dynamometer(), "the coupling to the dynamometer stays open"),
    ],
)
def test_a_mechanism_that_does_not_move_is_named(
    actuator: Cia402RotorActuator,
    node: Actuator,
    bit: int,
    action: Callable[[Cia402RotorActuator], None],
    message: str,
) -> None:
    node.stuck = bit
    with pytest.raises(ReportedError, match=message):
        action(actuator)
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_make_safe_leaves_the_brake(actuator: Cia402RotorActuator, node: Actuator) -> None:
    actuator.turn(1.0)
    node.values[0x60FE, 1] |= BRAKE
    node.values[0x60FD, 0] |= BRAKE
    actuator.make_safe()
    assert node.mechanism == BRAKE
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_after_a_fault_the_clutch_opens_all_the_same(actuator: Cia402RotorActuator, node: Actuator) -> None:
    actuator.turn(1.0)
    node.fail(0x8611)
    with pytest.raises(ReportedError, match=r"0x8611 \(following error\)"):
        actuator.make_safe()
    assert node.mechanism == 0
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_a_guardian_moves_nothing_and_lets_go(node: Actuator, clock: Any) -> None:
    node.values[0x60FE, 1] = node.values[0x60FD, 0] = CLUTCH | BRAKE
    made = Cia402RotorActuator.open(ADDRESS, OPTIONS, Surroundings(clock, guarding=True), "rotor_actuator")
    assert node.writes == []
    made.make_safe()
    assert node.mechanism == BRAKE
    made.close()


def test_lost_frames(actuator: Cia402RotorActuator, node: Actuator) -> None:
    actuator._node.objects._client.RESPONSE_TIMEOUT = 0.05  # type: ignore[attr-defined]
    actuator.turn(1.0)
    node.lost = 2
    with pytest.raises(CommunicationError, match="rotor_actuator"):
        actuator.angle()
    actuator.make_safe()
    assert node.mechanism == 0


def test_increments_by_the_station(node: Actuator, clock: Any) -> None:
    options = Cia402RotorActuatorOptions(
        maximum_speed=1.0, increments_per_turn=4000, heartbeat_time=0.0, velocity_unit="counts/s"
    )
    made = Cia402RotorActuator.open(ADDRESS, options, Surroundings(clock), "rotor_actuator")
    assert made.angle().value == pytest.approx(math.pi / 2.0)
    made.close()


def test_an_encoder_that_nobody_knows_is_refused(clock: Any) -> None:
    node = Actuator()
    try:
        node.values[0x608F, 2] = 7
        with pytest.raises(ReportedError, match="Set increments_per_turn in the station file"):
            Cia402RotorActuator.open(ADDRESS, OPTIONS, Surroundings(clock), "rotor_actuator")
    finally:
        node.network.disconnect()


def test_positions_in_units_of_a_feed_are_refused_until_they_are_explained(clock: Any, monkeypatch: Any) -> None:
    real = Actuator.dictionary

    def with_feed(self: Actuator) -> canopen.ObjectDictionary:
        dictionary = real(self)
        self.add_array(dictionary, 0x6092, [2, 3600, 1])
        return dictionary

    monkeypatch.setattr(Actuator, "dictionary", with_feed)
    node = Actuator()
    try:
        with pytest.raises(ReportedError, match=r"units of a feed \(3600 in 1 turns\).*increments_per_turn"):
            Cia402RotorActuator.open(ADDRESS, OPTIONS, Surroundings(clock), "rotor_actuator")
        stated = replace(OPTIONS, increments_per_turn=3600, velocity_unit="rpm")
        made = Cia402RotorActuator.open(ADDRESS, stated, Surroundings(clock), "rotor_actuator")
        assert made.angle().value == pytest.approx(1000 / 3600 * 2.0 * math.pi)
        made.turn(math.pi)
        assert node.writes[-1] == counts(0x60FF, 30)
        made.stop()
        made.close()
    finally:
        node.network.disconnect()


def test_another_node(node: Actuator, clock: Any) -> None:
    node.values[0x1000, 0] = 0x00020191
    with pytest.raises(IdentityError, match="expected profile 402"):
        Cia402RotorActuator.open(ADDRESS, OPTIONS, Surroundings(clock), "rotor_actuator")
