"""A current step that is clipped at the end of a channel's range: the remaining part, and its fit."""

from dataclasses import replace

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray, WithheldError
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.winding.current_step.codes import clipped_at
from procedures.estimation.winding.current_step.fit import Fitted, Problem, fit_plain
from procedures.estimation.winding.current_step.record import StepRecord

#: Least and largest value that a converter gives, where known.
Ends = tuple[float, float] | None
#: Of a step whose top is cut off at least this share is left; samples count that the model puts so many standard deviations below.
_LEAST_SEEN, _CLEAR_OF_END, _CHOICES = 0.55, 4.0, 6
#: A top that an amplifier cuts off ahead of its noise explains the record better than terms by so much of χ², and leaves of it at most so
#: many times the noise's variance.
_BETTER, _AS_NOISE = 25.0, 1.3
#: Without a look at other causes a top is believed where the current would have gone on by this share, and no more than so many times the
#: noise's variance is left.
_GOES_ON, _CERTAIN = 0.03, 1.1
#: Last share of a record that lies on a flat top.
_ON_TOP = 8


def without_end(record: StepRecord, voltage_ends: Ends, current_ends: Ends) -> tuple[StepRecord, float] | None:
    """Return the record without the samples at the end of the current's range, and that end (A); None where it has none.

    Raises WithheldError where the voltage is cut off: what drove the circuit is not known then.
    """
    for name, values, resolution, ends in (
        ("voltage", record.voltage, record.voltage_resolution, voltage_ends),
        ("current", record.current, record.current_resolution, current_ends),
    ):
        upwards = float(np.mean(values[values.size // 2 :])) > float(np.mean(values[: record.edge]))
        end = None if ends is None else ends[1 if upwards else 0]
        level = clipped_at(values, record.resting, resolution, upwards, end)
        if level is None:
            continue
        if name == "voltage":
            raise withheld(name, level, 1.0)
        first = int(np.argmax(record.current >= level if upwards else record.current <= level))
        kept = (np.arange(values.size) < first).astype(np.float64)
        if first <= record.edge + 5:
            raise withheld(name, level, 1.0)
        return replace(record, kept=kept), level
    return None


def withheld(channel: str, level: float, lost: float) -> WithheldError:
    """Return what says that too little is left of a channel that is cut off at a level (V, A)."""
    figures: dict[str, float | str] = {"record": "step", "channel": channel, "level": level, "lost": lost}
    return WithheldError(
        f"the {channel} is cut off at {level:.4g}: too little of the step is left; use a wider range, or a smaller step",
        Misfit((Finding(Cause.CLIPPED, Answer.WITHHELD, figures=figures),)),
    )


def fit_unclipped(step: Problem, plain: Fitted, level: float) -> tuple[Problem, Fitted]:
    """Return the fit of what is not cut off, chosen by what the model gives and not by the readings, which would take their noise's side.

    Raises WithheldError where too little is left.
    """
    for _ in range(_CHOICES):
        record, offset = step.record, plain.full[2]
        whole, room = float(plain.current[-1]) - offset, level - offset
        if room / whole < _LEAST_SEEN:
            raise withheld("current", level, 1.0 - room / whole)
        margin = _CLEAR_OF_END * record.current_noise / abs(whole)
        kept = ((plain.current - offset) / whole < room / whole - margin).astype(np.float64)
        if np.sum(kept[record.edge :]) < 10:
            raise withheld("current", level, 1.0)
        unchanged = record.kept is not None and bool(np.all(kept == record.kept))
        step = replace(step, record=replace(record, kept=kept))
        step, plain = fit_plain(step, plain.full)
        if unchanged:
            break
    return step, plain


def fit_flat_top(
    step: Problem, plain: Fitted, explained: FloatArray | None = None
) -> tuple[Problem, Fitted, float] | None:
    """Return the fit of what lies below a top that is flat beneath its noise, and that level (A); None where the record has none.

    `explained` (n,) is the current (A) as the best model without a top has it; where that is not known, a top has to be certain. Raises
    WithheldError where too little lies below.
    """
    record = step.record
    level = float(np.mean(record.current[-(record.time.size // _ON_TOP) :]))
    up = float(np.sign(level - plain.full[2]))
    room = up * (level - record.current) > record.current_noise
    first = int(np.argmax(~room[record.edge :])) + record.edge
    if first <= record.edge + 10:
        return None
    below = replace(step, record=replace(record, kept=(np.arange(room.size) < first).astype(np.float64)))
    try:
        below, cut = fit_plain(below, plain.full)
    except EstimationError:
        return None
    best, left = (
        float(np.sum((record.current - model) ** 2)) / record.current_noise**2
        for model in (plain.current if explained is None else explained, up * np.minimum(up * cut.current, up * level))
    )
    goes_on = float(cut.current[-1] - level) / (level - cut.full[2])
    certain = goes_on > _GOES_ON and left <= _CERTAIN * room.size
    if best - left < _BETTER or left > _AS_NOISE * room.size or (explained is None and not certain):
        return None
    return *fit_unclipped(below, cut, level), level
