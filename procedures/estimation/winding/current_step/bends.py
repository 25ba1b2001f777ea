"""Where a fit of a current channel that bends begins."""

import numpy as np

from procedures.estimation.winding.current_step.fit import Fitted, Problem
from procedures.estimation.winding.current_step.saturation import BentChannel
from procedures.estimation.winding.current_step.term import StepModel, StepScale

#: Powers that are tried first, and the least and the most that a fit begins with of a bend.
_POWERS = (1.2, 2.0, 3.5, 6.0, 10.0, 16.0)
_LEAST, _MOST = 0.01, 0.15


def bend_in(step: Problem, fitted: Fitted, scale: StepScale) -> BentChannel:
    """Return the bend from which a fit is to begin, of a channel that reads too little, beside the terms of another fit.

    From no bend at all a fit does not find its power. What each power would explain follows from the derivatives.
    """
    flowing = StepModel(step.record, fitted.terms, scale).unread(fitted.current, fitted.full, fitted.figures)
    share = np.where(np.arange(flowing.size) < step.record.edge - 1, 0.0, flowing / scale.current)
    rows = np.array([-scale.current * share * np.abs(share) ** power for power in _POWERS])
    white = np.zeros((len(rows), fitted.residuals.size))
    white[:, : step.record.time.size] = step.white.apply(rows)
    held = np.linalg.qr(fitted.slopes.T)[0]
    across = white - (white @ held) @ held.T
    squares = np.maximum(np.sum(across**2, axis=1), 1e-300)
    bends = across @ fitted.residuals / squares
    best = int(np.argmax(bends * np.abs(bends) * squares))
    return BentChannel(_POWERS[best], (float(np.clip(bends[best], _LEAST, _MOST)), 0.0))
