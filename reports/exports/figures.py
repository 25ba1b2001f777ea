"""A figure of an export."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class ExportFigure:
    """A quantity's value in its unit, with standard uncertainty and 95 % coverage interval; `exact` ones have none."""

    value: float
    standard_uncertainty: float = 0.0
    coverage_interval: tuple[float, float] = (math.nan, math.nan)
    exact: bool = False
