"""Errors at a bench that cause a known factor, and the comparison of a ratio of two figures with these factors."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.interfaces.text import Text, text
from procedures.core.parameter_definition import FactorErrors

#: Two figures agree within this multiple of their combined standard uncertainty, on top of their check's slack.
COVERAGE = 5.0
#: Figures known no better than this (relative) say nothing of a factor.
_UNKNOWN = 0.2
#: A ratio shows a mistake's factor within this (of the logarithm), or within its uncertainty at 99.7 %.
WINDOW = 0.05
_NAMING = 3.0


@dataclass(frozen=True)
class FactorError:
    """A possible error, and the factor by which it changes the ratio."""

    factor: float
    words: Text


@dataclass(frozen=True)
class Ratio:
    """A ratio that is 1 where all is well, with its relative standard uncertainty."""

    value: float
    uncertainty: float

    def deviates(self, slack: float) -> bool:
        """Tell whether it is off by more than its uncertainty and the slack (of the logarithm) explain."""
        return self.uncertainty < _UNKNOWN and abs(math.log(self.value)) > COVERAGE * self.uncertainty + slack

    def over(self, other: "Ratio") -> "Ratio":
        """Return it divided by another."""
        return Ratio(self.value / other.value, math.hypot(self.uncertainty, other.uncertainty))

    def inverse(self) -> "Ratio":
        """Return one over it."""
        return Ratio(1.0 / self.value, self.uncertainty)

    def shows(self, mistakes: Sequence[FactorError], window: float = WINDOW) -> tuple[Text, ...]:
        """Return the mistakes whose factor it shows, the nearest first, each sentence once."""
        reach = math.hypot(_NAMING * self.uncertainty, window)
        near = sorted((abs(math.log(self.value / m.factor)), k) for k, m in enumerate(mistakes))
        # Two factors may stand for one sentence.
        named = {mistakes[k].words.template: mistakes[k].words for distance, k in near if distance <= reach}
        return tuple(named.values())


def quotient(over: tuple[float, float], under: tuple[float, float]) -> Ratio | None:
    """Return the ratio of two figures, each a value with its standard uncertainty; None where one is not above 0."""
    if not (over[0] > 0.0 and under[0] > 0.0):
        return None
    return Ratio(over[0] / under[0], math.hypot(over[1] / over[0], under[1] / under[0]))


#: Of the measured torque constant against 1.5·p·λ, where p and λ are borne out by the EMF at mechanical speed.
TORQUE = (
    FactorError(math.sqrt(2.0), text("rms current entered for peak")),
    FactorError(math.sqrt(0.5), text("peak current taken for rms and converted once more")),
    FactorError(1.0 / math.sqrt(3.0), text("line voltage entered for phase voltage")),
    FactorError(math.sqrt(3.0), text("phase voltage taken for line voltage and divided by √3")),
    FactorError(0.5, text("peak-to-peak voltage entered for peak, or peak-to-peak current for peak")),
    FactorError(2.0, text("current of one of two parallel leads entered, or the voltage's peak halved")),
    FactorError(1.5, text("the factor 1.5 of the amplitude-invariant torque counted twice")),
    FactorError(1.0 / 1.5, text("the factor 1.5 of the amplitude-invariant torque left out")),
    FactorError(0.1, text("a probe's attenuation of 10 not entered, or entered twice")),
    FactorError(10.0, text("a probe's attenuation of 10 not entered, or entered twice")),
)


def of_flux(pole_pairs: float) -> tuple[FactorError, ...]:
    """Return the mistakes of torque or EMF constant against p·λ, where pole pairs or flux linkage themselves are off."""
    return (
        FactorError(0.5, text("poles entered for pole pairs")),
        FactorError(2.0, text("pole pairs halved once more")),
        FactorError(1.0 / pole_pairs, text("mechanical speed taken for electrical speed in the flux linkage")),
        FactorError(pole_pairs, text("electrical speed multiplied by the pole pairs once more in the flux linkage")),
        FactorError(2.0 * math.pi, text("rad/s taken for Hz: a factor 2π in the flux linkage")),
        FactorError(0.5 / math.pi, text("Hz taken for rad/s: a factor 2π in the flux linkage")),
    )


def of_emf(pole_pairs: float) -> tuple[FactorError, ...]:
    """Return the mistakes of the EMF constant alone against p·λ."""
    return (
        FactorError(1.0 / pole_pairs, text("electrical speed taken for mechanical speed in the EMF constant")),
        FactorError(math.sqrt(3.0), text("line voltage entered for phase voltage in the EMF constant")),
        FactorError(math.sqrt(0.5), text("rms voltage entered for peak in the EMF constant")),
        FactorError(2.0, text("peak-to-peak voltage entered for peak in the EMF constant")),
        FactorError(2.0 * math.pi, text("turns a second taken for rad/s in the EMF constant")),
        FactorError(math.pi / 30.0, text("rpm taken for rad/s in the EMF constant")),
    )


#: Of an inductance by a bridge, or by the step, against the right one.
INDUCTANCE = (
    FactorError(0.75, text("a reading of A against B and C together halved instead of divided by 1.5 (E1)")),
    FactorError(4.0 / 3.0, text("a reading between two lines divided by 1.5 instead of halved")),
    FactorError(1.5, text("a reading of A against B and C together not divided by 1.5")),
    FactorError(2.0, text("a reading between two lines not halved")),
    FactorError(3.0, text("the winding of a delta entered for the Y-equivalent: wye and delta confused")),
    FactorError(1.0 / 3.0, text("a wye divided by 3 as if it were a delta: wye and delta confused")),
)
#: Of a resistance against the one that the step's time constant asks for.
RESISTANCE = (
    FactorError(2.0, text("the resistance between two lines entered for the phase's")),
    FactorError(0.5, text("the phase's resistance halved once more")),
    FactorError(1.5, text("the resistance of A against B and C together entered for the phase's")),
    FactorError(3.0, text("the winding of a delta entered for the Y-equivalent: wye and delta confused")),
    FactorError(1.0 / 3.0, text("a wye divided by 3 as if it were a delta: wye and delta confused")),
)


def of_plate(pole_pairs: float) -> tuple[FactorError, ...]:
    """Return the mistakes of p·λ against rated voltage and speed: only factors that no healthy motor shows."""
    return (
        FactorError(pole_pairs, text("flux linkage per mechanical radian where per electrical radian is meant")),
        FactorError(1.0 / pole_pairs, text("pole pairs left out, or EMF constant divided by them twice")),
        FactorError(2.0 * math.pi, text("a factor 2π: Hz, turns a second and rad/s confused")),
        FactorError(0.5 / math.pi, text("a factor 2π: Hz, turns a second and rad/s confused")),
        FactorError(30.0 / math.pi, text("rpm and rad/s confused")),
        FactorError(math.pi / 30.0, text("rpm and rad/s confused")),
        FactorError(10.0, text("a probe's attenuation of 10 not entered, or entered twice")),
        FactorError(0.1, text("a probe's attenuation of 10 not entered, or entered twice")),
    )


_TYPE_UNITS = (
    FactorError(1000.0, text("a factor 1000 in a unit of the motor file")),
    FactorError(1e-3, text("a factor 1000 in a unit of the motor file")),
)
_TYPE_IMPEDANCE = (
    FactorError(0.5, text("the type value holds between two lines")),
    FactorError(2.0, text("a reading between two lines not halved")),
    FactorError(1.0 / 3.0, text("the type value is that of a delta's winding: wye and delta confused")),
    FactorError(3.0, text("the winding of a delta entered for the Y-equivalent: wye and delta confused")),
)
_TYPE_FLUX = (
    FactorError(1.0 / math.sqrt(3.0), text("the type value holds between two lines, or is that of a delta's winding")),
    FactorError(math.sqrt(3.0), text("line voltage entered for phase voltage")),
    FactorError(math.sqrt(2.0), text("the type value is rms")),
    FactorError(0.5, text("the type value is peak to peak")),
    FactorError(2.0, text("peak-to-peak voltage entered for peak")),
    FactorError(2.0 * math.pi, text("a factor 2π: Hz, turns a second and rad/s confused")),
    FactorError(0.5 / math.pi, text("a factor 2π: Hz, turns a second and rad/s confused")),
)


def of_type_value(errors: FactorErrors | None, pole_pairs: float) -> tuple[FactorError, ...]:
    """Return the mistakes of a measured parameter against its type value; empty for one that has none of its own."""
    if errors is FactorErrors.IMPEDANCE:
        return (*_TYPE_IMPEDANCE, *_TYPE_UNITS)
    if errors is FactorErrors.FLUX:
        per_speed = (
            FactorError(pole_pairs, text("mechanical and electrical speed confused")),
            FactorError(1.0 / pole_pairs, text("mechanical and electrical speed confused")),
        )
        return (*_TYPE_FLUX, *per_speed, *_TYPE_UNITS)
    if errors is FactorErrors.TORQUE:
        return (
            FactorError(math.sqrt(2.0), text("rms current entered for peak")),
            FactorError(math.sqrt(0.5), text("the type value is per rms ampere")),
            FactorError(1.5, text("the factor 1.5 of the amplitude-invariant torque counted twice")),
            FactorError(1.0 / 1.5, text("the factor 1.5 of the amplitude-invariant torque left out")),
            *_TYPE_UNITS,
        )
    return ()
