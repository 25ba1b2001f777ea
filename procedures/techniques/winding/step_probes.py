"""A step's probes held against what the supply and the bridge say, and against the other axis: a wrong factor is in no residual."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from drivers.interfaces import Waveform
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.winding.current_step.first_look import look_at_step

#: Beyond this share a channel is not the supply's other reading of the same thing, whatever its accuracy.
_CONTRADICTION = 0.15
#: A winding that is warmer or colder than when its resistance was measured differs by less than this share.
_TEMPERATURE = 0.35
#: Leads, contacts and source never take all but this share of the voltage.
_LEAST_SHARE = 0.12
#: What is not known of the supply's setting against its meters, share.
_SUPPLY = 0.01
#: A supply tells of a channel within both limits where it knows so many times as little as the channel.
_AS_GOOD = 2.0
#: Factors that probes have, and how near one must be to be meant.
_USUAL, _NEAR = (0.001, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0), 0.15
#: As near where nobody knows what leads and contacts take of the voltage.
_LEADS = 0.4
#: Resistances of both axes' steps differ beyond so many standard uncertainties and this share: by 5 K a winding may have changed.
_BEYOND, _LEAST_APART = 3.5, 0.02
#: Shares of the step's current between which so many readings tell what leads and contacts take of the voltage.
_RISING, _RISEN, _READINGS = 0.2, 0.8, 30
#: Records of which the end says nothing of the channel's factor.
_SPOILT = (Cause.CLIPPED, Cause.AC_COUPLED, Cause.NO_BASELINE)


@dataclass(frozen=True)
class StepSource:
    """The source of a step: `voltage` (V) set, of which `zero` may be the supply's zero error, and the loop's `resistance` (Ω) by
    its meters.

    `winding_resistance` (Ω) is what the probed part has by an earlier measurement, None where there was none.
    """

    voltage: float
    zero: float
    resistance: float
    winding_resistance: float | None = None


@dataclass(frozen=True)
class SettledSteps:
    """What the steps of one axis end at: voltage (V) and current (A) of the last, their `channels`, and the fitted `resistance` (Ω)
    of all with its relative `uncertainty`.
    """

    voltage: float
    current: float
    channels: tuple[int, int]
    resistance: float
    uncertainty: float

    @classmethod
    def of(cls, voltage: Waveform, current: Waveform, resistance: float, uncertainty: float) -> Self:
        """Return the end of a recorded step (V, A), with the fitted resistance and its standard uncertainty (Ω)."""
        channels = voltage.channel, current.channel
        return cls(_change(voltage), _change(current), channels, resistance, uncertainty / resistance)


@dataclass(frozen=True)
class ProbesJudged:
    """The findings about the probes, and the relative error of one of them, on `channel`, beyond its accuracy."""

    misfit: Misfit = NO_MISFIT
    share: float = 0.0
    channel: int = 0


def probes_against_supply(
    voltage: Waveform, current: Waveform, source: StepSource, found: Misfit, resistance: float | None = None
) -> ProbesJudged:
    """Return whether the records of a settled step agree with what drove it; `found` is what they were found to show before, `resistance`
    (Ω) the fitted one, by which a current that is cut off would have gone on.

    Names the channel and the factor that would make it right; a channel that is off by more than 15 % gives no inductance.
    """
    v, i = abs(_change(voltage)), abs(_change(current))
    free = _SUPPLY + source.zero / source.voltage
    ratio = i * source.resistance / source.voltage
    spoilt = {finding.cause for finding in found.findings}.intersection(_SPOILT)
    if spoilt == {Cause.CLIPPED} and ratio > 1.0 + max(_CONTRADICTION, free):
        # What is cut off hides how much too large it reads.
        whole = ratio if resistance is None else max(ratio, v / resistance * source.resistance / source.voltage)
        return ProbesJudged(_wrong(current.channel, whole))
    if spoilt:
        return ProbesJudged()
    if abs(ratio - 1.0) > max(_CONTRADICTION, free):
        return ProbesJudged(_wrong(current.channel, ratio))
    winding, across = source.winding_resistance, v / source.voltage
    share = across if winding is None else v / (i * winding)
    if winding is not None and abs(share - 1.0) > _TEMPERATURE:
        return ProbesJudged(_wrong(voltage.channel, share))
    if winding is None and not _LEAST_SHARE < across < 1.0 + max(_CONTRADICTION, free):
        return ProbesJudged(_wrong(voltage.channel, share, _LEADS))
    # Leads and contacts take of the voltage, and add nothing to it; at no current they take nothing.
    unloaded, uncertain = _unloaded(voltage, current)
    less = min(unloaded / source.voltage - 1.0 + _BEYOND * uncertain / source.voltage, 0.0)
    off = (voltage, across - 1.0 if across > 1.0 else less), (current, ratio - 1.0)
    wave, difference = max(off, key=lambda each: abs(each[1]) - each[0].accuracy.gain)
    share, stated = abs(difference), wave.accuracy.gain
    told = share > stated + free
    # Both at their limits is possible, and not likely; of a supply that knows much less than the channel it is likely.
    if not told and share <= (math.hypot(stated, free) if free < _AS_GOOD * stated else math.inf):
        return ProbesJudged()
    figures: dict[str, float | str] = {"record": "step", "channel": str(wave.channel), "difference": difference}
    finding = Finding(Cause.CHANNELS_DIFFER, Answer.WIDENED, figures=figures)
    return ProbesJudged(Misfit((finding,)) if told else NO_MISFIT, share, wave.channel)


def probes_between_axes(first: SettledSteps, second: SettledSteps) -> ProbesJudged:
    """Return whether steps to one voltage on both axes show one resistance, as one winding has.

    Where the probes see both of them with opposite signs, a channel whose gain depends on the sign is named.
    """
    ratio = math.log(second.resistance / first.resistance)
    if abs(ratio) <= max(_LEAST_APART, _BEYOND * math.hypot(first.uncertainty, second.uncertainty)):
        return ProbesJudged()
    (v, i), (w, j) = ((abs(each.voltage), abs(each.current)) for each in (first, second))
    of_voltage = abs(w - v) * max(i, j) >= abs(j - i) * max(v, w)
    share, channel = math.expm1(abs(ratio)), first.channels[0 if of_voltage else 1]
    figures: dict[str, float | str] = {"record": "step-axes", "channel": str(channel), "share": share}
    cause = Cause.DISTORTION if first.current * second.current < 0.0 else Cause.REPEATS_DIFFER
    return ProbesJudged(Misfit((Finding(cause, Answer.WIDENED, ("inductance",), figures=figures),)), share, channel)


def _unloaded(voltage: Waveform, current: Waveform) -> tuple[float, float]:
    """Return the voltage (V) that the source would show at the probes without a current, and its standard uncertainty.

    That is v + R·i of leads and contacts while the current rises; infinite where it does not rise after the voltage.
    """
    (v, _), (i, end) = (_from_rest(wave) for wave in (voltage, current))
    try:
        seen = look_at_step(voltage.time, v, i)
    except EstimationError:
        # Too noisy to tell it at sight: nothing is known.
        return math.inf, 0.0
    rising = (voltage.time > 2.0 * seen.end - seen.begin) & (i > _RISING * end)
    if np.count_nonzero(rising & (i < _RISEN * end)) < _READINGS:
        return math.inf, 0.0
    columns = np.column_stack((np.ones(np.count_nonzero(rising)), i[rising]))
    inverse = np.linalg.inv(columns.T @ columns)
    fitted = inverse @ (columns.T @ v[rising])
    left = v[rising] - columns @ fitted
    return float(fitted[0]), float(np.sqrt(inverse[0, 0]) * np.std(left))


def _from_rest(wave: Waveform) -> tuple[FloatArray, float]:
    """Return a channel's readings from those at rest on, and its last level, both made positive."""
    change = _change(wave)
    sign = math.copysign(1.0, change)
    return sign * (wave.values - float(wave.values[: max(wave.values.size // 50, 1)].mean())), abs(change)


def _change(wave: Waveform) -> float:
    """Return the level of the record's last tenth against its first fiftieth."""
    size = wave.values.size
    return float(wave.values[-max(size // 10, 1) :].mean() - wave.values[: max(size // 50, 1)].mean())


def _wrong(channel: int, ratio: float, near: float = _NEAR) -> Misfit:
    wanted = 1.0 / ratio if ratio > 0.0 else math.inf
    usual = min(_USUAL, key=lambda size: abs(math.log(size / wanted)) if 0.0 < wanted < math.inf else size)
    factor = usual if abs(usual / wanted - 1.0) < near else wanted
    figures: dict[str, float | str] = {"record": "step", "channel": str(channel), "share": ratio, "factor": factor}
    return Misfit((Finding(Cause.PROBE_FACTOR, Answer.WITHHELD, figures=figures),))
