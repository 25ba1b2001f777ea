"""Demands of a procedure on the instruments in its roles. A station can be checked with it before anything is connected."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from drivers.interfaces import InverterAbility, ProbeKind, Role


class Measurand(Enum):
    """A quantity that an instrument reads with an accuracy; its value is the first word of the accuracy options."""

    VOLTAGE = "voltage"
    CURRENT = "current"
    RESISTANCE = "resistance"
    INDUCTANCE = "inductance"
    FREQUENCY = "frequency"
    AMPLITUDE = "amplitude"
    SPEED = "speed"
    TORQUE = "torque"


@dataclass(frozen=True)
class Demand:
    """Demand on one instrument.

    `screen` are the figures that are read off an oscilloscope which gives no waveforms; with `waveforms` it must give them. With
    `automatic` nobody can read as many figures by hand. `probes` is how many there must be of each kind. `abilities` are what an
    inverter must be able to do.
    """

    figures: tuple[Measurand, ...] = ()
    screen: tuple[Measurand, ...] = ()
    waveforms: bool = False
    automatic: bool = False
    probes: Mapping[ProbeKind, int] = field(default_factory=dict)
    abilities: frozenset[InverterAbility] = frozenset()


Demands = Mapping[Role, Demand]
#: A dynamometer that a person reads is asked for both at once.
SHAFT = Demand((Measurand.SPEED, Measurand.TORQUE))
SPEED = Demand((Measurand.SPEED,))
#: Resistance of a loop by the supply's own meters.
LOOP = Demand((Measurand.VOLTAGE, Measurand.CURRENT))
