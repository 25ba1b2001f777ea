"""Rotor actuator: a servo drive of the CiA 402 profile with brake, clutch and the dynamometer's coupling on its outputs."""

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

from sim_instruments.instruments.cia402.power import (
    ACTUAL_VELOCITY,
    CONTROL_WORD,
    DC_VOLTAGE,
    MODE,
    DriveState,
    ObjectEntry,
    PoweredDrive,
    numbered,
    standard_entries,
)
from sim_instruments.instruments.cia402.setting_up import increments_of, shaft_unit, unit_entries
from sim_instruments.world.fixture.shaft_mechanism import Mechanism, Part

if TYPE_CHECKING:
    from sim_instruments.catalogue import Options
    from sim_instruments.world.world import World

POSITION, TARGET_POSITION, PROFILE_SPEED, TARGET_VELOCITY = 0x6064, 0x607A, 0x6081, 0x60FF
HIGHEST_SPEED, ENCODER, INPUTS, OUTPUTS = 0x6080, 0x608F, 0x60FD, 0x60FE
PROFILE_POSITION, PROFILE_VELOCITY = 1, 3
#: 60FEh:2, the bit mask of the outputs.
MASK = numbered(OUTPUTS, 2)
_ALL = int(Part.BRAKE | Part.CLUTCH | Part.COUPLING)
#: Following error of CiA 402-2, and of the maker's own for a coupling that was told to move while its shaft turned.
FOLLOWING_ERROR, COUPLING_REFUSED = 0x8611, 0xFF01
_NEW_SET_POINT, _RELATIVE = 0x0010, 0x0040
_TARGET_REACHED, _ACKNOWLEDGED = 0x0400, 0x1000
#: 60A9h: encoder increments (B5h) a second (03h).
_INCREMENTS_A_SECOND = 0x00B50300
#: Its highest speed, rad/s.
_HIGHEST = 100.0 * math.pi


@dataclass(frozen=True)
class _Move:
    """A positioning: until a time (s), at a speed (rad/s, signed), to a position (increments)."""

    until: float
    speed: float
    target: int


_Law = tuple[Literal["free", "locked", "hold", "turn", "move"], float | _Move | None]


class Cia402Actuator(PoweredDrive):
    """Simulated side of the actuator. Position in increments of 65536 a turn, velocity in increments/s, forwards positive; options may
    say otherwise.

    Its encoder sits on the motor's shaft. With the clutch engaged and operation enabled the shaft follows the drive without a
    ramp; not enabled the drive lets the shaft turn. A set point given while the shaft moves takes over at once. What keeps the
    shaft from following, and a coupling told to move while it turns, are faults (8611h, FF01h).
    """

    def __init__(self, world: "World", *, options: "Options" = MappingProxyType({})) -> None:
        super().__init__(world, (PROFILE_POSITION, PROFILE_VELOCITY))
        self._increments = increments_of(options)
        self._unit = shaft_unit(options, _INCREMENTS_A_SECOND)
        # What one count of a position and of a velocity is.
        self._step = 2.0 * math.pi / self._increments
        self._pace = 2.0 * math.pi / self._unit.counts
        self._mechanism = Mechanism(world.clock, world.lock, self._arrived)
        self._target_position = self._profile_speed = self._velocity = 0
        self._outputs, self._mask = 0, _ALL
        self._move: _Move | None = None
        self._law: _Law = ("free", None)
        self._fastest = math.floor(_HIGHEST / self._pace)
        self._readers = {
            **self._power.readers(self._status),
            POSITION: lambda: _int32(round(world.dial_angle() / self._step)),
            ACTUAL_VELOCITY: lambda: _int32(round(world.shaft_velocity() / self._pace)),
            TARGET_POSITION: lambda: self._target_position,
            PROFILE_SPEED: lambda: self._profile_speed,
            TARGET_VELOCITY: lambda: self._velocity,
            HIGHEST_SPEED: lambda: math.floor(_HIGHEST * 60.0 / (2.0 * math.pi)),
            DC_VOLTAGE: lambda: 48_000,
            OUTPUTS: lambda: self._outputs,
            MASK: lambda: self._mask,
            INPUTS: lambda: int(self._mechanism.state),
        }

    @property
    def entries(self) -> tuple[ObjectEntry, ...]:
        """Return the object dictionary."""
        return (
            *standard_entries("Virtual rotor actuator", 0x00000404, 0x00000005),
            ObjectEntry(POSITION, "Position actual value", "i32"),
            ObjectEntry(TARGET_POSITION, "Target position", "i32", "rw"),
            ObjectEntry(HIGHEST_SPEED, "Max motor speed", "u32"),
            ObjectEntry(PROFILE_SPEED, "Profile velocity", "u32", "rw"),
            ObjectEntry(ENCODER, "Position encoder resolution: highest subindex", "u8", "const", 0, 2),
            ObjectEntry(
                ENCODER, "Position encoder resolution: encoder increments", "u32", "const", 1, self._increments
            ),
            ObjectEntry(ENCODER, "Position encoder resolution: motor revolutions", "u32", "const", 2, 1),
            ObjectEntry(INPUTS, "Digital inputs", "u32"),
            ObjectEntry(OUTPUTS, "Digital outputs: highest subindex", "u8", "const", 0, 2),
            ObjectEntry(OUTPUTS, "Digital outputs: physical outputs", "u32", "rw", 1),
            ObjectEntry(OUTPUTS, "Digital outputs: bit mask", "u32", "rw", 2),
            *unit_entries(self._unit),
            ObjectEntry(TARGET_VELOCITY, "Target velocity", "i32", "rw"),
        )

    def _limits(self) -> dict[int, tuple[int, int]]:
        fastest = self._fastest
        return {**super()._limits(), PROFILE_SPEED: (0, fastest), TARGET_VELOCITY: (-fastest, fastest)}

    def _set(self, index: int, value: int) -> None:
        begins = index == CONTROL_WORD and value & _NEW_SET_POINT and not self._power.control & _NEW_SET_POINT
        super()._set(index, value)
        if begins and self._power.active and self._power.mode == PROFILE_POSITION:
            self._begin_move(relative=bool(value & _RELATIVE))
        elif index == MODE:
            self._move = None
        elif index == TARGET_POSITION:
            self._target_position = value
        elif index == PROFILE_SPEED:
            self._profile_speed = value
        elif index == TARGET_VELOCITY:
            self._velocity = value
        elif index == OUTPUTS:
            self._outputs = value
            self._switch()
        elif index == MASK:
            self._mask = value
            self._switch()

    # brake, clutch, coupling

    def _switch(self) -> None:
        """Command what the outputs say; those that the mask leaves out stay as they are."""
        commanded = self._mechanism.commanded
        wanted = Part((self._outputs & self._mask | int(commanded) & ~self._mask) & _ALL)
        changed = wanted ^ self._mechanism.commanded
        if Part.COUPLING in changed and self._turns():
            wanted ^= Part.COUPLING
            self._outputs ^= Part.COUPLING
            self._power.trip(COUPLING_REFUSED)
        self._mechanism.command(wanted)

    def _turns(self) -> bool:
        return self._world.shaft_velocity() != 0.0 or self._world.dynamometer.own_speed != 0.0

    def _arrived(self, part: Part, closed: bool) -> bool:
        """Take note that a part has moved; return whether it could."""
        could = True
        if part is Part.COUPLING:
            try:
                if closed:
                    self._world.couple_dynamometer()
                else:
                    self._world.uncouple_dynamometer()
            except RuntimeError:
                self._outputs ^= Part.COUPLING
                self._power.trip(COUPLING_REFUSED)
                could = False
        self._apply()
        return could

    # motion

    def _begin_move(self, *, relative: bool) -> None:
        here = self._readers[POSITION]()
        target = here + self._target_position if relative else self._target_position
        speed = self._profile_speed * self._pace
        if speed == 0.0:
            self._move = None
            return
        way = target * self._step - self._world.dial_angle()
        self._move = _Move(self._world.clock.now() + abs(way) / speed, math.copysign(speed, way), target)

    def _wanted(self) -> _Law:
        power, closed = self._power, self._mechanism.state
        if Part.BRAKE in closed:
            return "locked", None
        if Part.CLUTCH not in closed or not (power.active or power.state is DriveState.QUICK_STOP_ACTIVE):
            return "free", None
        if power.stopped:
            self._move = None
        elif power.mode == PROFILE_VELOCITY and self._velocity:
            return "turn", self._velocity * self._pace
        elif power.mode == PROFILE_POSITION and self._move is not None:
            return "move", self._move
        return "hold", None

    def _apply(self) -> None:
        """Have the shaft do what drive, brake and clutch make of it."""
        law = self._wanted()
        if law[0] == "locked" and self._drives():
            self._power.trip(FOLLOWING_ERROR)
        if law == self._law:
            return
        try:
            self._take(law)
        except RuntimeError:
            self._power.trip(FOLLOWING_ERROR)
            law = "free", None
            self._take(law)
        self._law = law

    def _drives(self) -> bool:
        """Return whether the drive would turn the shaft if the brake let it."""
        power = self._power
        if not power.active or power.stopped or Part.CLUTCH not in self._mechanism.state:
            return False
        if power.mode == PROFILE_VELOCITY:
            return bool(self._velocity)
        return self._move is not None and self._world.clock.now() < self._move.until

    def _take(self, law: _Law) -> None:
        world, (kind, value) = self._world, law
        if kind == "locked":
            world.lock_rotor()
            return
        world.release_rotor()
        if kind == "turn" and isinstance(value, float):
            world.turn_shaft(value)
        elif kind == "move" and isinstance(value, _Move):
            world.move_shaft(value.speed, max(value.until - world.clock.now(), 0.0))
        elif kind == "hold":
            world.hold_shaft()
        else:
            world.let_go()

    def _status(self) -> int:
        power = self._power
        word = power.status
        if power.state is not DriveState.OPERATION_ENABLED:
            return word
        reached = False
        if power.stopped:
            reached = self._world.shaft_velocity() == 0.0
        elif power.mode == PROFILE_POSITION:
            word |= _ACKNOWLEDGED if power.control & _NEW_SET_POINT else 0
            move = self._move
            reached = self._law == ("move", move) and move is not None and self._world.clock.now() >= move.until
        elif power.mode == PROFILE_VELOCITY:
            reached = self._readers[ACTUAL_VELOCITY]() == self._velocity
        return word | _TARGET_REACHED if reached else word


def _int32(value: int) -> int:
    return (value + 0x80000000) % 0x100000000 - 0x80000000
