"""The equivalent resistance of a table of loads without waveforms, by an EMF constant that was typed."""

import math
from collections.abc import Sequence
from dataclasses import replace

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
#: A voltage that falls by less than this from the least to the largest current, which is so much of the largest apart, is regulated.
_FALLS, _GROWN = 2e-3, 0.2
#: What is typed of leads is known within so much of it.
_LEADS, _LEADS_KNOWN = text("resistance of the leads as typed"), 0.2
_AT_SUPPLY = text(
    "the voltage does not fall as the current grows, as a supply shows it at its own terminals: the leads to the drive would count as the "
    "motor's resistance. Type --lead-resistance, that of both leads between voltmeter and drive (V over A along them), or "
    "--lead-resistance 0 where the voltage was read at the drive's own terminals"
)


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
    if known.leads is None and _constant_voltage(loads):
        outcome.withhold(("equivalent_resistance",), "voltage-at-supply", _AT_SUPPLY)
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
    if known.leads:
        points = [_behind_leads(point, known.leads) for point in points]
    else:
        outcome.assume(
            text(
                "the voltage is read at the drive's own terminals: leads between count as its resistance (--lead-resistance)"
            )
        )
    warmth = np.array([typed.copper_coefficient * (float(t.x) - COLD) for t in warm])
    supplied = SuppliedLoads(points, emf, _least(typed, warm), loads.frequency, pole_pairs, warmth)
    found, judged = supplied.found(outcome.uncertainties)
    if known.leads:
        error = outcome.uncertainties.limit(_LEADS, 0.0, _LEADS_KNOWN * known.leads)
        found = [each + error for each in found]
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


def _constant_voltage(loads: LoadTable) -> bool:
    """Tell whether the voltage does not fall as the current grows: as a supply shows it that regulates it, where its sense lines are."""
    grown = float(np.ptp(loads.current))
    if grown < _GROWN * float(loads.current.max()):
        return False
    # The median of all pairs' slopes: one row that is mistyped does not decide.
    first, then = np.triu_indices(loads.current.size, 1)
    apart = loads.current[then] - loads.current[first] > 0.0
    slopes = (loads.voltage[then] - loads.voltage[first])[apart] / (loads.current[then] - loads.current[first])[apart]
    fall = -float(np.median(slopes)) * grown
    return fall < _FALLS * float(loads.voltage.mean())


def _behind_leads(point: LoadPoint, leads: float) -> LoadPoint:
    """Return a load whose voltage is that behind leads (Ω)."""
    read = point.bus_voltage
    behind = replace(read.reading, value=read.value - leads * point.bus_current.value)
    return replace(point, bus_voltage=replace(read, reading=behind))


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
