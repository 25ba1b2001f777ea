"""Detects speed readings of few pulses: constant and then a jump, or a few whole steps."""

from collections.abc import Sequence

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from procedures.estimation.mechanics.turning import Run

#: From so many readings of one value in a row on a speed stands still between its jumps.
_STANDS = 3.0
#: Steps of less than this share of the top speed are not told: their scatter is in the intervals.
_TOLD = 0.03


def held_readings(runs: Sequence[Run], speeds: FloatArray) -> Finding | None:
    """Return why no figure is given of ramps whose readings stand still, None where that does not explain what the fit leaves.

    `speeds` (n,) are those of the fit (rad/s). What is left of readings that are held between their jumps is no more than those.
    """
    left, jumps, readings, seconds = [], [], 0, 0.0
    begin = 0
    for run in runs:
        changes = np.diff(run.speed)
        left.append(run.speed - speeds[begin : begin + run.speed.size])
        jumps.append(changes[changes != 0.0])
        begin += run.speed.size
        readings += run.speed.size
        seconds += float(run.time[-1])
    steps = np.concatenate(jumps)
    stay = readings / (len(runs) + steps.size)
    if not steps.size or stay < _STANDS or np.mean(np.concatenate(left) ** 2) > np.mean(steps**2):
        return None
    figures: dict[str, float | str] = {
        "record": "ramp",
        "readings": stay,
        "time": seconds * stay / readings,
        "step": float(np.median(np.abs(steps))),
    }
    return Finding(Cause.TOO_COARSE, Answer.WITHHELD, figures=figures)


def counted_pulses(runs: Sequence[Run], top: float) -> list[Finding]:
    """Return that speeds are a few counted pulses each, where their steps are a good part of the top speed (rad/s)."""
    step = max(run.counted for run in runs)
    figures: dict[str, float | str] = {"record": "ramp-counted", "step": step, "top": top}
    return [Finding(Cause.TOO_COARSE, Answer.MODELLED, figures=figures)] if step > _TOLD * top else []
