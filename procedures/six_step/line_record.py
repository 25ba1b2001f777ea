"""One line's current at a load, folded from its record."""

from typing import Protocol

import numpy as np

from drivers.interfaces.text import text
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.six_step import currents as six_step
from procedures.six_step.figures import FigureTeller


class LineRecord(Protocol):
    """A record of a line's current (A) over time (s), with its `resolution` (A), and whether it reached an end of its range."""

    @property
    def time(self) -> FloatArray:
        """The times."""

    @property
    def values(self) -> FloatArray:
        """The currents."""

    @property
    def resolution(self) -> float:
        """One step of the converter."""

    @property
    def clipped(self) -> bool:
        """Whether readings reached an end of the range."""


def separated_line(
    teller: FigureTeller, torque: float, wave: LineRecord, frequency: float
) -> six_step.LineCurrent | None:
    """Return the line's current folded by its frequency (Hz), or None, told of the load (N·m), where it is cut off, or does not show when
    it is switched on.
    """
    if wave.clipped:
        lost = float(np.mean(np.abs(wave.values) >= np.max(np.abs(wave.values)) - wave.resolution))
        figures: dict[str, float | str] = {"torque": torque, "lost": lost, "record": "six-step"}
        teller.tell_misfit(Misfit((Finding(Cause.CLIPPED, Answer.MODELLED, figures=figures),)))
        return None
    try:
        return six_step.fold(wave.time, wave.values, frequency)
    except EstimationError as problem:
        teller.notice(
            "not-separated",
            text("at {torque:.3g} N·m the parts cannot be separated: {problem}", torque=torque, problem=str(problem)),
        )
    return None
