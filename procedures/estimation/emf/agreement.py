"""Compares channels that show the EMF of one machine: the common value, and the channel that contradicts the others."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import EstimationError, FloatArray, coverage_interval
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit

#: What findings here are about.
FLUX = "flux_linkage"
#: A channel farther from the others than this share has another factor: no winding is so unlike the others.
_CONTRADICTS = 0.25
#: Differences beyond chance: false alarms in a thousand records.
_CHANCE = 1e-3
#: Factors that a probe, a setting or a connection is wrong by.
_USUAL = sorted(
    {size**sign for size in (2.0, math.sqrt(3.0), 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0) for sign in (-1, 1)}
)
#: A usual factor is meant where the channels' own spread, and at least this share, reaches it.
_NEAR = 0.03
#: A channel with less than this share of the others' EMF shows none.
_NONE = 0.002
#: A mean known no better than this is not given, where something was found in its channels.
_MOST = 0.2


@dataclass(frozen=True)
class Combined:
    """Mean of the channels with its standard uncertainty and degrees of freedom, and the findings from their differences.

    `scatter` is the part of the uncertainty that is the channels' own difference, which repeating the record does not reduce.
    """

    value: float
    uncertainty: float
    degrees_of_freedom: float
    misfit: Misfit = NO_MISFIT
    scatter: float = 0.0


def combine(
    values: ArrayLike,
    uncertainties: ArrayLike,
    common: ArrayLike,
    freedom: float,
    channels: Sequence[DigitizedChannel],
) -> Combined:
    """Return the mean of the channels' fluxes (C,), V·s/rad.

    `uncertainties` (C,) are each channel's own, `common` (C,) what may be the same in all, as the converter's steps are. Where the
    channels differ by more than both and the stated limits of gain explain, their scatter is in the mean's uncertainty (Student's t);
    where one contradicts the others there is no mean that would hold. Raises EstimationError for no channel.
    """
    v, own, shared = (np.atleast_1d(np.asarray(a, dtype=np.float64)) for a in (values, uncertainties, common))
    if not v.size:
        raise EstimationError("no channel to take the mean of; record one at least")
    mean = float(np.mean(v))
    internal = math.hypot(math.sqrt(float(np.sum(own**2))) / v.size, float(np.mean(shared)))
    plain = Combined(mean, internal, freedom)
    if v.size < 2:
        return plain
    factor = _contradicting(v, channels)
    if factor is not None:
        return Combined(mean, internal, freedom, Misfit((factor,)))
    limits = np.array([each.gain_limit for each in channels]) * v
    allowed = limits * (1.0 - 2.0 / v.size) + np.mean(limits)
    beyond = np.maximum(np.abs(v - mean) - allowed, 0.0)
    spread = np.maximum(np.hypot(own, shared), 1e-12 * abs(mean))
    chi = float(np.sum((beyond / spread) ** 2))
    told = chi > float(special.chdtri(v.size - 1, _CHANCE))
    # What may be chance or within the limits, and may be not: from their likely size on the whole scatter is in the interval as well.
    likely = 0.0 if told else float(np.mean(own**2 + limits**2 / 3.0))
    variance = float(np.var(v, ddof=1))
    scatter = math.sqrt(variance / v.size) if variance > likely else 0.0
    total = math.hypot(internal, scatter)
    # Two channels' difference has one degree of freedom; that it stayed below a contradiction is worth another.
    left = total**4 / (scatter**4 / max(v.size - 1.0, 2.0) + internal**4 / max(freedom, 1.0)) if total else freedom
    if not told:
        return Combined(mean, total, left, NO_MISFIT, scatter)
    finding = Finding(
        Cause.CHANNELS_DIFFER,
        Answer.WIDENED,
        (FLUX,),
        math.sqrt(chi),
        {
            "lowest": channels[int(np.argmin(v))].name,
            "highest": channels[int(np.argmax(v))].name,
            "difference": float(np.ptp(v) / mean),
        },
    )
    return Combined(mean, total, left, Misfit((finding,)), scatter)


def judged(combined: Combined, findings: Sequence[Finding]) -> Misfit:
    """Return all that is said of a record with these `findings` beside those of the channels' mean: of these, what has widened its interval
    until it says little withholds it.
    """
    low, high = coverage_interval(combined.value, combined.uncertainty, combined.degrees_of_freedom)
    if combined.value and math.isfinite(combined.uncertainty) and 0.5 * (high - low) > _MOST * abs(combined.value):
        wide = [f.answer is Answer.WIDENED and f.concerns(FLUX) for f in findings]
        findings = [replace(f, answer=Answer.WITHHELD) if w else f for w, f in zip(wide, findings, strict=True)]
    others = Misfit(tuple(findings))
    withholding = others.withholding(FLUX)
    # A channel that contradicts the others explains a record that nothing else does: it is told first.
    first = withholding is not None and withholding.cause is Cause.UNEXPLAINED and combined.misfit.withholding(FLUX)
    return Misfit.together((combined.misfit, others) if first else (others, combined.misfit))


def _contradicting(v: FloatArray, channels: Sequence[DigitizedChannel]) -> Finding | None:
    """Return the finding of a channel whose factor is not that of the others."""
    # Of two the smaller one is held against the other: a wrong factor takes away more often than it adds.
    middle = float(np.median(v)) if v.size > 2 else float(np.max(v))
    worst = int(np.argmax(np.abs(np.log(v / middle))))
    others = np.delete(v, worst)
    ratio = float(np.mean(others) / v[worst])
    if abs(1.0 / ratio - 1.0) <= _CONTRADICTS:
        return None
    near = max(_NEAR, float(np.ptp(others) / np.mean(others)), max(each.gain_limit for each in channels))
    usual = min(_USUAL, key=lambda size: abs(math.log(size / ratio)))
    figures: dict[str, float | str] = {
        "channel": channels[worst].name,
        "share": 1.0 / ratio,
        "factor": usual if abs(math.log(usual / ratio)) < near else ratio,
    }
    if 1.0 / ratio < _NONE:
        figures["record"] = "emf-none"
    elif figures["factor"] in (math.sqrt(3.0), 1.0 / math.sqrt(3.0)):
        figures["record"] = "emf-to-star" if ratio > 1.0 else "emf-to-line"
    return Finding(Cause.PROBE_FACTOR, Answer.WITHHELD, (FLUX,), 0.0, figures)
