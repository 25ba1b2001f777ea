"""A plot as data: what stands on its axes, and in which manner each curve is to be told from the others."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces.text import Text

FloatArray = NDArray[np.float64]


class Manner(Enum):
    """How a curve is drawn; they differ in line and mark, so that black and white will do."""

    READING = "reading"
    RECORD = "record"
    BROAD = "broad"
    FIT = "fit"
    SECOND = "second"
    THIRD = "third"
    RESIDUAL = "residual"


@dataclass(frozen=True)
class PlotCurve:
    """One curve: x and y of shape (n,) in the axes' units before scaling (SI)."""

    name: Text
    x: FloatArray
    y: FloatArray
    manner: Manner


@dataclass(frozen=True)
class Axes:
    """One pair of axes; labels without units, units in SI."""

    x_label: Text
    x_unit: str
    y_label: Text
    y_unit: str
    curves: Sequence[PlotCurve]
    x_from_zero: bool = False
    y_from_zero: bool = False


@dataclass(frozen=True)
class Plot:
    """Axes in rows; `heights` are the rows' shares. `name` is unique in a report, `caption` says what is seen."""

    name: str
    caption: Text
    rows: Sequence[Sequence[Axes]]
    heights: Sequence[float] = field(default_factory=lambda: (1.0,))
