"""The first line once more at the end, and all of them where one has changed: what follows for the resistance."""

from collections.abc import Callable, Mapping
from typing import Any

from GTC.lib import UncertainReal

from procedures.core.actions import LINE_PAIRS, LinePair, label_of
from procedures.core.events import MayBeAsked
from procedures.core.procedure import Procedure
from procedures.estimation.winding.closing import ReadAgain, Unsettled, unsettled


def closed(
    procedure: Procedure[Any],
    again: Callable[[LinePair], ReadAgain],
    parameter: str = "stator_resistance",
    suspected: LinePair = LINE_PAIRS[0],
) -> Unsettled:
    """Return what reading the first line again shows, and one that is `suspected`; where one has changed beyond chance the others are read
    again, too. It is said of a `parameter`.

    Warmth of the current changes all lines alike, contacts do not: what may be either shows in the others.
    """
    first, *others = sorted(LINE_PAIRS, key=lambda pair: (pair != LINE_PAIRS[0], pair != suspected))
    read = {first: again(first)}
    record = procedure.bench.recorder.record
    # Which it will be nobody knows before: a rehearsal must not list those that its own readings led to.
    record(MayBeAsked(lines=[label_of(pair) for pair in LINE_PAIRS[1:]]))
    for pair in others:
        if suspected in read and not any(line.changed for line in read.values()):
            break
        read[pair] = again(pair)
    record(MayBeAsked(lines=()))
    procedure.findings["read_again"] = _rows(read)
    return unsettled(tuple(read.values()), parameter)


def _rows(read: Mapping[LinePair, ReadAgain]) -> dict[str, dict[str, float]]:
    return {
        f"{high.value}{low.value}": {"change": r.change, "uncertainty": r.uncertainty, "seconds": r.seconds}
        for (high, low), r in read.items()
    }


def allowed_for(
    procedure: Procedure[Any], found: Unsettled, temperature: UncertainReal, coefficient: float, reference: float
) -> tuple[UncertainReal, UncertainReal | float]:
    """Return the winding's temperature (°C) with the warmth that was found, and by which factor contacts make the readings too large.

    `coefficient` (1/K) holds at `reference` (°C).
    """
    bench = procedure.bench
    if not found.excess:
        return temperature, 1.0
    if not found.warm:
        return temperature, 1.0 - bench.uncertainties.one_sided("contacts", 0.0, found.excess)
    kelvin = found.excess * (1.0 / coefficient + float(temperature.x) - reference)
    return temperature + bench.thermometer.hides(kelvin, bench.clock.now()), 1.0
