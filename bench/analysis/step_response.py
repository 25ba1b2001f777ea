"""Step-response captures: loop resistance and inductance (§3.3.1)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from GTC.lib import UncertainReal

from bench.analysis.applied import AppliedAccuracy
from bench.analysis.outcome import AnalysisOutcome, estimated, named, paths_of, pick
from bench.analysis.record_sizes import warn_of_current
from bench.analysis.sensitivity import half_differences
from bench.analysis.statements import Statement
from bench.analysis.temperature import Temperature
from bench.analysis.time_base import judge_open_time, warn_of_time_constant
from bench.captures import WHOLE, Capture, CaptureChannel, CaptureError, CapturePart, ProbeFactor, read_captures
from drivers.interfaces import Accuracy
from drivers.interfaces.text import Translate, english, text, text_of, word
from procedures.estimation.fitting.fit import EstimationError, FloatArray, WithheldError
from procedures.estimation.fitting.misfit import Cause, Misfit
from procedures.estimation.winding.connections import Connection, ReadingConnection, phase_factor
from procedures.estimation.winding.current_step.response import StepFit, fit_step_response, time_constant_63
from procedures.estimation.winding.resistance import COPPER_REFERENCE, at_temperature
from procedures.techniques.temperature.settings import COLD

#: Channels that are later than this (s) beside each other are no two of one record.
_LONGEST_SKEW = 1.0
_FITTED = ("resistance", "inductance")
_ESTIMATOR = "output-error fit of R, L and offsets to recorded voltage and current"
_SKEW = "as taken"
_VOLTAGE_WORDS, _CURRENT_WORDS = ("volt", "u"), ("curr", "i")
_APPLIED = {
    ReadingConnection.LINE_TO_LINE: text("line to line, third terminal open"),
    ReadingConnection.SERIES_PARALLEL: text("one line to the other two joined, A to B and C"),
    ReadingConnection.PHASE_TO_STAR: text("line to star point"),
}
_READINGS = {
    "line": ReadingConnection.LINE_TO_LINE,
    "series-parallel": ReadingConnection.SERIES_PARALLEL,
    "phase": ReadingConnection.PHASE_TO_STAR,
}

#: Percentiles of a record between which its step lies, whatever single readings are.
_ENDS = (1.0, 99.0)


def analyze_step_response(
    file: str | Path | list[str | Path],
    *,
    connection: Connection = "wye",
    reading: ReadingConnection | str = ReadingConnection.SERIES_PARALLEL,
    axis: Literal["d", "q"] | None = None,
    voltage: str | None = None,
    current: str | None = None,
    scale: Mapping[str, float | ProbeFactor] | None = None,
    accuracy: Sequence[Statement] = (),
    selection: CapturePart = WHOLE,
    temperature: Temperature | None = None,
    skew: float = 0.0,
    translate: Translate = english,
) -> dict[str, Any]:
    """Return resistance and inductance of a recorded step: of the loop as it was, and of one leg of the equivalent wye.

    `reading` is how the step was applied ("line", "series-parallel", "phase"); `axis` where the rotor was locked, if known;
    `voltage`, `current` name the channels where their units do not tell; `scale` multiplies channels, by name. `accuracy`
    states the errors of voltage, current and time base; with `temperature` the resistance is referred to 25 °C by copper's
    coefficient. `selection` is the part of the record to take; `skew` (s) is by how much one channel may be late beside the other, half a
    sampling interval where that is more. A record that gives no figure for a cause with a name gives `withheld` ones.
    `translate` gives sentences in the reader's language. Raises CaptureError naming file and line.
    """
    if not 0.0 <= skew <= _LONGEST_SKEW:
        raise CaptureError("skew", text("{skew:g} s is not within 0 … {longest:g} s", skew=skew, longest=_LONGEST_SKEW))
    if isinstance(reading, str):
        if reading not in _READINGS:
            raise CaptureError(
                "reading",
                text(
                    "connection '{reading}' is not known; allowed are {names}", reading=reading, names=list(_READINGS)
                ),
            )
        reading = _READINGS[reading]
    try:
        factor = phase_factor(connection, reading)
    except EstimationError as error:
        raise CaptureError("connection", text_of(error)) from error
    capture = read_captures(paths_of(file), selection=selection).evenly_sampled().thinned().scaled(named(scale))
    if voltage is None and current is None and [c.unit for c in capture.channels] == ["", ""]:
        first, second = (channel.name for channel in capture.channels)
        # Their names count before their places.
        turned = _named(first, _CURRENT_WORDS) or _named(second, _VOLTAGE_WORDS)
        voltage, current = (second, first) if turned else (first, second)
    _check_two(capture, voltage, current)
    if voltage is None and current is None:
        _refuse_several(capture, paths_of(file))
    _refuse_two_voltages(capture, current)
    v = pick(capture, voltage, ("V",), "voltage", _VOLTAGE_WORDS, "--voltage")
    i = pick(capture, current, ("A",), "current", _CURRENT_WORDS, "--current")
    _check_two(capture, v.name, i.name)
    applied = AppliedAccuracy(accuracy, {"voltage": (v.name,), "current": (i.name,), "time": ("time",)}, (capture,))
    time = capture.times()
    outcome = AnalysisOutcome("dq_inductance_time_constant", "3.3.1", capture, applied, translate)
    name = f"{axis}_axis_inductance" if axis else "inductance"
    try:
        fit = estimated(capture, lambda: _fit(time, v, i))
    except CaptureError as error:
        if not isinstance(error.__cause__, WithheldError):
            _suggest_exchange(capture, time, v, i)
            raise
        for parameter in ("loop_resistance", "loop_inductance", name):
            outcome.parameter(
                parameter, outcome.uncertainties.limit(parameter, 0.0, 0.0), misfit=error.__cause__.misfit
            )
        return outcome.as_dict()
    outcome.assume(
        text("voltage is '{voltage}' in V, current is '{current}' in A", voltage=v.name, current=i.name),
        text(
            "winding in {connection}, step applied {reading}: leg of the equivalent wye = {y_equivalent:.4g} × loop",
            connection=word(connection),
            reading=_APPLIED[reading],
            y_equivalent=factor.y_equivalent,
        ),
        text("circuit at rest at the start of the record, rotor locked"),
    )
    shift = applied.offset("voltage", v.name)
    moved = (
        half_differences(fit, _FITTED, lambda by: _fit(time, v, i, by * shift), f"voltage, ±{shift:g} V")
        if shift
        else {}
    )
    if moved and not any(moved.values()):
        outcome.assume(text("the fit includes the offset of the voltage channel, so it does not affect the results"))
    loops = {}
    for fitted, of_time in zip(_FITTED, (0.0, 1.0), strict=True):
        loop = outcome.estimate(text("step fit of the {name}", name=word(fitted)), fit, fitted)
        loop = outcome.with_errors(loop, "voltage", v.name, gain=1.0, offset=moved[fitted] / shift if moved else 0.0)
        loop = outcome.with_errors(loop, "current", i.name, gain=-1.0)
        loops[fitted] = outcome.with_errors(loop, "time", "time", gain=of_time)
    late = max(fit.timing, abs(skew) * fit.value("resistance") / fit.value("inductance"))
    loops["inductance"] = outcome.uncertainties.instrument(
        "skew of the channels", loops["inductance"], Accuracy(gain=late, source=_SKEW)
    )
    seconds = late * fit.value("inductance") / fit.value("resistance")
    outcome.assume(
        text(
            "the channels are assumed to be at most {seconds:.3g} s apart in time (at least half a sampling "
            "interval); state a larger delay with --skew",
            seconds=seconds,
        )
    )
    tau = fit.value("inductance") / fit.value("resistance")
    judge_open_time(outcome, capture, "time constant", tau, ("loop_inductance", name))
    warn_of_current(outcome, i.name, float(np.ptp(np.percentile(i.values, _ENDS))))
    _resistance(outcome, loops["resistance"], temperature, fit.misfit.of("resistance", "loop_resistance"))
    outcome.parameter(
        "loop_inductance",
        loops["inductance"],
        estimator=_ESTIMATOR,
        convention="loop",
        misfit=fit.misfit.of("inductance", "loop_inductance"),
    )
    winding = factor.winding * fit.value("inductance")
    outcome.parameter(
        name,
        factor.y_equivalent * loops["inductance"],
        estimator=_ESTIMATOR,
        winding=winding,
        convention="y_equivalent",
        misfit=fit.misfit.of("inductance", name),
    )
    if applied.offset("current", i.name):
        outcome.assume(text("the fit includes the offset of the current channel, so it does not affect the results"))
    if axis is None:
        outcome.assume(
            text(
                "rotor position not given: the inductance is Ld, Lq or a value between them, depending on the rotor "
                "position"
            )
        )
    outcome.warn(
        text(
            "the resistance is that of the whole loop, with leads and contacts, as far as the voltage probe "
            "includes them; it is not reported as the stator resistance"
        ),
        "E10",
    )
    warn_of_time_constant(outcome, tau)
    # Where a pulse has ended the current falls again.
    ended = any(f.cause is Cause.PULSE_ENDS for f in fit.misfit.findings)
    read = slice(fit.residuals.size if ended else None)
    outcome.detail(
        time_constant=tau,
        correlation_resistance_inductance=fit.correlation("resistance", "inductance"),
        current_offset=fit.value("offset"),
        voltage_offset=fit.value("voltage_offset") if "voltage_offset" in fit.names else None,
        residual_rms=fit.residual_rms,
        winding_inductance=winding,
        note_time_constant_63=_read_off(time[read], i.values[read]),
    )
    return outcome.as_dict()


def _fit(time: FloatArray, v: CaptureChannel, i: CaptureChannel, shift: float = 0.0) -> StepFit:
    """Return the fit; `shift` (V) is added to the voltage."""
    ends = v.ends
    return fit_step_response(
        time,
        v.values + shift,
        i.values,
        voltage_resolution=v.resolution,
        current_resolution=i.resolution,
        voltage_ends=(ends[0] + shift, ends[1] + shift) if ends else None,
        current_ends=i.ends,
    )


def _read_off(time: FloatArray, current: FloatArray) -> float | None:
    """Return the time constant (s) as read off a screen, None where hum or noise hides it there."""
    try:
        return time_constant_63(time, current)
    except EstimationError:
        return None


def _refuse_two_voltages(capture: Capture, current: str | None) -> None:
    """Raise CaptureError where every channel is in volts: one is that of a shunt or a current probe whose factor the file does not say."""
    volts = [channel.name for channel in capture.channels if channel.unit == "V"]
    if len(volts) < 2 or len(volts) < len(capture.channels):
        return
    name = current if current is not None else volts[-1]
    raise CaptureError(
        capture.source,
        text(
            "channels {names} are all in V, but one of them must be the current: state the output of its probe or "
            "shunt per ampere, as in --scale {name}=10A/V, {name}=100mV/A or {name}=5mOhm",
            names=volts,
            name=name,
        ),
    )


def _suggest_exchange(capture: Capture, time: FloatArray, v: CaptureChannel, i: CaptureChannel) -> None:
    """Raise CaptureError where a record that is no step is one with its two columns exchanged."""
    try:
        fit = _fit(time, i, v)
    except EstimationError:
        return
    raise CaptureError(
        capture.source,
        text(
            "'{voltage}' as voltage and '{current}' as current do not form a step of a winding. Interchanged "
            "they do ({resistance:.3g} Ω, {inductance:.3g} H, if the numbers are in V and A): are the two "
            "columns interchanged? Correct the units in the headings, or check the probes",
            voltage=v.name,
            current=i.name,
            resistance=fit.value("resistance"),
            inductance=fit.value("inductance"),
        ),
    )


def _resistance(outcome: AnalysisOutcome, loop: UncertainReal, temperature: Temperature | None, misfit: Misfit) -> None:
    """Add the loop's resistance, at 25 °C where the temperature is known."""
    convention = "loop"
    if temperature is None:
        outcome.assume(
            text(
                "loop resistance at the temperature of the record. That temperature is not given, so the value "
                "is not referred to 25 °C"
            )
        )
    else:
        known = outcome.uncertainties.limit("winding temperature", temperature.celsius, temperature.half_width)
        outcome.detail(winding_temperature=temperature.celsius, loop_resistance_as_recorded=float(loop.x))
        loop = at_temperature(loop, known, COLD, temperature.coefficient, COPPER_REFERENCE)
        outcome.assume(
            text(
                "the whole loop at {celsius:g} °C ± {half_width:g} K, copper with {coefficient:g} 1/K at 20 °C: loop resistance referred "
                "to 25 °C, the time constant as recorded",
                celsius=temperature.celsius,
                half_width=temperature.half_width,
                coefficient=temperature.coefficient,
            )
        )
        convention = "loop, at 25 °C"
    outcome.parameter("loop_resistance", loop, estimator=_ESTIMATOR, convention=convention, misfit=misfit)


def _refuse_several(capture: Capture, files: Sequence[Path | str]) -> None:
    """Raise CaptureError where each of several files is a step of its own: files are taken together as channels of one."""
    units = [[channel.unit for channel in capture.channels].count(unit) for unit in ("V", "A")]
    if len(files) > 1 and min(units) >= len(files):
        raise CaptureError(
            capture.source,
            text(
                "each of the {count} files has a voltage and a current, and is a step by itself: analyse one after the other. Several "
                "files are taken for channels of one record; to take columns of two of them, name both with --voltage and --current",
                count=len(files),
            ),
        )


def _named(name: str, words: Sequence[str]) -> bool:
    """Return whether a channel's name begins with one of these words."""
    return name.lower().startswith(tuple(words))


def _check_two(capture: Capture, voltage: str | None, current: str | None) -> None:
    """Raise CaptureError for one column in both places."""
    if voltage is not None and voltage == current:
        raise CaptureError(
            capture.source,
            text(
                "column '{name}' is asked for as voltage and as current; name two columns of {names}",
                name=voltage,
                names=[channel.name for channel in capture.channels],
            ),
        )
