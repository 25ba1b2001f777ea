"""A recorded voltage step, made ready for the fit: where it begins, what the probes read at rest, how noisy it is."""

from dataclasses import dataclass
from functools import cache, cached_property, partial

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import same_length, series, uniform_step
from procedures.estimation.fitting.fit import EstimationError, FloatArray, WithheldError
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.fitting.noise import white_noise
from procedures.estimation.fitting.smoothing import Piece, Smoothed, cubics, smooth
from procedures.estimation.winding.current_step.pulse import check_switching

#: In a step of less than so many standard deviations of the noise, single samples do not show when it begins.
_CLEAR = 20.0
#: A voltage that rises from within an interval on is taken for too early by a twelfth of it in the mean.
_CORNER = 12.0
#: A source's resistance shows where the voltage follows the current by more than so many standard deviations of the noise; shorter
#: records do not show it.
_TAKEN, _LEAST_TO_FOLLOW = 3.0, 200
#: A voltage has risen where it is off the baseline by so many standard deviations, codes, and by this share of its largest.
_RISEN, _RISEN_CODES, _RISEN_SHARE = 10.0, 3.0, 0.03
#: A voltage whose smoothing takes more coefficients than this counts as sampled.
_MOST = 72
#: Before the step lie at least so many samples and this share of the record, and the voltage there is below this share of its end.
_LEAST_BEFORE, _SHARE_BEFORE, _MOST_BEFORE = 20, 0.01, 0.3
#: Unless no more than this share of the end's current flows there, and at least this share of the end's voltage comes with the step.
_FLOWING, _COMES = 0.03, 0.5

#: A voltage of which this share is left at the end has died away; a current of which that share is left lasts.
_DIED_AWAY, _LASTS = 0.3, 0.6


@dataclass(frozen=True)
class StepRecord:
    """A step as recorded, shape (n,): `drive` is the voltage (V) less its `baseline`, zero before sample `edge`.

    `voltage` is as sampled; `noise_left` are the directions of the noise left in `drive` where it was smoothed, None where it is as
    sampled. The resolutions are one converter step of each channel. Samples of the current whose `kept` is 0 do not count; None where all
    do. `other_axis` is as `fit_step_response` takes it.
    """

    time: FloatArray
    drive: FloatArray
    current: FloatArray
    step: float
    edge: int
    baseline: float
    voltage_noise: float
    current_noise: float
    noise_left: tuple[Piece, ...] | None
    voltage: FloatArray
    voltage_resolution: float
    current_resolution: float
    kept: FloatArray | None = None
    other_axis: float = 0.0

    @cached_property
    def sharp(self) -> bool:
        """True if the voltage changes mostly within one sampling interval, so that the instant is not resolved."""
        swing = abs(float(np.median(self.drive[self.edge :])))
        if swing < _CLEAR * self.voltage_noise:
            return False
        return self.edge > 0 and float(np.max(np.abs(np.diff(self.drive)))) > 0.5 * swing

    @cached_property
    def instant(self) -> float:
        """Standard uncertainty (s) of the instant at which the steepest interval drives the current; 0 where the step is all gradual."""
        if self.sharp:
            return self.step / float(np.sqrt(12.0))
        rises = np.diff(self.drive)
        steepest = float(np.max(np.abs(rises)))
        if self.edge <= 0 or steepest < _CLEAR * self.voltage_noise:
            return 0.0
        # Where a rise begins within an interval, its line between the samples holds up to an eighth of the bend too much.
        return self.step / _CORNER * float(np.max(np.abs(np.diff(rises)))) / steepest

    @cached_property
    def resting(self) -> int:
        """Number of samples before the step that are at rest for all that their noise shows: more than those that certainly are."""
        away = np.abs(self.voltage - self.baseline)
        clear = max(
            _RISEN * self.voltage_noise, _RISEN_CODES * self.voltage_resolution, _RISEN_SHARE * float(np.max(away))
        )
        # A slow supply has left the baseline some samples before it shows.
        return max(self.edge, int(0.9 * np.argmax(away > clear)))

    @cached_property
    def jump(self) -> int:
        """Sample at the end of the steepest interval."""
        return int(np.argmax(np.abs(np.diff(self.drive)))) + 1


def _edge(voltage: FloatArray, noise: float, resolution: float) -> int:
    """Return the number of samples that certainly lie before the step; 0 where the record begins with it."""
    first = float(np.median(voltage[: max(3, voltage.size // 200)]))
    swing = float(np.max(np.abs(voltage - first)))
    # A step that single samples hardly show is looked for in means of so many that it stands out.
    level = abs(float(np.median(voltage[-max(3, voltage.size // 10) :])) - first)
    hidden = noise / max(level, noise) if noise else 0.0
    together = int(np.clip((_CLEAR * hidden) ** 2, 1, max(1, voltage.size // 100)))
    if together > 1:
        whole = voltage.size // together * together
        means = voltage[:whole].reshape(-1, together).mean(axis=1)
        first = float(np.median(means[: max(3, means.size // 20)]))
        away = np.flatnonzero(np.abs(means - first) > 6.0 * noise / np.sqrt(together))
        # What the noise hides of a slow rise lies before.
        certain = int(0.97 * away[0] - 2.0) * together if away.size else 0
        return certain if certain >= 5 else 0
    away = np.flatnonzero(np.abs(voltage - first) > max(6 * noise, 0.01 * swing, 1.5 * resolution))
    if not away.size:
        return 0
    # A slow supply has left the baseline some samples before it shows.
    certain = int(0.9 * away[0]) if np.abs(voltage[away[0]] - first) < 0.5 * swing else int(away[0])
    return certain if certain >= 5 else 0


def _smoothed(drive: FloatArray, current: FloatArray, voltage_noise: float, current_noise: float) -> Smoothed | None:
    """Return the voltage freed of its noise; what the current takes from it across the source's resistance is known by its shape."""
    # All three are cut into pieces of the same few lengths.
    smoothed = partial(smooth, most=_MOST, polynomials=cache(cubics))
    shape = smoothed(current, current_noise)
    if shape is None or drive.size < _LEAST_TO_FOLLOW:
        return smoothed(drive, voltage_noise)
    risen = slice(_risen(drive), None)
    taken = shape.values - float(np.mean(shape.values[risen]))
    squares = float(taken[risen] @ taken[risen])
    drop = float(taken[risen] @ drive[risen]) / squares if squares else 0.0
    if drop**2 * squares <= (_TAKEN * voltage_noise) ** 2:
        return smoothed(drive, voltage_noise)
    rest = smoothed(drive - drop * taken, voltage_noise)
    if rest is None:
        return smoothed(drive, voltage_noise)
    simpler = smoothed(drive, voltage_noise, most=rest.count - 1)
    if simpler is not None:
        return simpler
    # The drop is off by the noise over √squares; what the rest holds of that shape anyway does not count again.
    beside = taken.copy()
    for begin, directions in rest.pieces:
        part = slice(begin, begin + directions.shape[1])
        beside[part] -= (directions @ taken[part]) @ directions
    shape_left = Piece(0, beside[None] / np.sqrt(squares))
    return Smoothed(rest.values + drop * taken, (*rest.pieces, shape_left), rest.count + 1)


def _risen(drive: FloatArray) -> int:
    """Return from which sample on the voltage has risen, but for what the current takes from it."""
    length = max(1, drive.size // 200)
    means = drive[: drive.size // length * length].reshape(-1, length).mean(axis=1)
    return min((int(np.argmax(np.abs(means) > 0.8 * abs(float(np.median(means))))) + 2) * length, drive.size // 2)


def read_step(
    time: ArrayLike, voltage: ArrayLike, current: ArrayLike, voltage_resolution: float, current_resolution: float
) -> StepRecord:
    """Return the step in a record (s, V, A; one converter step of each channel, 0 if unknown).

    Raises EstimationError where either channel shows no step or the samples are not evenly spaced, WithheldError where the record does
    not show the circuit at rest before.
    """
    t, v, i = (series(n, x, least=20) for n, x in (("time", time), ("voltage", voltage), ("current", current)))
    same_length(time=t, voltage=v, current=i)
    step = uniform_step(t)
    v_noise, i_noise = white_noise(v, voltage_resolution), white_noise(i, current_resolution)
    change = float(np.ptp(i))
    if change <= max(10 * i_noise, 3 * current_resolution) or change == 0:
        raise EstimationError(
            "the current shows no step; check the current probe and the trigger, or use a finer range"
        )
    if np.ptp(v) == 0 or (float(np.max(np.abs(v))) <= 8 * v_noise and np.ptp(v) <= 3 * voltage_resolution):
        raise EstimationError("the voltage shows no step; check the voltage probe")
    edge = _edge(v, v_noise, voltage_resolution)
    if edge >= v.size - max(3, v.size // 20):
        raise EstimationError("the step comes at the very end of the record; move the trigger towards its beginning")
    check_switching(t, v, edge, voltage_resolution)
    _check_voltage_coupling(t, v, i, edge)
    _check_baseline(v, i, edge)
    # Exact data have no noise; weights need some.
    v_noise = max(v_noise, 1e-9 * float(np.max(np.abs(v))))
    i_noise = max(i_noise, 1e-9 * change)
    baseline = float(np.mean(v[:edge])) if edge else 0.0
    drive = np.where(np.arange(v.size) < edge, 0.0, v - baseline)
    smoothed = _smoothed(drive[edge:], i[edge:] - float(np.mean(i[:edge]) if edge else i[0]), v_noise, i_noise)
    left = None
    if smoothed is not None:
        drive[edge:] = smoothed.values
        left = tuple(Piece(edge + begin, directions) for begin, directions in smoothed.pieces)
    return StepRecord(
        t, drive, i, step, edge, baseline, v_noise, i_noise, left, v, voltage_resolution, current_resolution
    )


def _check_voltage_coupling(time: FloatArray, voltage: FloatArray, current: FloatArray, edge: int) -> None:
    """Raise WithheldError where the voltage dies away under a lasting current: its channel is AC coupled."""
    if edge < _LEAST_BEFORE:
        return
    v, i = np.abs(voltage - float(np.mean(voltage[:edge]))), np.abs(current - float(np.mean(current[:edge])))
    last, top = slice(-max(3, voltage.size // 10), None), int(np.argmax(v))
    if float(np.median(v[last])) > _DIED_AWAY * v[top] or float(np.median(i[last])) < _LASTS * float(np.max(i)):
        return
    fallen = int(np.argmax(v[top:] < v[top] / np.e))
    corner = 1.0 / (2.0 * np.pi * float(time[top + fallen] - time[top]))
    finding = Finding(
        Cause.AC_COUPLED, Answer.WITHHELD, figures={"record": "step", "channel": "voltage", "corner": corner}
    )
    raise WithheldError(
        "the voltage dies away under a lasting current: its channel is AC coupled; couple it DC", Misfit((finding,))
    )


def _check_baseline(voltage: FloatArray, current: FloatArray, edge: int) -> None:
    """Raise WithheldError unless the record begins before the step: what flowed at its beginning, no fit finds out.

    A voltage before it that drives no current is hum, or the channel's zero.
    """
    needed = max(_LEAST_BEFORE, int(np.ceil(_SHARE_BEFORE * voltage.size)))
    figures: dict[str, float | str] = {"record": "step", "samples": float(edge), "needed": float(needed)}
    seen = f"the record shows {edge} samples of the circuit at rest before the step, at least {needed} are needed"
    if edge >= needed:
        at, last = slice(edge), slice(-max(3, voltage.size // 10), None)
        (v, v_end), (i, i_end) = (
            (float(np.mean(values[at])), float(np.median(values[last]))) for values in (voltage, current)
        )
        idle = abs(i) < _FLOWING * abs(i_end) and abs(v_end - v) >= _COMES * abs(v_end)
        if idle or abs(v) < _MOST_BEFORE * abs(v_end):
            return
        share = abs(v / v_end) if v_end else 1.0
        figures = {"record": "step-before", "share": share}
        seen = f"{share:.0%} of the voltage at the end is there before the step already"
    finding = Finding(Cause.NO_BASELINE, Answer.WITHHELD, figures=figures)
    raise WithheldError(
        f"no baseline: {seen}; trigger later in the record, so that it begins before the supply is switched on",
        Misfit((finding,)),
    )
