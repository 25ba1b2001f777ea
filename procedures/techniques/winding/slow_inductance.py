"""A bridge's reading at the test frequency is held against other frequencies: iron and magnets may hold back part of the field."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from GTC import ureal
from GTC.lib import UncertainReal

from drivers.interfaces import Aperture, ImpedanceReading, SetpointError
from drivers.interfaces.text import text
from procedures.core.procedure import Procedure
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.winding.second_circuit import SeriesReading, second_circuit

#: The lower frequency for the inductance, over the test frequency, and the one for the resistance (Hz).
_LOWER, _LOWEST = 0.25, 20.0
#: Multiples of the resistance's test frequency: what follows for slow changes depends little on how losses grow this near.
_HIGHER = (4.0, 2.0)
#: A difference from this share of the inductance on is told; an interval beyond this share says nothing.
_LEAST, _MOST = 2e-3, 0.25
_RECTANGULAR = 1.0 / math.sqrt(3.0)


@dataclass(frozen=True)
class Slow:
    """Inductance, or resistance, for slow changes over that at the test frequency, and what was seen."""

    ratio: UncertainReal
    misfit: Misfit = NO_MISFIT


#: Where nothing was read at other frequencies.
UNCHANGED = Slow(ureal(1.0, 0.0))


def slow_inductance(
    procedure: Procedure[Any], frequency: float, level: float, aperture: Aperture, parameters: tuple[str, ...]
) -> Slow:
    """Read what is connected, at rest, at three frequencies (Hz), and leave the bridge as it was.

    A person who types every reading is not asked for more.
    """
    lower = _LOWER * frequency
    if lower <= 2.0 * _LOWEST:
        return UNCHANGED
    readings = _readings(procedure, (frequency, lower, _LOWEST), level, aperture, frequency)
    found = second_circuit(readings) if readings else None
    if found is None:
        return UNCHANGED
    at_frequency = readings[0].inductance
    answer = Answer.WITHHELD if found.half_width > _MOST * found.inductance else Answer.MODELLED
    figures: dict[str, float | str] = {
        "record": "bridge",
        "time_constant": found.time_constant,
        "coupling": found.coupling,
        "frequency": frequency,
        "lowest": _LOWEST,
        "rise": readings[0].resistance / readings[-1].resistance - 1.0,
        "more": found.inductance / at_frequency - 1.0,
    }
    finding = Finding(Cause.SECOND_TIME_CONSTANT, answer, parameters, found.score, figures)
    ratio = procedure.bench.uncertainties.limit(
        text("a second circuit beside the winding"), found.inductance / at_frequency, found.half_width / at_frequency
    )
    # What is too little to be told, as a skin effect in the wire leaves it, is in the interval all the same.
    told = answer is Answer.WITHHELD or found.inductance - at_frequency > _LEAST * at_frequency
    return Slow(ratio, Misfit((finding,)) if told else NO_MISFIT)


def slow_resistance(
    procedure: Procedure[Any], frequency: float, level: float, aperture: Aperture, parameters: tuple[str, ...]
) -> Slow:
    """Read what is connected at the test frequency (Hz) and its multiples, and leave the bridge as it was: what iron takes is resistance to
    the bridge.

    A person who types every reading is not asked for more.
    """
    higher = tuple(times * frequency for times in _HIGHER)
    readings = _readings(procedure, (*higher, frequency), level, aperture, frequency)
    found = second_circuit(readings) if readings else None
    if found is None:
        return UNCHANGED
    read = readings[-1].resistance
    figures: dict[str, float | str] = {
        "record": "bridge-resistance",
        "frequency": frequency,
        "highest": higher[0],
        "rise": readings[0].resistance / read - 1.0,
        "more": 1.0 - found.resistance / read,
    }
    finding = Finding(Cause.SECOND_TIME_CONSTANT, Answer.MODELLED, parameters, found.score, figures)
    ratio = procedure.bench.uncertainties.limit(
        text("a second circuit beside the winding"), found.resistance / read, found.resistance_half_width / read
    )
    return Slow(ratio, Misfit((finding,)) if read - found.resistance > _LEAST * read else NO_MISFIT)


def _readings(
    procedure: Procedure[Any], frequencies: Sequence[float], level: float, aperture: Aperture, test: float
) -> list[SeriesReading]:
    """Return what is connected at each of the frequencies (Hz), none where the bridge lacks one; it is left at that of the test."""
    bridge = procedure.bench.lcr_meter
    if bridge.read_by_hand:
        return []
    found = []
    try:
        for frequency in frequencies:
            bridge.configure(frequency, level, aperture)
            found.append(_series(bridge.measure()))
    except SetpointError:
        # A bridge of few frequencies says nothing here; what it has is measured as before.
        found = []
    bridge.configure(test, level, aperture)
    return found


def _series(reading: ImpedanceReading) -> SeriesReading:
    by_resistance, by_inductance = reading.resistance_accuracy, reading.inductance_accuracy
    return SeriesReading(
        reading.frequency,
        reading.resistance,
        reading.inductance,
        _RECTANGULAR * (by_resistance.gain * abs(reading.resistance) + by_resistance.offset),
        _RECTANGULAR * (by_inductance.gain * abs(reading.inductance) + by_inductance.offset),
    )
