"""What lies between the voltmeter of a table of loads and the drive's own terminals."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.analysis.outcome import AnalysisOutcome
from bench.analysis.six_step_table import LoadTable
from drivers.interfaces.text import text
from procedures.six_step.load_points import LoadPoint

#: A voltage that falls by less than this from the least to the largest current, which is so much of the largest apart, is regulated.
_FALLS, _GROWN = 2e-3, 0.2
#: What is typed of leads is known within so much of it.
_LEADS_KNOWN = 0.2
_AT_SUPPLY = text(
    "the voltage does not fall as the current grows, as a supply shows it at its own terminals: the leads to the drive would count as the "
    "motor's resistance. Type --lead-resistance, that of both leads between voltmeter and drive (V over A along them), or "
    "--lead-resistance 0 where the voltage was read at the drive's own terminals"
)


def at_the_drive(
    outcome: AnalysisOutcome, loads: LoadTable, points: Sequence[LoadPoint], leads: float | None, given: Sequence[str]
) -> list[LoadPoint]:
    """Return the loads with the voltages at the drive's own terminals, behind leads (Ω) that were typed, None where nobody says.

    Where nobody does and the voltage looks like a supply's, what is `given` with the leads in it is withheld.
    """
    if leads is None and _constant_voltage(loads):
        outcome.withhold(given, "voltage-at-supply", _AT_SUPPLY)
    elif not leads:
        outcome.assume(
            text(
                "the voltage is read at the drive's own terminals: leads between count as its resistance (--lead-resistance)"
            )
        )
    return [_behind_leads(point, leads) for point in points] if leads else list(points)


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
    fallen = leads * point.bus_current.value
    # Known within a share, the fall is off at each load by as much of itself.
    accuracy = replace(read.accuracy, offset=read.accuracy.offset + _LEADS_KNOWN * fallen)
    behind = replace(read.reading, value=read.value - fallen, accuracy=accuracy)
    return replace(point, bus_voltage=replace(read, reading=behind))
