"""Tables of four-wire readings: the stator resistance from voltage over current, by line or all three (§3.2, erratum E9)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from GTC.lib import UncertainReal

from bench.analysis.applied import AppliedAccuracy
from bench.analysis.outcome import (
    AnalysisOutcome,
    estimated,
    named,
    open_unit,
    paths_of,
    pick,
    refuse_copies,
    refuse_over_range,
)
from bench.analysis.reading_points import reading_factor
from bench.analysis.statements import Statement
from bench.analysis.temperature import Temperature
from bench.captures import WHOLE, Capture, CaptureChannel, CaptureError, CapturePart, ProbeFactor, read_capture
from drivers.interfaces import Accuracy
from drivers.interfaces.text import Translate, english, text
from procedures.estimation.fitting.fit import Fit, FloatArray
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.winding import resistance
from procedures.estimation.winding.connections import Connection
from procedures.estimation.winding.unbalance import largest_deviation
from procedures.techniques.temperature.settings import COLD
from procedures.techniques.winding.four_wire_readings import scattered

_VOLTAGE_WORDS, _CURRENT_WORDS = ("volt", "u", "v"), ("curr", "strom", "i")
#: Lines that differ by more than this are told.
_UNEQUAL = 0.03
#: A winding that warms by more than this (K) while it is read is told.
_WARMER = 1.0
#: Readings of meters of which nothing is stated scatter by less than this share of the largest voltage.
_MOST_SCATTER_UNSTATED = 1e-3
#: A thermal voltage of copper against brass or tin drifts by so much (V) where terminals differ by a few kelvins.
_THERMAL_DRIFT = 10e-6
#: A smaller share of a resistance than copper changes by in a tenth of a kelvin is not told.
_LEAST_TOLD = 4e-4
#: Fewer readings of a line leave the estimator's tests nothing to test.
_COUNTS, _FEW = (1, 3), 8


@dataclass(frozen=True)
class _Line:
    """Readings between the same two points: channels of current and voltage, and the file that they stand in.

    `signed` tells that the currents have the voltages' signs, for the file has amounts only.
    """

    capture: Capture
    current: CaptureChannel
    voltage: CaptureChannel
    signed: bool = False

    @property
    def name(self) -> str:
        """The line as messages name it."""
        return f"{Path(self.capture.source).name}, {self.voltage.name}"


def analyze_four_wire(
    file: str | Path | Sequence[str | Path],
    *,
    connection: Connection = "wye",
    reading: Literal["line", "series-parallel", "phase"] = "line",
    voltage: str | None = None,
    current: str | None = None,
    scale: Mapping[str, float | ProbeFactor] | None = None,
    accuracy: Sequence[Statement] = (),
    selection: CapturePart = WHOLE,
    temperature: Temperature | None = None,
    translate: Translate = english,
) -> dict[str, Any]:
    """Return the stator resistance (leg of the equivalent wye) from four-wire readings of both polarities.

    A file has columns of current and voltage, row by row as they were read; three lines are three files, or three columns of voltage with
    one of current or one each. `reading` is between which points a single line was read; `voltage` and `current` name columns where their
    units do not tell. `accuracy` states the errors of both meters; with `temperature` the resistance is referred to 25 °C by copper's
    coefficient. `translate` gives sentences in the reader's language. Raises CaptureError naming file and line.
    """
    captures = [
        read_capture(path, abscissa="current", selection=selection).scaled(named(scale)) for path in paths_of(file)
    ]
    lines = [_with_signs(line) for capture in captures for line in _lines(capture, voltage, current)]
    if len(lines) not in _COUNTS or (len(lines) > 1 and reading != "line"):
        raise CaptureError(
            ", ".join(capture.source for capture in captures),
            text(
                "{count} lines are there: {names}. Allowed are one, or with --reading line all three of AB, BC and CA",
                count=len(lines),
                names=[line.name for line in lines],
            ),
        )
    refuse_copies([(line.name, np.vstack((line.current.values, line.voltage.values))) for line in lines])
    uses = {
        "voltage": tuple(dict.fromkeys(line.voltage.name for line in lines)),
        "current": tuple(dict.fromkeys(line.current.name for line in lines)),
    }
    applied = AppliedAccuracy(accuracy, uses, captures)
    outcome = AnalysisOutcome("stator_resistance_dc", "3.2", captures[0], applied, translate)
    fits = [_fitted(line, applied) for line in lines]
    quantities = [_quantity(outcome, line, fit) for line, fit in zip(lines, fits, strict=True)]
    misfit = Misfit.together([fit.misfit for fit in fits]).of("resistance", "stator_resistance")
    factor = reading_factor(outcome, captures[0], connection, reading)
    outcome.assume(
        text("voltmeter inside the clamps that carry the current; readings in the order in which they were taken"),
        text("the fit includes thermal voltages and the zeros of both meters, so they do not affect the result"),
    )
    if any(line.signed for line in lines):
        outcome.assume(
            text(
                "the current's meter shows no sign: it is taken from the voltage, since the current was reversed at the motor"
            )
        )
    mean = sum(quantities[1:], quantities[0]) / len(quantities)
    if len(lines) > 1:
        _compare(outcome, captures[0], lines, quantities, connection)
    elif reading == "line":
        outcome.assume(text("the three lines are taken as equal; read all three to see whether they are"))
    found, convention = _referred(outcome, mean, temperature)
    outcome.parameter(
        "stator_resistance",
        factor.y_equivalent * found,
        estimator="slope of four-wire voltage over current, both polarities",
        convention=convention,
        winding=factor.winding * float(found.x) if connection == "delta" else None,
        misfit=misfit,
    )
    _tell_warming(outcome, lines)
    _tell_hidden_drift(outcome, lines, fits)
    fewest = min(line.current.values.size for line in lines)
    if fewest < _FEW:
        outcome.warn(
            text(
                "{count} readings of a line do not show a contact that changes with the current, or a single wrong reading: take four "
                "currents or more, each with both polarities",
                count=fewest,
            ),
            "few-readings",
        )
    elif min(resistance.count_of_levels(line.current.values) for line in lines) < 3:
        outcome.warn(
            text(
                "two amounts of current do not tell a contact that changes with the current, or a range that reads differently, from "
                "the zero of the current's meter: the interval holds both; take four currents or more, each with both polarities"
            ),
            "few-readings",
        )
    outcome.detail(
        lines={line.name: _detail(fit) for line, fit in zip(lines, fits, strict=True)},
        residual_rms=[fit.residual_rms for fit in fits],
    )
    return outcome.as_dict()


def _lines(capture: Capture, voltage: str | None, current: str | None) -> list[_Line]:
    """Return the lines of a file: each voltage with the only current, or with the current in its own place."""
    currents = [channel for channel in capture.channels if channel.unit == "A"]
    voltages = [channel for channel in capture.channels if channel.unit == "V"]
    if current is not None or not currents:
        currents = [_pick(capture, current, "current")]
    if voltage is not None or not voltages:
        others = replace(
            capture, channels=tuple(c for c in capture.channels if all(c is not taken for taken in currents))
        )
        voltages = [_pick(others if len(others.channels) else capture, voltage, "voltage")]
    if len(currents) == 1:
        currents *= len(voltages)
    if len(currents) != len(voltages):
        raise CaptureError(
            capture.source,
            text(
                "{currents} columns of current and {voltages} of voltage: give one current for all, or one for each voltage, or name two "
                "columns with --current and --voltage",
                currents=len(currents),
                voltages=len(voltages),
            ),
        )
    return [
        _Line(capture, refuse_over_range(capture, amperes), refuse_over_range(capture, volts))
        for amperes, volts in zip(currents, voltages, strict=True)
    ]


def _with_signs(line: _Line) -> _Line:
    """Return a line whose currents have the voltages' signs where the file has amounts: a supply shows none, its leads were exchanged."""
    i, v = line.current.values, line.voltage.values
    if np.any(i < 0.0) or not v.min() < 0.0 < v.max():
        return line
    return replace(line, current=replace(line.current, values=np.copysign(i, v)), signed=True)


def _pick(capture: Capture, wanted: str | None, what: Literal["voltage", "current"]) -> CaptureChannel:
    """Return a column. Raises CaptureError where it states no unit: mV and mA are as usual as V and A."""
    unit, words = {"voltage": ("V", _VOLTAGE_WORDS), "current": ("A", _CURRENT_WORDS)}[what]
    channel = pick(capture, wanted, (unit,), what, words, f"--{what}")
    if not channel.unit:
        raise open_unit(capture, channel.name, what, (unit, f"m{unit}"))
    return channel


def _fitted(line: _Line, applied: AppliedAccuracy) -> Fit:
    """Return the fit of a line, with what a contact or a range may do that makes its readings scatter: more of them do not average that
    out.
    """
    fit = estimated(line.capture, lambda: resistance.slope(line.voltage.values, line.current.values))
    scatter = _scatter(line, fit, applied)
    if not scatter:
        return fit
    covariance = fit.covariance.copy()
    covariance[0, 0] += (fit.residual_rms / float(np.std(np.abs(line.current.values)))) ** 2
    return replace(fit, covariance=covariance, misfit=Misfit.together((fit.misfit, scatter)))


def _quantity(outcome: AnalysisOutcome, line: _Line, fit: Fit) -> UncertainReal:
    found = outcome.estimate(text("slope of V over I, {pair}", pair=line.name), fit, "resistance")
    found = outcome.with_errors(found, "voltage", line.voltage.name, gain=1.0)
    return outcome.with_errors(found, "current", line.current.name, gain=-1.0)


def _scatter(line: _Line, fit: Fit, applied: AppliedAccuracy) -> Misfit:
    """Return that readings scatter more than the meters explain, or where nothing is stated of them, too much for any figure."""
    limits = [
        Accuracy(gain=applied.gain(kind, each.name), offset=applied.offset(kind, each.name), resolution=each.resolution)
        for kind, each in (("current", line.current), ("voltage", line.voltage))
    ]
    found = scattered(fit, line.current.values, (limits[0], limits[1]))
    if applied.stated or found.withholding("resistance"):
        return found
    return Misfit(
        tuple(
            replace(each, figures={**each.figures, "record": "four-wire-unstated"})
            for each in found.findings
            if float(each.figures["scatter"]) > _MOST_SCATTER_UNSTATED
        )
    )


def _compare(
    outcome: AnalysisOutcome,
    capture: Capture,
    lines: Sequence[_Line],
    quantities: Sequence[UncertainReal],
    connection: Connection,
) -> None:
    """Say how far the lines differ; raises CaptureError for lines that no winding has."""
    ab, bc, ca = quantities
    phases = estimated(capture, lambda: resistance.phase_resistances(ab, bc, ca, connection))
    farthest = largest_deviation(quantities)
    share = float(farthest.share.x)
    outcome.detail(phase_resistances=[float(phase.x) for phase in phases], largest_deviation=share)
    outcome.assume(text("the lines are AB, BC and CA in the order in which they are given"))
    if share > _UNEQUAL:
        outcome.warn(
            text(
                "{line} differs from the mean of the three lines by {share:.1%}: unequal windings, a bad joint or contact, or a reading "
                "of another line; read that line again",
                line=lines[farthest.place].name,
                share=share,
            ),
            "unequal-phases",
        )


def _referred(
    outcome: AnalysisOutcome, found: UncertainReal, temperature: Temperature | None
) -> tuple[UncertainReal, str]:
    """Return a resistance at 25 °C where the temperature is known, and its convention."""
    if temperature is None:
        outcome.assume(
            text(
                "resistance at the temperature of the readings. That temperature is not given, so the value is not referred to 25 °C"
            )
        )
        return found, "y_equivalent"
    known = outcome.uncertainties.limit("winding temperature", temperature.celsius, temperature.half_width)
    outcome.detail(winding_temperature=temperature.celsius, resistance_as_read=float(found.x))
    outcome.assume(
        text(
            "winding at {celsius:g} °C ± {half_width:g} K, copper with {coefficient:g} 1/K at 20 °C: resistance referred to 25 °C",
            celsius=temperature.celsius,
            half_width=temperature.half_width,
            coefficient=temperature.coefficient,
        )
    )
    cold = resistance.at_temperature(found, known, COLD, temperature.coefficient, resistance.COPPER_REFERENCE)
    return cold, "y_equivalent, at 25 °C"


def _tell_warming(outcome: AnalysisOutcome, lines: Sequence[_Line]) -> None:
    """Say by how much the winding warmed while one line was read, where the files have times."""
    for line in lines:
        time = line.capture.time
        if time is None:
            return
        fit = _drift(line, time)
        kelvin = float(np.ptp(time)) / resistance.COPPER
        warmer = fit.value("drift") * kelvin
        if abs(warmer) > max(_WARMER, 3.0 * fit.uncertainty("drift") * kelvin):
            outcome.warn(
                text(
                    "the winding's temperature changed by about {warmer:+.1f} K during the measurement; let it cool, use less "
                    "current, and repeat",
                    warmer=warmer,
                ),
                "heating",
            )
            return


def _drift(line: _Line, time: FloatArray) -> Fit:
    block = time, line.current.values, line.voltage.values
    return estimated(line.capture, lambda: resistance.drift([block]))


def _tell_hidden_drift(outcome: AnalysisOutcome, lines: Sequence[_Line], fits: Sequence[Fit]) -> None:
    """Say where the currents only rise or only fall from reading to reading, and a thermal voltage's usual drift matters."""
    hidden = [
        share
        for line, fit in zip(lines, fits, strict=True)
        if (share := resistance.hidden_drift(line.current.values) * _THERMAL_DRIFT / fit.value("resistance"))
        > max(fit.uncertainty("resistance") / fit.value("resistance"), _LEAST_TOLD)
    ]
    if hidden:
        outcome.warn(
            text(
                "the readings stand in the order of their currents, so a thermal voltage that drifts by 10 µV meanwhile would change the "
                "resistance by {share:.2g} %, and nothing would show it: change the polarity from reading to reading",
                share=100.0 * max(hidden),
            ),
            "drift-hidden",
        )


def _detail(fit: Fit) -> dict[str, float]:
    return {"resistance": fit.value("resistance"), "u": fit.uncertainty("resistance"), "offset": fit.value("offset")}
