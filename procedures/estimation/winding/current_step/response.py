"""Resistance and inductance from the recorded voltage and current of a step (§3.3.1, erratum E10)."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import same_length, series, uniform_step
from procedures.estimation.fitting.first_order import respond_evenly
from procedures.estimation.fitting.fit import EstimationError, Fit, FloatArray
from procedures.estimation.fitting.misfit import ALARM, Answer, Cause, Finding, Misfit
from procedures.estimation.fitting.noise import undithered, white_noise
from procedures.estimation.fitting.repeated_rows import repeated_rows
from procedures.estimation.fitting.smoothing import components
from procedures.estimation.winding.current_step.circuit import voltage_shares
from procedures.estimation.winding.current_step.clipping import Ends, fit_flat_top, fit_unclipped, without_end
from procedures.estimation.winding.current_step.closed_circuits import other_axis_errors
from procedures.estimation.winding.current_step.codes import limited_from, too_coarse
from procedures.estimation.winding.current_step.fit import Fitted, Problem, fit_plain, problem, scale_of
from procedures.estimation.winding.current_step.large_hum import fit_beside_hum, hidden_by_hum, hums_at_sight
from procedures.estimation.winding.current_step.misfit import COARSE_ALARM, StepJudgement, judge
from procedures.estimation.winding.current_step.pulse import ended_from
from procedures.estimation.winding.current_step.record import StepRecord, read_step
from procedures.estimation.winding.current_step.start import start_of
from procedures.estimation.winding.current_step.term import StepScale, shares_of_currents

#: Noise, as a share of the step, through which 63 % of it are read off.
_JITTER = 0.01


@dataclass(frozen=True, kw_only=True)
class StepFit(Fit):
    """A fitted step: `step` is its sampling interval (s), `judged` what it was tested for."""

    step: float
    judged: StepJudgement
    plain: FloatArray

    @property
    def timing(self) -> float:
        """The relative error of the inductance due to a delay of one channel against the other of at least half a sampling
        interval.
        """
        return 0.5 * self.step * self.value("resistance") / self.value("inductance")

    def plain_uncertainty(self, name: str) -> float:
        """Return the standard uncertainty of a parameter from noise and rounding alone. Raises KeyError for an unknown name."""
        return float(np.sqrt(self.plain[self.names.index(name)]))


def fit_step_response(
    time: ArrayLike,
    voltage: ArrayLike,
    current: ArrayLike,
    *,
    voltage_resolution: float = 0.0,
    current_resolution: float = 0.0,
    voltage_ends: Ends = None,
    current_ends: Ends = None,
    other_axis: float = 0.0,
    alarm: float = ALARM,
) -> StepFit:
    """Fit `resistance` (Ω), `inductance` (H), `offset` (A, of the current probe) to a recorded step (V, A; evenly sampled).

    The circuit is at rest at the start of the record; the voltage's samples are its input, straight between them, so
    the supply may rise slowly or overshoot. Also `voltage_offset` (V), the probe's reading at rest; where the voltage rises within few
    sampling intervals also `delay` (s), the instant of its steepest rise against mid-interval. The resolutions (V, A) are one
    converter step, the ends the least and the largest value that a converter gives, where they are known; what is seen by less than
    `alarm` standard deviations is chance. `other_axis` is by how much the winding's other axis may be coupled to the stepped one
    (standard deviation of k², as that of a closed circuit): so much is not told of, but is in the interval. `misfit` is what the
    record shows beside; `residuals` end where a supply's limit or the end of a pulse ended the step. Where the inductance
    depends on the current, it is that at none.

    Raises EstimationError where there is no step, the record is too short, or a probe is reversed, and WithheldError where nothing of it
    can be used, for want of a baseline or of range, or because the voltage switches.
    """
    known = _Known(voltage_resolution, current_resolution, voltage_ends, current_ends, other_axis, alarm)
    v, i = series("voltage", voltage, least=20), series("current", current, least=20)
    same_length(time=series("time", time), voltage=v, current=i)
    repeated = repeated_rows((v, i))
    if repeated is None:
        return _fit(time, v, i, known)
    fit = _fit(repeated.times(series("time", time)), v[repeated.new], i[repeated.new], known)
    return replace(fit, residuals=repeated.over_all(fit.residuals), misfit=repeated.beside(fit.misfit))


class _Known(NamedTuple):
    """What is known of the channels, as `fit_step_response` takes it."""

    voltage_resolution: float
    current_resolution: float
    voltage_ends: Ends
    current_ends: Ends
    other_axis: float
    alarm: float


def _fit(time: ArrayLike, voltage: FloatArray, current: FloatArray, known: _Known) -> StepFit:
    """Fit a step of whose channels every row is a reading of its own."""
    voltage_resolution, current_resolution, voltage_ends, current_ends, other_axis, alarm = known
    ended = ended_from(voltage)
    if ended is not None:
        # What the current flows through afterwards is no part of the circuit, and the instant is known by single samples only.
        time, voltage, current = (np.asarray(x, dtype=np.float64)[:ended] for x in (time, voltage, current))
    record = read_step(time, voltage, current, voltage_resolution, current_resolution)
    cut = None
    limited = limited_from(record.voltage, record.current, record.edge, record.voltage_noise)
    if limited is not None:
        # What the supply did from its limit on is known by single samples only.
        t, v, i = (np.asarray(x, dtype=np.float64)[:limited] for x in (time, voltage, current))
        record = read_step(t, v, i, voltage_resolution, current_resolution)
    record = replace(record, other_axis=other_axis)
    if clipped := without_end(record, voltage_ends, current_ends):
        record, cut = clipped
    step, plain, cut = _begun(record, cut)
    record = step.record
    _check_window(record, plain.full)
    used = slice(None) if record.kept is None else record.kept > 0.0
    # Hum carries the current across its codes as noise does.
    coarse = not plain.terms and too_coarse(record.current[used], plain.current[used], current_resolution)
    seen_by = max(alarm, COARSE_ALARM) if coarse else alarm
    judged = judge(step, plain, alarm=seen_by)
    # Or none explains it.
    several = len(judged.fitted.terms) > 1 or any(f.cause is Cause.UNEXPLAINED for f in judged.findings)
    if cut is None and several and not plain.terms and (flat := fit_flat_top(step, plain, judged.fitted.current)):
        step, plain, cut = flat
        record = step.record
        judged = judge(step, plain, alarm=seen_by)
    findings = judged.findings
    if coarse:
        figures: dict[str, float | str] = {"record": "step", "channel": "current", "resolution": current_resolution}
        findings = (Finding(Cause.TOO_COARSE, Answer.WIDENED, figures=figures), *findings)
    if limited is not None:
        share = 1.0 - limited / np.size(time)
        said: dict[str, float | str] = {"record": "step", "channel": "current", "level": float(i[-1]), "lost": share}
        findings = (Finding(Cause.CLIPPED, Answer.MODELLED, figures=said), *findings)
    if ended is not None:
        after = float(record.time[-1] - record.time[record.edge])
        ends: dict[str, float | str] = {"record": "step", "after": after, "at": float(record.time[-1])}
        findings = (Finding(Cause.PULSE_ENDS, Answer.MODELLED, figures=ends), *findings)
    if cut is not None:
        lost = 1.0 - float(np.mean(step.record.kept[record.edge :])) if step.record.kept is not None else 0.0
        told: dict[str, float | str] = {"record": "step", "channel": "current", "level": cut, "lost": lost}
        findings = (Finding(Cause.CLIPPED, Answer.MODELLED, figures=told), *findings)
    scale = scale_of(step.record, plain)
    beside = _beside_noise(step, judged.fitted, scale)
    covariance = _covariance(judged, beside)
    plain_covariance = plain.covariance[: len(step.names), : len(step.names)] + (
        beside if judged.fitted is plain else _beside_noise(step, plain, scale)
    )
    left = record.current - judged.fitted.current
    values = judged.values.copy()
    if "voltage_offset" in step.names:
        values[step.names.index("voltage_offset")] += record.baseline
    return StepFit(
        step.names,
        values,
        covariance,
        float(record.time.size - 3),
        left,
        float(np.sqrt(np.mean(left**2))),
        misfit=Misfit.together([Misfit(findings)]),
        step=record.step,
        judged=judged,
        plain=np.diag(plain_covariance),
    )


def _begun(record: StepRecord, cut: float | None) -> tuple[Problem, Fitted, float | None]:
    """Return the fit with which the search for causes begins, and the level (A) at which the current is cut off: `cut`, or a flat top."""
    hums, hidden = hums_at_sight(record), hidden_by_hum(record)
    if hidden and cut is not None:
        # A top that hum moves along the record does not tell what lies below it.
        raise hidden
    try:
        if hums:
            return *fit_beside_hum(record, hums), None
        start = start_of(record)
        step, plain = fit_plain(problem(record, *start[:3]), start)
        if cut is not None:
            return *fit_unclipped(step, plain, cut), cut
    except EstimationError as error:
        if hidden:
            raise hidden from error
        raise
    # A corner takes several terms, which take long to find.
    return fit_flat_top(step, plain) or (step, plain, None)


def _covariance(judged: StepJudgement, beside: FloatArray) -> FloatArray:
    """Return the covariance of the parameters: of white noise and of what is `beside` it, grown by what was found."""
    grown, count = np.sqrt(judged.growth), judged.growth.size
    covariance = judged.fitted.covariance[:count, :count] * np.outer(grown, grown) + beside
    wider = 1.0 + judged.apart / np.sqrt(np.diag(covariance))
    return np.asarray(covariance * np.outer(wider, wider))


def _beside_noise(step: Problem, fitted: Fitted, scale: StepScale) -> FloatArray:
    """Return the covariance of the parameters from what does not average out as white noise does."""
    record, gain = step.record, fitted.gain[: len(step.names), : step.record.time.size]
    shift = gain @ step.white.apply(_lasting_errors(record, fitted.full).T).T
    if record.noise_left is not None:
        # Noise is left in a smoothed voltage; what it shifts is asked of the few parameters, not of the many shapes.
        of_readings = step.white.back(gain)
        shares = shares_of_currents(fitted.terms, fitted.figures, of_readings, record.step, scale)
        through = voltage_shares(record, fitted.full, shares)
        shift = np.hstack((shift, record.voltage_noise * components(record.noise_left, through)))
    return np.asarray(shift @ shift.T)


def _check_window(record: StepRecord, full: FloatArray) -> None:
    """Raise EstimationError unless the record is long and fine enough for what was found."""
    tau = full[1] / full[0]
    last = -1 if record.kept is None else int(np.flatnonzero(record.kept)[-1])
    window = record.time[last] - record.time[record.edge]
    if tau < 0.5 * record.step:
        raise EstimationError(f"the time constant ({tau:g} s) is less than half a sampling interval; sample faster")
    if window < 0.7 * tau:
        raise EstimationError(
            f"the record ends {window / tau:.2f} time constants after the step; record at least three (about {3 * tau:g} s)"
        )


def _lasting_errors(record: StepRecord, full: FloatArray) -> FloatArray:
    """Errors of the current's model (A, shape (n, m)) of one standard deviation each, that do not average out over the record.

    Rounding without dither may shift the level of the current and of the voltage, that before the step and that after it.
    """
    rate, inductance = full[0] / full[1], full[1]
    after = np.sqrt(2.0) * (np.arange(record.time.size) >= record.edge)
    drive = undithered(record.voltage_noise, record.voltage_resolution) / inductance * after
    through = respond_evenly(record.step, drive, rate)
    errors = [undithered(record.current_noise, record.current_resolution) * after, through]
    return np.column_stack((*errors, *other_axis_errors(record, full)))


def time_constant_63(time: ArrayLike, current: ArrayLike) -> float:
    """Return the time (s) from the step's start to 63.2 % of the current's change (§3.3.1), as read off a screen.

    Start: the last sample before the current leaves its first level. Raises EstimationError where there is no step.
    """
    t, i = series("time", time, least=10), series("current", current, least=10)
    same_length(time=t, current=i)
    noise = white_noise(i)
    final, first = _ends(i)
    if abs(final - first) > 0.0:
        # The eye averages over what jitters: noise of a step's percent is left.
        together = int(np.clip((noise / (_JITTER * (final - first))) ** 2, 1, max(1, i.size // 100)))
        whole = i.size // together * together
        t, i = (x[:whole].reshape(-1, together).mean(axis=1) for x in (t, i))
        noise /= np.sqrt(together)
    final, first = _ends(i)
    change = final - first
    if abs(change) <= 8 * noise or change == 0:
        raise EstimationError("the current shows no step; check the current probe and the trigger")
    rise = (i - first) / change
    crossed = int(np.argmax(rise >= 1 - np.exp(-1.0)))
    still = np.flatnonzero(rise[: crossed + 1] <= max(0.02, 4 * noise / abs(change)))
    begin = int(still[-1]) if still.size else 0
    if crossed == 0:
        raise EstimationError(
            "the first sample already lies beyond 63 % of the step; cut it off, or move the trigger towards the middle"
        )
    share = (1 - np.exp(-1.0) - rise[crossed - 1]) / (rise[crossed] - rise[crossed - 1])
    return float(t[crossed - 1] + share * (t[crossed] - t[crossed - 1]) - t[begin])


def _ends(current: FloatArray) -> tuple[float, float]:
    """Return a record's last level and its first."""
    last, first = max(1, current.size // 50), max(1, current.size // 200)
    return float(np.mean(current[-last:])), float(np.mean(current[:first]))


class Apparent(NamedTuple):
    """Flux linkage over current at the end of a step (H), and that current (A)."""

    inductance: float
    current: float


def apparent_inductance(time: ArrayLike, voltage: ArrayLike, current: ArrayLike) -> Apparent:
    """Return the flux linkage that a step built up over the current it ended at, whatever the iron does on the way.

    Flux is ∫(v − R·i) dt with probe offsets from before the step and R from its end, so that the settled part adds nothing.
    Raises EstimationError where the record has no baseline or does not settle.
    """
    t, v, i = (series(n, x, least=100) for n, x in (("time", time), ("voltage", voltage), ("current", current)))
    same_length(time=t, voltage=v, current=i)
    step = uniform_step(t)
    head, tail = slice(0, max(5, t.size // 20)), slice(-(t.size // 8), None)
    v, i = v - float(np.mean(v[head])), i - float(np.mean(i[head]))
    end = float(np.mean(i[tail]))
    noise = white_noise(i)
    if abs(end) <= 8 * noise:
        raise EstimationError("the current shows no step; check the current probe and the trigger")
    half = i[tail].size // 2
    if abs(float(np.mean(i[tail][half:]) - np.mean(i[tail][:half]))) > 0.01 * abs(end) + 4 * noise / np.sqrt(half):
        raise EstimationError("the current has not settled at the end of the record; record longer")
    resistance = float(np.mean(v[tail])) / end
    return Apparent(float(np.sum(v - resistance * i)) * step / end, end)
