"""Tables of a six-step drive's load points: the equivalent resistance, and with a waveform of each load all that the procedure gives."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.analysis.applied import AppliedAccuracy
from bench.analysis.outcome import AnalysisOutcome, named, pick, refuse_copies
from bench.analysis.outcome_teller import OutcomeTeller
from bench.analysis.six_step_leads import at_the_drive
from bench.analysis.six_step_supply import tell_by_supply
from bench.analysis.six_step_table import LoadTable, load_table
from bench.analysis.six_step_typed import TypedEmf, TypedWinding
from bench.analysis.statements import Statement
from bench.captures import WHOLE, Capture, CaptureChannel, CapturePart, ProbeFactor, read_capture
from bench.captures.written_digits import FloatArray, last_digit
from bench.i18n.errors import InputError, UsageError, at
from drivers.interfaces import Accuracy, Reading
from drivers.interfaces.text import Translate, english, text, text_of
from procedures.core.bench import ProcedureError
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.fitting.fit import EstimationError
from procedures.six_step.figures import SixStepFigures
from procedures.six_step.line_record import separated_line
from procedures.six_step.load_points import Averaged, LoadPoint, LoadPoints
from procedures.six_step.winding_data import winding_data
from procedures.techniques.temperature.settings import COLD

_PROCEDURE, _SECTION = "equivalent-resistance", "paper"
#: A single reading of a meter on a running bench repeats within so much (standard deviation, relative); a tachometer's within the second.
_REPEATS, _SPEED_REPEATS = 1e-3, 3e-4
_RPM = 30.0 / math.pi
#: Fewer loads show no single wrong row.
_FEW = 4


def analyze_six_step_loads(
    table: Path,
    waves: Sequence[Path] = (),
    *,
    mapped: Sequence[str] = (),
    pole_pairs: int | None = None,
    electrical: bool = False,
    winding: TypedWinding | None = None,
    emf: TypedEmf | None = None,
    temperature: float | None = None,
    temperature_after: float | None = None,
    temperature_uncertainty: float = 2.0,
    current: str | None = None,
    scale: Mapping[str, float | ProbeFactor] | None = None,
    accuracy: Sequence[Statement] = (),
    selection: CapturePart = WHOLE,
    translate: Translate = english,
) -> dict[str, Any]:
    """Return the armature equivalent resistance of a table of loads; with `waves`, a capture of one line's current for each row in the
    table's order, also its parts, the EMF constant and R_t.

    `current` names the captures' channel, `mapped` headings of the table as NAME=HEADING. `accuracy` states the errors of voltage, current,
    speed and torque, and of the captures' channel. Raises InputError for what cannot be used, UsageError for what is open and not typed.
    """
    typed, known = winding or TypedWinding(), emf or TypedEmf()
    loads = load_table(
        table,
        mapped,
        electrical=electrical,
        pole_pairs=pole_pairs,
        before=temperature,
        after=temperature_after,
    )
    records = _records(loads, waves, current, named(scale), selection)
    read = Capture(
        tuple(
            CaptureChannel(name, unit, values)
            for name, unit, values in (
                ("voltage", "V", loads.voltage),
                ("current", "A", loads.current),
                ("speed", "rad/s", loads.speed),
                ("torque", "N·m", loads.torque),
            )
        ),
        None,
        str(table),
        "table of load points",
        loads.assumptions,
    )
    uses: dict[str, tuple[str, ...]] = {
        "voltage": ("voltage",),
        "current": ("current",),
        "speed": ("speed",),
        "torque": ("torque",),
    }
    if records:
        uses["current"] = ("current", *dict.fromkeys(channel.name for _, channel in records))
    applied = AppliedAccuracy(_by_instrument(accuracy, uses["current"][1:]), uses, [read, *(c for c, _ in records)])
    # The rounding of every reading is among its own errors, and the torque's is in none of the figures.
    outcome = AnalysisOutcome(_PROCEDURE, _SECTION, replace(read, channels=()), applied, translate)
    outcome.assume(
        text(
            "one reading of each meter a load: each is taken to repeat within {volts:.1%} (standard deviation), speeds within {speed:.2%}",
            volts=_REPEATS,
            speed=_SPEED_REPEATS,
        )
    )
    thermometer = outcome.uncertainties.limit("thermometer", 0.0, temperature_uncertainty)
    course = outcome.uncertainties.limit("course of the winding's temperature between its readings", 0.0, 1.0)
    warm = tuple(
        float(t) + thermometer + float(b) * course for t, b in zip(loads.temperature, loads.between, strict=True)
    )
    before = loads.before + thermometer
    teller = OutcomeTeller(outcome)
    try:
        read_points = _points(loads, records, applied, teller)
        concerned = ("equivalent_resistance", "switch_resistance")[: 2 if records else 1]
        points = at_the_drive(outcome, loads, read_points, known.leads, concerned)
        if records:
            _by_waveforms(
                outcome,
                teller,
                LoadPoints(tuple(points), before, warm[-1], warm),
                typed,
                known,
                pole_pairs,
            )
        else:
            tell_by_supply(outcome, loads, points, warm, before, typed, known, pole_pairs)
    except (EstimationError, ProcedureError) as error:
        raise InputError(at(str(table), text_of(error))) from error
    if len(points) < _FEW:
        outcome.warn(
            text("{count} loads do not show a single wrong row: take five loads or more", count=len(points)),
            "few-readings",
        )
    return outcome.as_dict()


def _by_instrument(accuracy: Sequence[Statement], channels: Sequence[str]) -> list[Statement]:
    """Return the statements with those of the captures' channels as of an instrument of their own: the supply's current is read by another
    one.
    """
    stated = {s.name for s in accuracy}
    result = []
    for each in accuracy:
        of_captures = [c for c in channels if each.name == "current" and c not in stated]
        result += [each, *(replace(each, name=c, instrument="oscilloscope") for c in of_captures)]
    return [replace(s, instrument=s.instrument or "oscilloscope") if s.name in channels else s for s in result]


def _records(
    loads: LoadTable,
    waves: Sequence[Path],
    current: str | None,
    scale: Mapping[str, float | ProbeFactor],
    selection: CapturePart,
) -> list[tuple[Capture, CaptureChannel]]:
    """Return the captures in the loads' order, each with its current. Raises UsageError where there is not one for each row."""
    if waves and len(waves) != len(loads.rows):
        raise UsageError(
            text(
                "{path} has {rows} rows, and {count} captures are given: give one of a line's current for each row, in the table's order",
                path=str(loads.path),
                rows=len(loads.rows),
                count=len(waves),
            )
        )
    captures = [read_capture(path, selection=selection).scaled(scale) for path in waves]
    channels = [pick(capture, current, ("A",), "current", ("curr", "strom", "i"), "--current") for capture in captures]
    records = list(zip(captures, channels, strict=True))
    refuse_copies([(capture.source, channel.values) for capture, channel in records])
    return [records[row - 1] for row in loads.rows] if records else []


@dataclass(frozen=True)
class _Wave:
    """A record of a line's current (A) over time (s), as its estimator reads it."""

    time: FloatArray
    values: FloatArray
    resolution: float
    clipped: bool


def _points(
    loads: LoadTable,
    records: Sequence[tuple[Capture, CaptureChannel]],
    applied: AppliedAccuracy,
    teller: OutcomeTeller,
) -> list[LoadPoint]:
    """Return the readings as the procedure has them, each with its meter's limits and its repeatability."""

    def reading(kind: str, unit: str, values: FloatArray, at_load: int, repeats: float) -> Reading:
        value = float(values[at_load])
        accuracy = Accuracy(
            gain=applied.gain(kind, kind),
            offset=applied.offset(kind, kind),
            resolution=_last_digit(kind, values),
            noise=repeats * abs(value),
            source="as stated",
        )
        return Reading(value, unit, accuracy, 0.0)

    points = []
    for k in range(len(loads.rows)):
        torque, frequency, line, limits = float(loads.torque[k]), math.nan, None, Accuracy(source="as stated")
        if records:
            capture, channel = records[k]
            fit = fit_back_emf(capture.times(), np.atleast_2d(channel.values), harmonics=(1, 5, 7, 11, 13))
            frequency = fit.frequency
            wave = _Wave(capture.times(), channel.values, channel.resolution, bool(channel.clipped))
            line = separated_line(teller, torque, wave, frequency)
            limits = replace(limits, gain=applied.gain("current", channel.name))
        points.append(
            LoadPoint(
                torque=torque,
                shaft_torque=_once(reading("torque", "N·m", loads.torque, k, _REPEATS)),
                speed=reading("speed", "rad/s", loads.speed, k, _SPEED_REPEATS),
                bus_voltage=_once(reading("voltage", "V", loads.voltage, k, _REPEATS)),
                bus_current=_once(reading("current", "A", loads.current, k, _REPEATS)),
                electrical_frequency=frequency,
                line=line,
                current_accuracy=limits,
                begun=float(k),
                read=float(k),
            )
        )
    return points


def _last_digit(kind: str, values: FloatArray) -> float:
    """Return the place of the last digit of readings (SI) as they were written: speeds in rpm or in rad/s."""
    digit = last_digit(values)
    return max(digit, last_digit(values * _RPM) / _RPM) if kind == "speed" else digit


def _once(reading: Reading) -> Averaged:
    """Return a single reading as the mean of itself: its repeatability is among its meter's errors."""
    return Averaged(reading, 0.0, math.inf)


def _by_waveforms(
    outcome: AnalysisOutcome,
    teller: OutcomeTeller,
    points: LoadPoints,
    typed: TypedWinding,
    known: TypedEmf,
    pole_pairs: int | None,
) -> None:
    """Tell all that the procedure tells of the same readings."""
    if typed.connection is None or typed.resistance is None or typed.inductance is None:
        raise UsageError(
            text(
                "captures of the line's current need the winding as well: type --connection wye or delta, --winding-resistance (R_11, ohm) "
                "and --winding-inductance (L11 − L12, H)"
            )
        )
    delta = typed.connection == "delta"
    data = winding_data(
        typed.settings(known.magnet_coefficient),
        {},
        outcome.uncertainties,
        points.before,
        delta=delta,
        tell=teller.notice,
    )
    figures = SixStepFigures(
        teller, outcome.uncertainties, data, "delta" if delta else "wye", typed.switch_resistance, pole_pairs
    )
    judged = figures.judged(points)
    parts = figures.parts(judged, known.magnet_coefficient)
    expected = known.at_25(pole_pairs)
    if expected is not None:
        warm = 1.0 + known.magnet_coefficient * (float(points.before.x) - COLD)
        figures.compare_emf(parts.emf_constant, expected[0] * warm)
    splits = figures.splits(judged, parts)
    figures.commutation(splits, parts, judged.misfit)
    outcome.detail(**{name: value for name, value in teller.findings.items() if name != "misfit"})
