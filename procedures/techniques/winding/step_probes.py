"""A step's probes held against what the supply and the bridge say: a wrong factor is in no residual."""

import math
from dataclasses import dataclass

from drivers.interfaces import Waveform
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit

#: Beyond this share a channel is not the supply's other reading of the same thing, whatever its accuracy.
_CONTRADICTION = 0.15
#: A winding that is warmer or colder than when its resistance was measured differs by less than this share.
_TEMPERATURE = 0.35
#: Leads, contacts and source never take all but this share of the voltage.
_LEAST_SHARE = 0.12
#: What is not known of the supply's setting against its meters, share.
_SUPPLY = 0.01
#: Factors that probes have, and how near one must be to be meant.
_USUAL, _NEAR = (0.001, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0), 0.15
#: As near where nobody knows what leads and contacts take of the voltage.
_LEADS = 0.4
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
class ProbesJudged:
    """The findings about the probes, and the relative error of one of them beyond its accuracy."""

    misfit: Misfit = NO_MISFIT
    share: float = 0.0


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
    off = abs(ratio - 1.0)
    if off <= current.accuracy.gain + free:
        return ProbesJudged()
    figures: dict[str, float | str] = {"record": "step", "channel": str(current.channel), "difference": ratio - 1.0}
    return ProbesJudged(Misfit((Finding(Cause.CHANNELS_DIFFER, Answer.WIDENED, figures=figures),)), off)


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
