"""Loss of a steady alternating voltage in an AC-coupled channel, which the record itself cannot show."""

import math
from collections.abc import Sequence

from procedures.estimation.fitting.misfit import Answer, Cause, Finding

#: Corner of oscilloscopes' AC coupling (Hz): data sheets state 3.5 … 10, none a higher one.
_CORNER = 10.0
#: What is at most widened for; beyond, the reading says too little.
_MOST = 0.05


def shortfall(frequency: float) -> float:
    """Return by what share the true value may exceed a reading at a frequency (Hz), because of the corner frequency of the coupling."""
    return math.hypot(1.0, _CORNER / frequency) - 1.0


def coupling_finding(frequency: float, channels: Sequence[str], *, stated: bool) -> Finding | None:
    """Return what is told of channels that are AC coupled, or may be (not `stated`), at a frequency (Hz); None where a wider interval
    says it all.
    """
    most = shortfall(frequency)
    if most <= _MOST and not stated:
        return None
    figures: dict[str, float | str] = {"channels": ", ".join(channels), "frequency": frequency, "shortfall": most}
    answer = Answer.WITHHELD if most > _MOST else Answer.WIDENED
    return Finding(Cause.AC_COUPLED, answer, ("flux_linkage",), 0.0, figures)
