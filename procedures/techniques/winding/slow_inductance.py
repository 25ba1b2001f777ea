"""A bridge's reading at the test frequency is held against lower frequencies: iron and magnets may hold back part of the field."""

import math
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
#: A difference from this share of the inductance on is told; an interval beyond this share says nothing.
_LEAST, _MOST = 2e-3, 0.25
_RECTANGULAR = 1.0 / math.sqrt(3.0)


@dataclass(frozen=True)
class Slow:
    """Inductance for slow changes over that at the test frequency, and what was seen."""

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
    bridge, lower = procedure.bench.lcr_meter, _LOWER * frequency
    if bridge.read_by_hand or lower <= 2.0 * _LOWEST:
        return UNCHANGED
    readings = [_series(bridge.measure())]
    try:
        for other in (lower, _LOWEST):
            bridge.configure(other, level, aperture)
            readings.append(_series(bridge.measure()))
    except SetpointError:
        # A bridge of few frequencies says nothing here; what it has is measured as before.
        bridge.configure(frequency, level, aperture)
        return UNCHANGED
    bridge.configure(frequency, level, aperture)
    found = second_circuit(readings)
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


def _series(reading: ImpedanceReading) -> SeriesReading:
    by_resistance, by_inductance = reading.resistance_accuracy, reading.inductance_accuracy
    return SeriesReading(
        reading.frequency,
        reading.resistance,
        reading.inductance,
        _RECTANGULAR * (by_resistance.gain * abs(reading.resistance) + by_resistance.offset),
        _RECTANGULAR * (by_inductance.gain * abs(reading.inductance) + by_inductance.offset),
    )
