"""The way down as data: what is done to which instrument, in which order, and how each item is done."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol

from drivers.interfaces import Clock
from procedures.core.bench import Role
from drivers.interfaces.text import text


class Do(StrEnum):
    """What an item does, as a station file writes it."""

    COMMAND_ZERO = "command_zero"
    DISABLE = "disable"
    OUTPUT_OFF = "output_off"
    BRAKE = "brake"
    SILENCE = "silence"
    VOLTAGE_DECAYED = "voltage_decayed"
    CURRENT_ZERO = "current_zero"
    SPEED_ZERO = "speed_zero"
    OPEN = "open"


#: Roles that each item can be done to.
ROLES_OF: Mapping[Do, tuple[Role, ...]] = {
    Do.COMMAND_ZERO: (Role.INVERTER, Role.DYNAMOMETER),
    Do.DISABLE: (Role.INVERTER, Role.DRIVE, Role.DYNAMOMETER, Role.ROTOR_ACTUATOR),
    Do.OUTPUT_OFF: (Role.INSULATION_TESTER, Role.SUPPLY),
    Do.BRAKE: (Role.DYNAMOMETER,),
    Do.SILENCE: (Role.LCR_METER, Role.OSCILLOSCOPE, Role.TACHOMETER, Role.VOLTMETER),
    Do.VOLTAGE_DECAYED: (Role.SUPPLY, Role.VOLTMETER),
    Do.CURRENT_ZERO: (Role.SUPPLY,),
    Do.SPEED_ZERO: (Role.DYNAMOMETER, Role.DRIVE, Role.INVERTER, Role.TACHOMETER),
    Do.OPEN: (Role.SWITCH_MATRIX,),
}
#: What takes the energy away from each role that can feed some.
OFF_BY: Mapping[Role, Do] = {
    Role.INSULATION_TESTER: Do.OUTPUT_OFF,
    Role.ROTOR_ACTUATOR: Do.DISABLE,
    Role.INVERTER: Do.DISABLE,
    Role.DRIVE: Do.DISABLE,
    Role.DYNAMOMETER: Do.DISABLE,
    Role.SUPPLY: Do.OUTPUT_OFF,
}
#: What the measuring items ask for unless the station says otherwise: below (V; A; rad/s) and within (s).
# Through a few milliohms tens of amperes flow below a volt, so that an output that stays on shows in the current alone.
BELOW: Mapping[Do, float] = {Do.VOLTAGE_DECAYED: 1.0, Do.CURRENT_ZERO: 0.05, Do.SPEED_ZERO: 1.0}
WITHIN: Mapping[Do, float] = {Do.VOLTAGE_DECAYED: 5.0, Do.CURRENT_ZERO: 5.0, Do.SPEED_ZERO: 60.0}
_WHAT: Mapping[Do, str] = {
    Do.VOLTAGE_DECAYED: "the voltage",
    Do.CURRENT_ZERO: "the current",
    Do.SPEED_ZERO: "the speed",
}
#: How often (s) a measuring item looks.
_LOOK = 0.05


@dataclass(frozen=True)
class Item:
    """One item; `below` (V; A; rad/s, electrical where a drive measures it) and `within` (s) are 0 but for those that measure."""

    do: Do
    role: Role
    below: float = 0.0
    within: float = 0.0

    @property
    def measures(self) -> bool:
        """Whether it waits for a measurement instead of commanding."""
        return self.do in BELOW


class Hurry(Protocol):
    """Whether nobody waits any more."""

    def is_set(self) -> bool:
        """Say so."""


@dataclass(frozen=True)
class Measured:
    """What a measuring item found in the end."""

    value: float
    unit: str


class NotReachedError(Exception):
    """What was to be measured did not come about in time."""

    def __init__(self, found: Measured, message: str) -> None:
        self.found = found
        super().__init__(message)


def item(do: Do, role: Role, below: float | None = None, within: float | None = None) -> Item:
    """Return an item with what is not given filled in. Raises ValueError where the role cannot do it."""
    if role not in ROLES_OF[do]:
        allowed = ", ".join(one.value for one in ROLES_OF[do])
        raise ValueError(
            text("{do} cannot be done to {role}; allowed is {allowed}", do=do.value, role=role.value, allowed=allowed)
        )
    if do not in BELOW:
        if below is not None or within is not None:
            raise ValueError(text("{do} measures nothing; leave below and within out", do=do.value))
        return Item(do, role)
    return Item(do, role, BELOW[do] if below is None else below, WITHIN[do] if within is None else within)


def default_items(by_hand: Iterable[Role] = ()) -> tuple[Item, ...]:
    """Return the list of a station that gives none; a person (`by_hand`) is asked for one thing an instrument."""
    manual = set(by_hand)
    commands = [item(Do.COMMAND_ZERO, role) for role in (Role.INVERTER, Role.DYNAMOMETER) if role not in manual]
    high_voltage = item(Do.OUTPUT_OFF, Role.INSULATION_TESTER)
    off = [item(Do.DISABLE, role) for role in ROLES_OF[Do.DISABLE]]
    quiet = [item(Do.SILENCE, role) for role in ROLES_OF[Do.SILENCE]]
    measured = [
        item(do, role)
        for do, role in (
            (Do.VOLTAGE_DECAYED, Role.SUPPLY),
            (Do.CURRENT_ZERO, Role.SUPPLY),
            (Do.SPEED_ZERO, Role.DYNAMOMETER),
            (Do.SPEED_ZERO, Role.DRIVE),
            # Of a drive that is on and says it is not, the shaft tells.
            (Do.SPEED_ZERO, Role.TACHOMETER),
        )
        if role not in manual
    ]
    # Contacts that part under current burn, so they are the last, whatever became of the rest.
    relays = item(Do.OPEN, Role.SWITCH_MATRIX)
    return (high_voltage, *commands, *off, item(Do.OUTPUT_OFF, Role.SUPPLY), *quiet, *measured, relays)


def perform(one: Item, instrument: Any, clock: Clock, hurry: Hurry) -> Measured | None:
    """Do an item to its instrument; return what was measured, if it measures.

    With `hurry` set, a measuring item looks once. Raises what the driver raises, NotReachedError for a value that is
    still too large.
    """
    if one.measures:
        return _await(one, _measurement(one, instrument), clock, hurry)
    _command(one, instrument)()
    return None


def _command(one: Item, instrument: Any) -> Callable[[], object]:
    match one.do:
        case Do.COMMAND_ZERO:
            command = instrument.command_zero
        case Do.OUTPUT_OFF if one.role is Role.SUPPLY:
            command = instrument.output_off
        case Do.BRAKE:
            command = instrument.stop
        case _:
            command = instrument.make_safe
    return command  # type: ignore[no-any-return]


def _measurement(one: Item, instrument: Any) -> Callable[[], Measured]:
    def voltage() -> Measured:
        if one.role is Role.VOLTMETER:
            # Its range is whatever the last measurement needed, millivolts perhaps.
            instrument.configure(max(100.0, one.below))
        return Measured(abs(instrument.measure_voltage().value), "V")

    def speed() -> Measured:
        if one.role is Role.DYNAMOMETER:
            return Measured(abs(instrument.measure().speed), "rad/s")
        if one.role is Role.TACHOMETER:
            return Measured(abs(instrument.measure_speed().value), "rad/s")
        return Measured(abs(instrument.measure_frequency().value) * 2.0 * math.pi, "rad/s")

    def current() -> Measured:
        return Measured(abs(instrument.measure_current().value), "A")

    return {Do.VOLTAGE_DECAYED: voltage, Do.CURRENT_ZERO: current}.get(one.do, speed)


def _await(one: Item, measure: Callable[[], Measured], clock: Clock, hurry: Hurry) -> Measured:
    deadline = clock.now() + one.within
    while not (found := measure()).value <= one.below:
        if hurry.is_set() or clock.now() >= deadline:
            waited = "not waited for" if hurry.is_set() else f"after {one.within:g} s"
            what = _WHAT[one.do]
            raise NotReachedError(
                found, f"{what} is {found.value:.4g} {found.unit} {waited}; at most {one.below:g} {found.unit} is safe"
            )
        clock.sleep(_LOOK)
    return found
