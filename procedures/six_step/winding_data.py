"""R_11 and L11 − L12 of a six-step drive's motor: as set, else as measured before, with what is known of them."""

from collections.abc import Callable, Mapping

from GTC.lib import UncertainReal

from drivers.interfaces.text import Text, text
from procedures.core.budget import Uncertainties
from procedures.core.result import Parameter
from procedures.six_step.parts import WindingData
from procedures.six_step.settings import UNSTATED_INDUCTANCE, UNSTATED_RESISTANCE, EquivalentResistanceSettings
from procedures.techniques.temperature.correction import MAGNET_SPREAD
from procedures.techniques.temperature.settings import COLD

Tell = Callable[[str, Text], None]

_INDUCTANCE = text("L11 − L12 is not known; run an inductance procedure first, or set winding_inductance=…")
#: What is said where an earlier result is neither there nor set.
UNKNOWN: Mapping[str, Text] = {
    "torque_constant": text(
        "no torque constant is known, so no load can be chosen; run torque-constant first, or set loads=[…]"
    ),
    "stator_resistance": text("R_11 is not known; run stator-resistance first, or set winding_resistance=…"),
    "d_axis_inductance": _INDUCTANCE,
    "q_axis_inductance": _INDUCTANCE,
}


def winding_data(
    settings: EquivalentResistanceSettings,
    known: Mapping[str, Parameter],
    unc: Uncertainties,
    start: UncertainReal,
    *,
    delta: bool,
    tell: Tell,
) -> WindingData:
    """Return the winding; `start` (°C) is its temperature as the run begins. What is assumed is told."""
    whole = 3.0 if delta else 1.0
    reference = settings.winding_resistance_temperature
    if settings.winding_resistance is not None:
        resistance = _given(
            "R_11",
            settings.winding_resistance,
            settings.winding_resistance_uncertainty,
            UNSTATED_RESISTANCE,
            unc,
            tell,
            "winding_resistance_uncertainty",
        )
    else:
        resistance, reference = whole * unc.of_parameter(known["stator_resistance"]), COLD
    beta = settings.magnet_coefficient
    # Between not at all and as much as the winding do the magnets warm while the motor runs.
    reach = 0.5 * unc.limit("magnets' warming over the winding's", 1.0, 1.0) if beta else 0.5
    return WindingData(
        resistance=resistance,
        reference=reference,
        coefficient=settings.coefficient,
        coefficient_reference=settings.reference_temperature,
        inductance=_inductance(settings, known, whole, unc, tell),
        magnets=reach * unc.limit("magnets' temperature coefficient", beta, abs(beta) * MAGNET_SPREAD),
        start=start,
    )


def _inductance(
    settings: EquivalentResistanceSettings,
    known: Mapping[str, Parameter],
    whole: float,
    unc: Uncertainties,
    tell: Tell,
) -> UncertainReal:
    if settings.winding_inductance is not None:
        return _given(
            "L11 − L12",
            settings.winding_inductance,
            settings.winding_inductance_uncertainty,
            UNSTATED_INDUCTANCE,
            unc,
            tell,
            "winding_inductance_uncertainty",
        )
    d, q = (unc.of_parameter(known[f"{axis}_axis_inductance"]) for axis in "dq")
    return whole * 0.5 * (d + q)


def _given(
    name: str, value: float, half_width: float | None, unstated: float, unc: Uncertainties, tell: Tell, setting: str
) -> UncertainReal:
    if half_width is None:
        half_width = unstated * value
        tell(
            "unstated-uncertainty",
            text(
                "{name} = {value:.4g} was given without its uncertainty and is taken to be known within ±{share:.0%}; state it with "
                "{setting}=…",
                name=name,
                value=value,
                share=unstated,
                setting=setting,
            ),
        )
    return unc.limit(text("{name} given", name=name), value, half_width)
