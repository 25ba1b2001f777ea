"""Readings of a voltage over a current that were taken before both had settled."""

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit

#: Lines change alike where chance alone makes them do so in this share of records.
_CHANCE = 1e-3
#: What chance makes of the square of a score that nothing is behind, and this much more, does not count.
_OF_CHANCE = 2.5
#: What is missing at a reading, over its change until as long again has passed: of an exponential rise with up to a third missing.
_MISSING = 1.5
#: Beyond this share no figure is given.
_MOST = 0.05


def unsettled(ratios: ArrayLike, flows: ArrayLike, scatter: float, degrees_of_freedom: float) -> tuple[float, Misfit]:
    """Return by how much (relative, a limit) resistances may be off because their readings had not settled, and what is said of it.

    `ratios` (n,) are the changes of voltage over current (relative) from a reading to one after the current had flowed twice as long;
    `flows` (n,) is by how much the current changed from its own reading to the voltage's. `scatter` is the standard deviation of one
    ratio by chance, known with so many degrees of freedom. As what does not settle errs alike at all currents, no line through them
    shows it.
    """
    ratio, flow = (np.asarray(each, dtype=np.float64) for each in (ratios, flows))
    if not ratio.size or not scatter > 0.0 or not degrees_of_freedom > 0.0:
        return 0.0, NO_MISFIT
    # The current is read twice, each time about as well as the ratio, and only a part of its change counts.
    means = float(np.mean(ratio)), float(np.mean(flow))
    score = max(abs(mean) for mean in means) * np.sqrt(ratio.size) / (np.sqrt(2.0) * scatter)
    off = _MISSING * max(abs(mean) for mean in means)
    limit = float(special.stdtrit(degrees_of_freedom, 1.0 - 0.25 * _CHANCE))
    if score <= limit:
        return off * max(0.0, 1.0 - _OF_CHANCE / max(score, 1e-9) ** 2), NO_MISFIT
    figures: dict[str, float | str] = {"record": "four-wire-settling", "ratio": means[0], "flow": means[1]}
    answer = Answer.WITHHELD if off > _MOST else Answer.WIDENED
    return off, Misfit((Finding(Cause.UNSETTLED, answer, score=float(score), figures=figures),))
