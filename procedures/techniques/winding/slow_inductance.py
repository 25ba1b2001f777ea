"""A bridge's reading at the test frequency is held against other frequencies: iron and magnets may hold back part of the field."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from GTC import ureal
from GTC.lib import UncertainReal

from drivers.interfaces import Aperture, ImpedanceReading, MeasurementError, SetpointError
from drivers.interfaces.text import text
from procedures.core.actions import Connect
from procedures.core.procedure import Procedure
from procedures.estimation.fitting.intervals import Interval
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.winding.second_circuit import SeriesReading, hidden_share, second_circuit
from procedures.verification.two_poles import poles_of

#: Lower frequencies over the test frequency, off the mains' where that is 1 kHz, and the lowest (Hz), which tells the resistance.
_LOWER, _LOWEST = (0.25, 0.09, 0.04), 20.0
#: The higher frequencies for the resistance, over the test frequency.
_HIGHER = (4.0, 2.0)
#: Time constants (s) of circuits up to which the intervals hold: those of iron and magnets, and any that the bridge tells from none.
_IRON, _ANY = 5e-3, 0.03
#: A difference from this share of the inductance on is told; an interval beyond this share says nothing.
_LEAST, _MOST = 2e-3, 0.25
#: Circuits so much slower than the winding are assumed where the lowest frequency finds so much more resistance than direct current does.
_SLOWER, _WARMER = 4.0, 0.008
#: A rotor some degrees off its axis couples the loop of two joined lines by no more than this k².
_OF_LOOP = 0.03
#: What circuits that are not seen may hide is told from this share on.
_TOLD = 0.1
_RECTANGULAR = 1.0 / math.sqrt(3.0)
#: One fast circuit lies at an end of what any number of them allows: 95 % of a rectangular distribution are to reach beyond it.
_TO_THE_ENDS = 1.1
_HIDDEN = text("closed circuits that the bridge's limits of error hide")


@dataclass(frozen=True)
class Slow:
    """Inductance, or resistance, for slow changes over that at the test frequency, and what was seen.

    `most` is the largest share of a resistance that is not the winding's, by `unlike` it differs between lines. `hidden` is the share by
    which an inductance may be larger for circuits that the bridge's limits of error hide; `ratio` holds it, in that direction. `direct`
    says that a direct current's resistance bounded circuits slower than the winding, too.
    """

    ratio: UncertainReal
    misfit: Misfit = NO_MISFIT
    most: float = 0.0
    unlike: float = 0.0
    hidden: float = 0.0
    direct: bool = False

    def at_frequency(self) -> "Slow":
        """Return what is so of the inductance at the test frequency itself: circuits are told, and take nothing of it."""
        said = tuple(
            replace(finding, answer=Answer.SAID, figures={**finding.figures, "record": "bridge-frequency"})
            for finding in self.misfit.findings
        )
        return Slow(UNCHANGED.ratio, Misfit(said), hidden=self.hidden)


#: Where nothing was read at other frequencies.
UNCHANGED = Slow(ureal(1.0, 0.0))


def or_of_joined_lines(slow: Slow, procedure: Procedure[Any]) -> Slow:
    """Return what a circuit says where two lines are joined and their loop is not known: a rotor that friction holds off its axis couples
    it. The inductance wanted is then that at the test frequency: of a small circuit the interval spans both.
    """
    small = [f for f in slow.misfit.findings if float(f.figures["coupling"]) < _OF_LOOP]
    if not small or any(f.answer is Answer.WITHHELD for f in slow.misfit.findings):
        return slow
    reach = math.sqrt(3.0) * float(slow.ratio.u)
    low, high = min(1.0, float(slow.ratio.x) - reach), max(1.0, float(slow.ratio.x) + reach)
    ratio = procedure.bench.uncertainties.limit(
        text("a second circuit, or the loop of the joined lines"),
        (low + high) / 2.0,
        _TO_THE_ENDS * (high - low) / 2.0,
    )
    return replace(slow, ratio=ratio, misfit=Misfit(tuple(replace(f, answer=Answer.WIDENED) for f in small)))


def slow_inductance(
    procedure: Procedure[Any],
    connection: Connect,
    frequency: float,
    level: float,
    aperture: Aperture,
    parameters: tuple[str, ...],
) -> Slow:
    """Read what is connected, at rest, at the test frequency (Hz) and below, and leave the bridge as it was.

    A person who types every reading is not asked for more.
    """
    return shown_by(procedure, connection, lower_readings(procedure, frequency, level, aperture), parameters)


def lower_readings(
    procedure: Procedure[Any], frequency: float, level: float, aperture: Aperture
) -> tuple[SeriesReading, ...]:
    """Return readings of what is connected at the test frequency (Hz) and below; none where the bridge gives none."""
    lower = [share * frequency for share in _LOWER if share * frequency >= 2.0 * _LOWEST]
    return _read(procedure, frequency, (*lower, _LOWEST), level, aperture) if lower else ()


def shown_by(
    procedure: Procedure[Any],
    connection: Connect,
    readings: Sequence[SeriesReading],
    parameters: tuple[str, ...],
) -> Slow:
    """Return what readings at the test frequency and below, none or as `lower_readings` gives them, show of closed circuits."""
    if not readings:
        return UNCHANGED
    found = second_circuit(readings, _IRON)
    if found is None:
        direct = procedure.bench.state.lines.direct(poles_of(connection))
        hidden = _hidden(readings, direct)
        ratio = procedure.bench.uncertainties.one_sided(_HIDDEN, 1.0, hidden)
        return Slow(ratio, hidden=hidden, direct=direct is not None)
    at_frequency = readings[0].inductance
    held = found.inductance or Interval(0.0, 2.0 * at_frequency)
    inductance, half_width = (held.low + held.high) / 2.0, _TO_THE_ENDS * (held.high - held.low) / 2.0
    answer = Answer.WITHHELD if half_width > _MOST * inductance else Answer.MODELLED
    figures: dict[str, float | str] = {
        "record": "bridge",
        "time_constant": found.time_constant,
        "coupling": found.coupling,
        "frequency": readings[0].frequency,
        "lowest": _LOWEST,
        "rise": readings[0].resistance / readings[-1].resistance - 1.0,
        "more": inductance / at_frequency - 1.0,
    }
    finding = Finding(Cause.SECOND_TIME_CONSTANT, answer, parameters, found.score, figures)
    ratio = procedure.bench.uncertainties.limit(
        text("a second circuit beside the winding"), inductance / at_frequency, half_width / at_frequency
    )
    # What is too little to be told, as a skin effect in the wire leaves it, is in the interval all the same.
    told = answer is Answer.WITHHELD or inductance - at_frequency > _LEAST * at_frequency
    return Slow(ratio, Misfit((finding,)) if told else NO_MISFIT)


def _hidden(readings: Sequence[SeriesReading], direct: Interval | None) -> float:
    """Return by which share an inductance may be larger for circuits that are not seen, beside a known resistance (Ω) or none.

    A circuit slower than the winding needs more copper than the winding has. It is assumed where even the lowest frequency finds more
    resistance than direct current and a winding a little warmer.
    """
    inductance, lowest = readings[0].inductance, readings[-1]
    if direct is None:
        return hidden_share(readings, max(_IRON, inductance / lowest.resistance))
    own, least_read = inductance / direct.high, lowest.resistance - lowest.u_resistance / _RECTANGULAR
    slowest = _SLOWER * own if least_read > (1.0 + _WARMER) * direct.high else own
    return hidden_share(readings, max(_IRON, slowest), direct.low)


def tell_meant(procedure: Procedure[Any], axes: Sequence[Slow], frequency: float, *, at_frequency: bool) -> None:
    """Record which inductance is meant, that at a frequency (Hz) or that for slow changes, and up to which share of it closed circuits
    would be hidden; say so where that is much of what is meant.
    """
    share = max((axis.hidden for axis in axes), default=0.0)
    procedure.findings |= {"inductance_at": frequency if at_frequency else 0.0, "hidden_circuits": share}
    if not at_frequency and not all(axis.direct for axis in axes):
        procedure.notice(
            "slow-circuits-unseen",
            text(
                "closed circuits slower than the winding itself, as a thick sleeve or a damper cage, are not seen, and the inductance for "
                "slow changes does not include them. stator-resistance-dc earlier in the same run bounds them"
            ),
        )
    if share > _TOLD and not at_frequency:
        procedure.notice(
            "hidden-circuits",
            text(
                "the bridge's limits of error hide closed circuits here (solid magnets or iron, a shorted turn): for slow changes the "
                "inductance may be larger than at {frequency:g} Hz, by up to {share:.0%}, and its interval "
                "reaches so far. stator-resistance-dc in the same run narrows it, dq-inductance-time-constant shows such circuits; "
                "leave at_frequency out if the inductance at {frequency:g} Hz is meant",
                frequency=frequency,
                share=share,
            ),
        )


def slow_resistance(
    procedure: Procedure[Any],
    frequency: float,
    level: float,
    aperture: Aperture,
    parameters: tuple[str, ...],
    others: Sequence[float],
) -> Slow:
    """Read the line that is connected at the test frequency (Hz) and above, and leave the bridge as it was: losses add to a resistance.

    `others` are the inductances (H) of all lines at the test frequency, which losses may follow. A person who types every reading is
    not asked for more.
    """
    higher = [times * frequency for times in _HIGHER]
    read = _read(procedure, frequency, higher, level, aperture)
    # The lowest frequency comes last.
    readings = (*read[1:], *read[:1])
    found = second_circuit(readings, _ANY) if readings else None
    if found is None:
        return UNCHANGED
    last = readings[-1]
    held = found.resistance or Interval(0.0, 2.0 * last.resistance)
    # Losses of the other lines may be to this one's as their inductances are.
    others = [one for one in others if math.isfinite(one)] or [last.inductance]
    line = sum(others) / len(others) / last.inductance
    low = max(0.0, min(1.0, line) * (1.0 - held.high / last.resistance))
    high = max(1.0, line) * (1.0 - held.low / last.resistance)
    more, half_width = (low + high) / 2.0, _TO_THE_ENDS * (high - low) / 2.0
    answer = Answer.WITHHELD if half_width > _MOST else Answer.MODELLED
    figures: dict[str, float | str] = {
        "record": "bridge-resistance",
        "frequency": frequency,
        "highest": higher[0],
        "rise": readings[0].resistance / last.resistance - 1.0,
        "least": low,
        "most": high,
    }
    finding = Finding(Cause.SECOND_TIME_CONSTANT, answer, parameters, found.score, figures)
    ratio = procedure.bench.uncertainties.limit(text("a second circuit beside the winding"), 1.0 - more, half_width)
    misfit = Misfit((finding,)) if high > _LEAST else NO_MISFIT
    return Slow(ratio, misfit, high, high * (max(others) - min(others)) / max(others))


def _read(
    procedure: Procedure[Any], frequency: float, others: Sequence[float], level: float, aperture: Aperture
) -> tuple[SeriesReading, ...]:
    """Return what is connected at the test frequency and the others (Hz), none where the bridge does not tell them or is read by hand."""
    bridge = procedure.bench.lcr_meter
    if bridge.read_by_hand:
        return ()
    readings = [_series(bridge.measure())]
    try:
        for other in others:
            bridge.configure(other, level, aperture)
            readings.append(_series(bridge.measure()))
    except (SetpointError, MeasurementError):
        # A bridge of few frequencies says nothing here; what it has is measured as before.
        readings.clear()
    bridge.configure(frequency, level, aperture)
    # Nor does one that gives a direct current's resistance only, or states no accuracy.
    known = all(
        math.isfinite(r.resistance + r.inductance) and min(r.u_resistance, r.u_inductance) > 0.0 for r in readings
    )
    return tuple(readings) if known else ()


def _series(reading: ImpedanceReading) -> SeriesReading:
    by_resistance, by_inductance = reading.resistance_accuracy, reading.inductance_accuracy
    return SeriesReading(
        reading.frequency,
        reading.resistance,
        reading.inductance,
        _RECTANGULAR * (by_resistance.gain * abs(reading.resistance) + by_resistance.offset),
        _RECTANGULAR * (by_inductance.gain * abs(reading.inductance) + by_inductance.offset),
    )
