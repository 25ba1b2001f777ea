"""The quality of many motors' figures: the widths of their intervals, and how often they hold the true value."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from bench.eol.statistics.proportion import Proportion, proportion
from bench.study.motors import StudiedFigure, StudiedMotor


@dataclass(frozen=True)
class FigureQuality:
    """One parameter by one procedure over all motors.

    `expanded` is the mean half-width of the 95 % intervals and `bias` the mean error, both relative to the truth, or in the
    parameter's unit where the truth is zero; `held` counts the intervals that hold it, `farthest` is the largest error over its
    half-width, `withheld` how many were not given.
    """

    parameter: str
    procedure: str
    expanded: float
    bias: float
    held: Proportion
    farthest: float
    withheld: int


@dataclass(frozen=True)
class StudyQuality:
    """The quality of the figures of `motors` motors; `refused` counts by procedure and reason. `complete` unless somebody stopped
    it.
    """

    motors: int
    complete: bool
    figures: tuple[FigureQuality, ...]
    refused: tuple[tuple[str, str, int], ...]

    def as_dict(self) -> dict[str, Any]:
        """Return it in JSON's types; what is no number is null."""
        content = asdict(self)
        for row in content["figures"]:
            share = row["held"]
            share |= {"share": _finite(share["share"]), "interval": [_finite(end) for end in share["interval"]]}
            row |= {name: _finite(row[name]) for name in ("expanded", "bias", "farthest")}
        return content


def worth_of(motors: Iterable[StudiedMotor], planned: int) -> StudyQuality:
    """Return the sums over motors, in the order of their numbers, whoever measured them."""
    measured = sorted(motors, key=lambda motor: motor.number)
    by_figure = defaultdict[tuple[str, str], list[StudiedFigure]](list)
    refused = Counter[tuple[str, str]]()
    for motor in measured:
        for figure in motor.figures:
            by_figure[figure.parameter, figure.procedure].append(figure)
        refused.update(motor.refused)
    return StudyQuality(
        len(measured),
        len(measured) == planned,
        tuple(_worth(*key, figures) for key, figures in sorted(by_figure.items())),
        tuple((procedure, why, count) for (procedure, why), count in sorted(refused.items())),
    )


def _worth(parameter: str, procedure: str, figures: list[StudiedFigure]) -> FigureQuality:
    given = [figure for figure in figures if not math.isnan(figure.value)]
    halves = [0.5 * (figure.high - figure.low) for figure in given]
    errors = [figure.value - figure.truth for figure in given]
    scales = [abs(figure.truth) or 1.0 for figure in given]
    held = sum(figure.low <= figure.truth <= figure.high for figure in given)
    over = [
        abs(error) / half if half else (math.inf if error else 0.0) for error, half in zip(errors, halves, strict=True)
    ]
    return FigureQuality(
        parameter,
        procedure,
        _mean([half / scale for half, scale in zip(halves, scales, strict=True)]),
        _mean([error / scale for error, scale in zip(errors, scales, strict=True)]),
        proportion(held, len(given)),
        max(over, default=math.nan),
        len(figures) - len(given),
    )


def _mean(values: list[float]) -> float:
    return math.fsum(values) / len(values) if values else math.nan


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
