"""Three-phase inverter that turns the motor under test."""

import math
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from enum import Enum
from typing import Protocol

from drivers.interfaces.declarations import (
    ELECTRICAL,
    Amount,
    Quantity,
    by_ability,
    energises,
    in_units,
    makes_safe,
    question,
    reading,
    readings,
    set_point,
)
from drivers.interfaces.errors import InstrumentError
from drivers.interfaces.identity import Accuracy, Instrument, Reading
from drivers.interfaces.text import Text, text

FREQUENCY = Amount(Quantity.FREQUENCY, "Hz", own="maximum_frequency", signed=True, also=ELECTRICAL)
AMPLITUDE = Amount(Quantity.CURRENT, "A", own="maximum_current")
CURRENT = Amount(Quantity.CURRENT, "A", own="maximum_current", signed=True)
D_CURRENT = replace(CURRENT, label="d-axis current", vector="current vector")
Q_CURRENT = replace(D_CURRENT, label="q-axis current")
#: The second of two current vectors that alternate.
OTHER_D_CURRENT = replace(CURRENT, label="other d-axis current", vector="other current vector")
OTHER_Q_CURRENT = replace(OTHER_D_CURRENT, label="other q-axis current")
OUTPUT_FREQUENCY = Amount(Quantity.FREQUENCY, "Hz", also=ELECTRICAL)


class InverterAbility(Enum):
    """Abilities that not every inverter has."""

    FREQUENCY = "frequency"
    Q_CURRENT = "q_current"
    DQ_CURRENT = "dq_current"
    DQ_STROKES = "dq_strokes"
    VOLTAGES = "voltages"
    ROTOR_ANGLE = "rotor_angle"

    @property
    def label(self) -> Text:
        """Its name for people."""
        return _LABELS[self]


_LABELS = {
    InverterAbility.FREQUENCY: text("a frequency at a current"),
    InverterAbility.Q_CURRENT: text("a q-axis current"),
    InverterAbility.DQ_CURRENT: text("d- and q-axis currents"),
    InverterAbility.DQ_STROKES: text("strokes of d- and q-axis currents"),
    InverterAbility.VOLTAGES: text("readings of its d- and q-axis voltages"),
    InverterAbility.ROTOR_ANGLE: text("readings of the rotor's angle"),
}


class AbilityError(InstrumentError):
    """The inverter does not have the requested ability; nothing was sent."""

    def __init__(self, instrument: str, ability: InverterAbility) -> None:
        self.ability = ability
        super().__init__(
            instrument,
            text("this inverter does not offer {ability}; nothing was sent", ability=ability.label),
            remedy=text("Use another inverter for this procedure"),
        )


@dataclass(frozen=True)
class DqReading:
    """One reading in the rotor's frame: d along the magnet, currents into the motor, amplitude-invariant (peak).

    `d_current`, `q_current` (A) and `d_voltage`, `q_voltage` (V, what the inverter puts out before dead time; NaN where it does not
    say), `electrical_speed` (rad/s) and `electrical_angle` of the rotor (rad, 0 … 2π; NaN where it does not say), means of `samples`
    taken within `duration` (s) about bench time `time` (s). `bus_voltage` (V) and the temperatures (°C) are NaN where not measured.
    """

    time: float
    d_current: float
    q_current: float
    d_voltage: float
    q_voltage: float
    electrical_speed: float
    electrical_angle: float
    current_accuracy: Accuracy
    voltage_accuracy: Accuracy
    bus_voltage: float = math.nan
    winding_temperature: float = math.nan
    board_temperature: float = math.nan
    duration: float = 0.0
    samples: int = 1

    @property
    def current_amplitude(self) -> float:
        """Length (A) of the current vector: the amplitude of the phase currents."""
        return math.hypot(self.d_current, self.q_current)

    @property
    def electrical_frequency(self) -> float:
        """Electrical frequency (Hz), signed."""
        return self.electrical_speed / (2.0 * math.pi)


@dataclass(frozen=True)
class DqSample:
    """Report of a drive at one instant, bench time `time` (s), in the rotor's frame like `DqReading`.

    Currents (A, peak), electrical angle (rad, no turns taken off it) and speed (rad/s).
    """

    time: float
    d_current: float
    q_current: float
    electrical_angle: float
    electrical_speed: float


class Inverter(Instrument, Protocol):
    """A drive that turns a field, or regulates currents in the rotor's frame. Currents are phase, peak, in A.

    A method that needs an ability which the drive lacks raises AbilityError; nothing is sent.
    """

    @property
    @question
    def abilities(self) -> frozenset[InverterAbility]:
        """Capabilities of the inverter."""

    @property
    @question
    def maximum_current(self) -> float:
        """Largest phase current (A, peak) that may be commanded."""

    @property
    @question
    def maximum_frequency(self) -> float:
        """Largest electrical frequency (Hz) that may be commanded; 0 for an inverter that cannot turn at a commanded frequency."""

    @by_ability(InverterAbility.FREQUENCY)
    @energises(frequency=FREQUENCY, current=AMPLITUDE)
    def driving_frequency(self, frequency: float, current: float) -> AbstractContextManager[None]:
        """Turn the field at a fixed electrical frequency (Hz, sign is direction) with a phase current (A, peak).

        The block is entered once the ramp has ended; at its end the drive is disabled.
        """
        raise AbilityError(self.identity.model, InverterAbility.FREQUENCY)

    @by_ability(InverterAbility.Q_CURRENT)
    @energises(current=CURRENT)
    def driving_current(self, current: float) -> AbstractContextManager[None]:
        """Regulate the torque-producing (q-axis) current (A, peak) for the length of the block."""
        raise AbilityError(self.identity.model, InverterAbility.Q_CURRENT)

    @by_ability(InverterAbility.Q_CURRENT)
    @set_point(current=CURRENT)
    def set_current(self, current: float) -> None:
        """Change the q-axis current (A, peak) inside a `driving_current` block and wait until it has settled."""
        raise AbilityError(self.identity.model, InverterAbility.Q_CURRENT)

    @by_ability(InverterAbility.DQ_CURRENT)
    @energises(d_current=D_CURRENT, q_current=Q_CURRENT)
    def driving_dq_current(self, d_current: float, q_current: float) -> AbstractContextManager[None]:
        """Regulate the d- and q-axis currents (A, peak) at the rotor's own angle for the length of the block.

        The block is entered once they have settled; at its end the drive is disabled.
        """
        raise AbilityError(self.identity.model, InverterAbility.DQ_CURRENT)

    @by_ability(InverterAbility.DQ_CURRENT)
    @set_point(d_current=D_CURRENT, q_current=Q_CURRENT)
    def set_dq_current(self, d_current: float, q_current: float) -> None:
        """Change both currents (A, peak) inside a `driving_dq_current` block and wait until they have settled."""
        raise AbilityError(self.identity.model, InverterAbility.DQ_CURRENT)

    @by_ability(InverterAbility.DQ_STROKES)
    @in_units(duration="s")
    @set_point(
        d_current=D_CURRENT,
        q_current=Q_CURRENT,
        other_d_current=OTHER_D_CURRENT,
        other_q_current=OTHER_Q_CURRENT,
        duration=None,
        strokes=None,
    )
    def alternate_dq_current(
        self,
        d_current: float,
        q_current: float,
        other_d_current: float,
        other_q_current: float,
        duration: float,
        strokes: int,
    ) -> Sequence[DqSample]:
        """Alternate between two current vectors (A, peak) inside a `driving_dq_current` block, then return to zero current.

        None of the `strokes`, an odd number, waits until a current has settled: each lasts `duration` (s), the first and the last half
        of it, so that a rotor that swings with them stands where it was when they end. Returns what the drive says just before each
        stroke, before it commands none, and `duration` after that.
        """
        raise AbilityError(self.identity.model, InverterAbility.DQ_STROKES)

    @makes_safe("command_zero")
    def command_zero(self) -> None:
        """Command no speed and no current, whatever the drive does now; it stays enabled if it was."""

    @reading("Hz", Quantity.FREQUENCY, also=ELECTRICAL)
    def measure_frequency(self) -> Reading:
        """Return the electrical frequency (Hz) the drive puts out."""

    @reading("A", Quantity.CURRENT)
    def measure_current(self) -> Reading:
        """Return the torque-producing current (A, peak) as the drive reports it."""

    @by_ability(InverterAbility.DQ_CURRENT)
    @in_units(duration="s")
    @readings(current_amplitude=AMPLITUDE, electrical_frequency=OUTPUT_FREQUENCY)
    def measure_dq(self, duration: float = 0.0) -> DqReading:
        """Return currents, voltages and the rotor's speed and angle, averaged over what the drive reports within `duration` (s).

        One sample where the duration is 0. Voltages need VOLTAGES, the angle ROTOR_ANGLE; they are NaN without.
        """
        raise AbilityError(self.identity.model, InverterAbility.DQ_CURRENT)
