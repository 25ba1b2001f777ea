"""Studies of a gauge besides the crossed one: type 1 (Cg, Cgk), range method, linearity."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bench.eol.limits import ParameterLimits
from bench.eol.statistics.capability import of_moments

#: Share of the tolerance that a gauge may use up in a type-1 study, and the fewest repetitions.
_SHARE, FEWEST = 0.2, 10
#: Mean and standard deviation of the range of 2, 3 … 10 normal values, in their standard deviations (AIAG, MSA, 4th ed., appendix C).
_D2 = (1.12838, 1.69257, 2.05875, 2.32593, 2.53441, 2.70436, 2.84720, 2.97003, 3.07751)
_D3 = (0.85250, 0.88837, 0.87981, 0.86408, 0.84804, 0.83321, 0.81983, 0.80783, 0.79705)


@dataclass(frozen=True)
class TypeOneStudy:
    """One part of known value, measured again and again: Cg of the repeatability, Cgk of repeatability and bias."""

    count: int
    reference: float
    mean: float
    standard_deviation: float
    bias: float
    bias_interval: tuple[float, float]
    cg: float
    cg_interval: tuple[float, float]
    cgk: float
    cgk_interval: tuple[float, float]


@dataclass(frozen=True)
class RangeStudy:
    """R&R by the range method: every appraiser measures every part once, so that its two components are not told apart."""

    grr: float
    grr_interval: tuple[float, float]
    mean_range: float
    share: float


@dataclass(frozen=True)
class ReferenceBias:
    """The mean bias at one reference value, with its interval."""

    reference: float
    count: int
    bias: float
    interval: tuple[float, float]


@dataclass(frozen=True)
class Linearity:
    """A straight line through the bias over the reference value: slope and intercept with intervals and t, and R²."""

    slope: float
    slope_interval: tuple[float, float]
    slope_t: float
    intercept: float
    intercept_interval: tuple[float, float]
    intercept_t: float
    standard_deviation: float
    r_squared: float
    biases: tuple[ReferenceBias, ...]

    @property
    def acceptable(self) -> bool:
        """Tell whether neither slope nor intercept is certain to be other than zero (AIAG, MSA, 4th ed., III B)."""
        return all(low <= 0.0 <= high for low, high in (self.slope_interval, self.intercept_interval))


def type_one(values: ArrayLike, reference: float, tolerance: float, confidence: float = 0.95) -> TypeOneStudy:
    """Return Cg = 0.2 T/6 s and Cgk = (0.1 T − |bias|)/3 s (ISO 22514-7, type-1 study), with intervals.

    They are the capability indices of limits 0.1 T to either side of the reference. Raises ValueError for fewer than ten values,
    and for a tolerance that is none.
    """
    from scipy.special import stdtrit

    data = np.asarray(values, dtype=np.float64)
    if data.size < FEWEST or not np.isfinite(data).all():
        raise ValueError(f"a type-1 study needs {FEWEST} values of one part at least, not {data.size}")
    if not (tolerance > 0.0 and math.isfinite(tolerance)):
        raise ValueError("a type-1 study needs limits on both sides")
    half = 0.5 * _SHARE * tolerance
    mean, spread = float(data.mean()), float(data.std(ddof=1))
    found = of_moments(data.size, mean, spread, ParameterLimits(reference - half, reference + half), confidence)
    bias = mean - reference
    reach = float(stdtrit(data.size - 1, 0.5 + confidence / 2.0)) * spread / math.sqrt(data.size)
    return TypeOneStudy(
        int(data.size),
        reference,
        mean,
        spread,
        bias,
        (bias - reach, bias + reach),
        found.cp,
        found.cp_interval,
        found.cpk,
        found.cpk_interval,
    )


def range_study(values: ArrayLike, *, whole: float, confidence: float = 0.95) -> RangeStudy:
    """Return R&R of `values`, shape (appraisers, parts), from the mean range over the appraisers (AIAG, MSA, 4th ed., III B).

    `share` is R&R over `whole`, the process's standard deviation or a sixth of the tolerance. Raises ValueError for another shape.
    """
    from scipy.special import chdtri

    data = np.asarray(values, dtype=np.float64)
    if data.ndim != 2 or not 2 <= data.shape[0] <= 10 or data.shape[1] < 2 or not np.isfinite(data).all():
        raise ValueError(f"the range method needs 2 to 10 appraisers × 2 parts at least, not {data.shape}")
    appraisers, parts = data.shape
    d2, d3 = _D2[appraisers - 2], _D3[appraisers - 2]
    mean_range = float(np.ptp(data, axis=0).mean())
    grr = mean_range / math.sqrt(d2**2 + d3**2 / parts)
    freedom = parts * d2**2 / (2.0 * d3**2)
    low, high = (
        grr * math.sqrt(freedom / float(chdtri(freedom, p))) for p in (0.5 - confidence / 2, 0.5 + confidence / 2)
    )
    return RangeStudy(grr, (low, high), mean_range, grr / whole if whole > 0.0 else math.nan)


def linearity(references: ArrayLike, values: ArrayLike, confidence: float = 0.95) -> Linearity:
    """Return the linearity of a gauge from parts of known value (AIAG, MSA, 4th ed., III B); both arrays of shape (n,).

    Raises ValueError for fewer than two different references, or three values.
    """
    from scipy.special import stdtrit

    x, bias = np.asarray(references, dtype=np.float64), np.asarray(values, dtype=np.float64)
    bias = bias - x
    if x.size < 3 or np.unique(x).size < 2 or not np.isfinite(bias).all():
        raise ValueError("linearity needs two parts of different known values, and three values at least")
    off = x - x.mean()
    lever = float((off**2).sum())
    slope = float((off * bias).sum()) / lever
    intercept = float(bias.mean()) - slope * float(x.mean())
    rest = bias - intercept - slope * x
    freedom = x.size - 2
    spread = math.sqrt(float((rest**2).sum()) / freedom)
    of_slope = spread / math.sqrt(lever)
    of_intercept = spread * math.sqrt(1.0 / x.size + float(x.mean()) ** 2 / lever)
    t = float(stdtrit(freedom, 0.5 + confidence / 2.0))
    whole = float(((bias - bias.mean()) ** 2).sum())
    return Linearity(
        slope=slope,
        slope_interval=(slope - t * of_slope, slope + t * of_slope),
        slope_t=_t(slope, of_slope),
        intercept=intercept,
        intercept_interval=(intercept - t * of_intercept, intercept + t * of_intercept),
        intercept_t=_t(intercept, of_intercept),
        standard_deviation=spread,
        r_squared=1.0 - float((rest**2).sum()) / whole if whole > 0.0 else math.nan,
        biases=tuple(_bias(float(each), bias[x == each], confidence) for each in np.unique(x)),
    )


def _t(value: float, error: float) -> float:
    return value / error if error > 0.0 else math.copysign(math.inf, value) if value else math.nan


def _bias(reference: float, biases: "np.typing.NDArray[np.float64]", confidence: float) -> ReferenceBias:
    from scipy.special import stdtrit

    mean = float(biases.mean())
    if biases.size < 2:
        return ReferenceBias(reference, int(biases.size), mean, (math.nan, math.nan))
    half = float(stdtrit(biases.size - 1, 0.5 + confidence / 2.0)) * float(biases.std(ddof=1)) / math.sqrt(biases.size)
    return ReferenceBias(reference, int(biases.size), mean, (mean - half, mean + half))
