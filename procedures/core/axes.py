"""Plots as data: what is shown, in which units, and how curves are distinguished."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, TypeAlias

from drivers.interfaces.text import Text

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: Whoever only passes curves on, such as the guardian, loads no NumPy.
FloatArray: TypeAlias = "NDArray[np.float64]"


class CurveStyle(Enum):
    """Styles of a curve; they differ in line and mark, so that black and white will do."""

    READING = "reading"
    TO_COME = "to come"
    RECORD = "record"
    BROAD = "broad"
    FIT = "fit"
    SECOND = "second"
    THIRD = "third"
    RESIDUAL = "residual"
    BARS = "bars"


@dataclass(frozen=True)
class PlotCurve:
    """One curve: x and y of shape (n,) in the axes' units before scaling (SI)."""

    name: Text
    x: FloatArray
    y: FloatArray
    manner: CurveStyle


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
