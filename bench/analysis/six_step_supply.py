"""The equivalent resistance of a table of loads without waveforms, by an EMF constant that was typed."""

import math
from collections.abc import Sequence

import numpy as np
from GTC.lib import UncertainReal

from bench.analysis.outcome import AnalysisOutcome
from bench.analysis.six_step_table import LoadTable
from bench.analysis.six_step_typed import UNSTATED_EMF, TypedEmf, TypedWinding
from bench.captures.written_digits import FloatArray
from drivers.interfaces.text import text
from procedures.core.parameters import PARAMETERS
from procedures.estimation.fitting.misfit import Misfit
from procedures.six_step.load_points import LoadPoint
from procedures.six_step.settings import UNSTATED_RESISTANCE
from procedures.six_step.supplied_loads import NO_WAVEFORM, SuppliedLoads
from procedures.techniques.temperature.correction import MAGNET_SPREAD
from procedures.techniques.temperature.settings import COLD

_RPM = 30.0 / math.pi


def tell_by_supply(
    outcome: AnalysisOutcome,
    loads: LoadTable,
    points: Sequence[LoadPoint],
    warm: Sequence[UncertainReal],
    before: UncertainReal,
    typed: TypedWinding,
    known: TypedEmf,
    pole_pairs: int | None,
) -> None:
    """Tell R_eq with the EMF constant that was typed, or why there is none."""
    constant = known.at_25(pole_pairs)
    if constant is None:
        outcome.withhold(("equivalent_resistance",), "no-waveform", NO_WAVEFORM)
        return
    emf = _at_loads(outcome, constant, warm, before, known)
    if known.uncertainty is None:
        outcome.warn(
            text(
                "the EMF constant was given without its uncertainty and is taken to be known within ±{share:.0%}; state it with "
                "--emf-uncertainty",
                share=UNSTATED_EMF,
            ),
            "unstated-uncertainty",
        )
    outcome.assume(
        text(
            "the bridge commutates within ±{degrees:.2g}° (electrical) of the EMF, and conducts all the time (no chopping); state "
            "--commutation-angle where the sensors lead or lag by more",
            degrees=math.degrees(known.commutation),
        ),
        text(
            "without a waveform of a line's current, R_eq is not split into copper, switches and commutation; it is at the largest current"
        ),
    )
    warmth = np.array([typed.copper_coefficient * (float(t.x) - COLD) for t in warm])
    supplied = SuppliedLoads(points, emf, _least(typed, warm), loads.frequency, pole_pairs, warmth)
    found, judged = supplied.found(outcome.uncertainties)
    kept = judged.kept[-1]
    outcome.tell_misfit(Misfit(tuple(each for each in judged.misfit.findings if each.estimates)))
    outcome.parameter(
        "equivalent_resistance",
        found[kept],
        estimator="bus voltage less EMF over bus current, with the EMF constant as typed",
        convention=PARAMETERS["equivalent_resistance"].convention,
        misfit=judged.misfit.of("equivalent_resistance"),
    )
    outcome.detail(
        points=[
            {
                "row": loads.rows[k],
                "shaft_torque": float(loads.torque[k]),
                "speed_rpm": float(loads.speed[k]) * _RPM,
                "bus_voltage": float(loads.voltage[k]),
                "bus_current": float(loads.current[k]),
                "winding_temperature": float(warm[k].x),
                "equivalent_resistance": float(found[k].x),
                "coverage_interval": list(outcome.uncertainties.interval(found[k])),
                "left_out": k not in judged.kept,
            }
            for k in range(len(points))
        ]
    )


def _at_loads(
    outcome: AnalysisOutcome,
    constant: tuple[float, float],
    warm: Sequence[UncertainReal],
    before: UncertainReal,
    known: TypedEmf,
) -> list[UncertainReal]:
    """Return k_e at each load: magnets warm from the winding's temperature before by between nothing and as much as the winding, and a
    bridge that leads or lags by δ sees cos δ of the EMF.
    """
    unc = outcome.uncertainties
    commutated = 1.0 - unc.one_sided(text("angle of commutation"), 0.0, 1.0 - math.cos(known.commutation))
    cold = unc.limit(text("{name} given", name="k_e"), *constant) * commutated
    beta = known.magnet_coefficient
    magnets = unc.limit("magnets' temperature coefficient", beta, abs(beta) * MAGNET_SPREAD)
    reach = 0.5 * unc.limit("magnets' warming over the winding's", 1.0, 1.0)
    return [cold * (1.0 + magnets * (before - COLD + reach * (each - before))) for each in warm]


def _least(typed: TypedWinding, warm: Sequence[UncertainReal]) -> FloatArray:
    """Return what windings and switches have at least (Ω) at each load: what is between two terminals, 0 where it was not typed."""
    resistance = typed.resistance or 0.0
    resistance -= (
        (UNSTATED_RESISTANCE * resistance) if typed.resistance_uncertainty is None else typed.resistance_uncertainty
    )
    share = 2.0 if typed.connection == "wye" else 2.0 / 3.0
    copper = np.array([1.0 + typed.copper_coefficient * (float(t.x) - typed.reference) for t in warm])
    return max(resistance, 0.0) * share * copper + 2.0 * (typed.switch_resistance or 0.0)
