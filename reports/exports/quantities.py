"""The one place where measured parameters become what controllers ask for: formula, unit and convention side by side.

λ: peak flux linkage of a phase to neutral of the Y-equivalent, Wb. p: pole pairs. R, L: per phase of the Y-equivalent.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.parameters import PARAMETERS
from procedures.core.result import Parameter
from procedures.techniques.temperature.settings import COLD
from reports.exports.figures import ExportFigure
from reports.exports.map_quantities import FromMap
from reports.exports.subject import Datasheet

if TYPE_CHECKING:
    from GTC.lib import UncertainReal

#: Parameters by name, as uncertain numbers.
Given = Mapping[str, "UncertainReal"]
#: Electrical (and mechanical) speed of 1000 rpm of one pole pair (rad/s).
_KRPM = 2.0 * math.pi * 1000.0 / 60.0


@dataclass(frozen=True)
class ExportQuantity:
    """A figure that a controller asks for: from which parameters, by which formula, in which unit, by which convention.

    `whole` figures are counts. Convention and unit stand in the files, and so are plain ASCII.
    """

    unit: str
    convention: str
    needs: tuple[ParameterDefinition, ...]
    formula: "Callable[[Given], UncertainReal]"
    whole: bool = False


@dataclass(frozen=True)
class FromPlate:
    """A figure that only the data sheet knows; `value` is None where it says nothing, and `key` is what the motor file lacks."""

    unit: str
    convention: str
    key: str
    value: Callable[[Datasheet], float | None]


@dataclass(frozen=True)
class Fixed:
    """A figure that follows from how this project reports: no uncertainty."""

    unit: str
    convention: str
    value: float


_POLE_PAIRS, _FLUX = PARAMETERS["pole_pairs"], PARAMETERS["flux_linkage"]
_D, _Q = PARAMETERS["d_axis_inductance"], PARAMETERS["q_axis_inductance"]


def _as_measured(definition: ParameterDefinition, convention: str) -> ExportQuantity:
    """Return a parameter itself, its unit in ASCII."""
    unit = "" if definition.unit == "1" else definition.reader_unit or definition.unit
    for sign, instead in (("Ω", "Ohm"), ("·", "*"), ("²", "^2")):
        unit = unit.replace(sign, instead)
    name = definition.name
    return ExportQuantity(unit, convention, (definition,), lambda g: g[name], whole=definition.whole)


POLE_PAIRS = _as_measured(_POLE_PAIRS, "pole pairs")
POLES = ExportQuantity("", "poles, twice the pole pairs", (_POLE_PAIRS,), lambda g: 2.0 * g["pole_pairs"], whole=True)
RESISTANCE = _as_measured(
    PARAMETERS["stator_resistance"],
    "phase to neutral of the Y-equivalent (half of what two terminals measure), at 25 degC",
)
D_INDUCTANCE = _as_measured(_D, "d axis, per phase of the Y-equivalent")
Q_INDUCTANCE = _as_measured(_Q, "q axis, per phase of the Y-equivalent")
MEAN_INDUCTANCE = ExportQuantity(
    "H",
    "mean of Ld and Lq, per phase of the Y-equivalent",
    (_D, _Q),
    lambda g: 0.5 * (g["d_axis_inductance"] + g["q_axis_inductance"]),
)
INDUCTANCE_DIFFERENCE = ExportQuantity(
    "H",
    "Lq - Ld, per phase of the Y-equivalent",
    (_D, _Q),
    lambda g: g["q_axis_inductance"] - g["d_axis_inductance"],
)
#: VESC's detection multiplies what it measured by this before it stores it, so that its observer stays stable.
VESC_SCALE = 0.9
VESC_MEAN_INDUCTANCE = ExportQuantity(
    "H",
    "0.9 times the mean of Ld and Lq, per phase of the Y-equivalent: as VESC's own detection stores it",
    (_D, _Q),
    lambda g: VESC_SCALE * MEAN_INDUCTANCE.formula(g),
)
VESC_INDUCTANCE_DIFFERENCE = ExportQuantity(
    "H",
    "0.9 times Lq - Ld, per phase of the Y-equivalent: as VESC's own detection stores it",
    (_D, _Q),
    lambda g: VESC_SCALE * INDUCTANCE_DIFFERENCE.formula(g),
)
FLUX_LINKAGE = _as_measured(_FLUX, "peak, phase to neutral of the Y-equivalent, at 25 degC")
FLUX_PER_HERTZ = ExportQuantity(
    "V/Hz",
    "peak phase-to-neutral volts per electrical hertz: 2 pi lambda",
    (_FLUX,),
    lambda g: 2.0 * math.pi * g["flux_linkage"],
)
TORQUE_CONSTANT = ExportQuantity(
    "N*m/A",
    "per peak phase ampere (amplitude-invariant): 1.5 p lambda",
    (_POLE_PAIRS, _FLUX),
    lambda g: 1.5 * g["pole_pairs"] * g["flux_linkage"],
)
KV = ExportQuantity(
    "rpm/V",
    "mechanical rpm per peak line-to-line volt: 60 / (2 pi sqrt(3) p lambda)",
    (_POLE_PAIRS, _FLUX),
    lambda g: 60.0 / (2.0 * math.pi * math.sqrt(3.0) * g["pole_pairs"] * g["flux_linkage"]),
)
EMF_PEAK_LINE = ExportQuantity(
    "V/krpm",
    "peak line-to-line volts per 1000 mechanical rpm: sqrt(3) lambda p 2 pi 1000/60",
    (_POLE_PAIRS, _FLUX),
    lambda g: math.sqrt(3.0) * _KRPM * g["pole_pairs"] * g["flux_linkage"],
)
EMF_RMS_LINE = ExportQuantity(
    "V/krpm",
    "rms line-to-line volts per 1000 mechanical rpm: sqrt(3/2) lambda p 2 pi 1000/60",
    (_POLE_PAIRS, _FLUX),
    lambda g: math.sqrt(1.5) * _KRPM * g["pole_pairs"] * g["flux_linkage"],
)
INERTIA = _as_measured(PARAMETERS["inertia"], "rotor alone")
VISCOUS_FRICTION = _as_measured(PARAMETERS["viscous_friction"], "over mechanical speed, rotor alone")
COULOMB_FRICTION = _as_measured(PARAMETERS["coulomb_friction"], "rotor alone")
RESISTANCE_TEMPERATURE = Fixed("degC", "winding temperature to which the resistance is referred", COLD)
RATED_CURRENT = FromPlate("A", "rated current, phase, peak; data sheet", "rated_current", lambda s: s.rated_current)
MAXIMUM_CURRENT = FromPlate(
    "A", "largest current, phase, peak; data sheet", "maximum_current", lambda s: s.maximum_current
)
RATED_SPEED = FromPlate("rpm", "rated speed, mechanical; data sheet", "rated_speed_rpm", lambda s: s.rated_speed_rpm)
LARGEST_SPEED = FromPlate(
    "rpm",
    "largest speed, mechanical (the rated one where the data sheet gives no other); data sheet",
    "maximum_speed_rpm",
    lambda s: s.maximum_speed_rpm if s.maximum_speed_rpm is not None else s.rated_speed_rpm,
)

Source = ExportQuantity | FromPlate | Fixed | FromMap


def uncertain(parameters: Mapping[str, Parameter]) -> "dict[str, UncertainReal]":
    """Return the parameters as uncertain numbers, correlated by the inputs that their budgets share."""
    # Who only wants the targets' names need not wait for it.
    from GTC import set_correlation, ureal

    result = {
        name: ureal(p.value, p.standard_uncertainty, label=name, independent=False) for name, p in parameters.items()
    }
    names = [name for name, p in parameters.items() if p.standard_uncertainty > 0.0]
    for position, first in enumerate(names):
        for second in names[position + 1 :]:
            coefficient = correlation(parameters[first], parameters[second])
            if coefficient:
                set_correlation(coefficient, result[first], result[second])
    return result


def correlation(first: Parameter, second: Parameter) -> float:
    """Return the correlation coefficient of two parameters of one run; 0 where one has no uncertainty."""
    product = first.standard_uncertainty * second.standard_uncertainty
    return max(-1.0, min(1.0, first.covariance(second) / product)) if product > 0.0 else 0.0


def figure(
    quantity: ExportQuantity | FromPlate | Fixed, parameters: Mapping[str, Parameter], datasheet: Datasheet
) -> ExportFigure:
    """Return a quantity's value; its parameters are there. The interval is as wide in uncertainties as theirs at widest."""
    if isinstance(quantity, Fixed):
        return ExportFigure(quantity.value, exact=True)
    if isinstance(quantity, FromPlate):
        value = quantity.value(datasheet)
        return ExportFigure(math.nan if value is None else value, exact=True)
    taken = {definition.name: parameters[definition.name] for definition in quantity.needs}
    made = quantity.formula(uncertain(taken))
    value, spread = float(made.x), float(made.u)
    if not spread:
        return ExportFigure(value, 0.0, (value, value), exact=quantity.whole)
    widest = max(
        (p.coverage_interval[1] - p.value) / p.standard_uncertainty
        for p in taken.values()
        if p.standard_uncertainty > 0.0
    )
    return ExportFigure(value, spread, (value - widest * spread, value + widest * spread))
