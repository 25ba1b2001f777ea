"""What stands in front of every instrument that can energise or move: no set point passes that is beyond a limit."""

from bench.safety.limits.bounds import Limits, Observer, nobody
from bench.safety.limits.limited import Limited, PolePairs
from bench.safety.limits.shaft import LimitedDynamometer, LimitedRotorActuator, LimitedTachometer
from bench.safety.limits.winding import (
    LimitedDrive,
    LimitedInsulationTester,
    LimitedInverter,
    LimitedLcrMeter,
    LimitedSupply,
)
from drivers.interfaces import Instrument
from procedures.core.bench import Role


def _unknown() -> None:
    return None


def limited(
    role: Role,
    instrument: Instrument,
    name: str,
    limits: Limits,
    *,
    pole_pairs: PolePairs = _unknown,
    observe: Observer = nobody,
) -> Instrument:
    """Return the instrument with limits in front; one that puts nothing out is returned as it is.

    `name` stands for it in messages, `observe` hears every set point before it is judged.
    """
    kinds: dict[Role, type[Limited]] = {
        Role.SUPPLY: LimitedSupply,
        Role.LCR_METER: LimitedLcrMeter,
        Role.INVERTER: LimitedInverter,
        Role.DYNAMOMETER: LimitedDynamometer,
        Role.DRIVE: LimitedDrive,
        Role.TACHOMETER: LimitedTachometer,
        Role.ROTOR_ACTUATOR: LimitedRotorActuator,
        Role.INSULATION_TESTER: LimitedInsulationTester,
    }
    kind = kinds.get(role)
    return kind(instrument, name, limits, pole_pairs, observe) if kind else instrument
