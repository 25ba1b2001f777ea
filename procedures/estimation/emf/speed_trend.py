"""Flux linkage over several speeds: whether it depends on the speed, by which law, and its value without that (§3.4.3)."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from procedures.estimation.emf.agreement import Combined
from procedures.estimation.fitting.checks import same_length, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.fitting.repeats import mean_of_estimates

#: Laws that a flux linkage follows over frequency, by how they are written; the last has no value that is free of the speed.
_LAWS: tuple[tuple[str, Callable[[FloatArray], FloatArray], bool], ...] = (
    ("f²", np.square, True),
    ("f", np.positive, True),
    ("√f", np.sqrt, True),
    ("1/f", np.reciprocal, True),
    ("1/f²", lambda f: f**-2.0, True),
    ("ln f", np.log, False),
)
#: A trend is seen where chance gives it in three of a thousand; a law is accepted where chance leaves as much in one of twenty.
_CHANCE, _ACCEPTED = 3e-3, 0.05
#: Differences within the stated limits of gain are a trend where a law's slope is beyond what it leaves, by chance so rarely.
_DESPITE_LIMITS = 1e-3
#: A law that leaves so little more than the best one is its rival.
_RIVAL = 12.0
#: From so many speeds on a law's intercept is believed.
_ENOUGH = 5
#: Where the laws' intercepts stay so near the mean, or within the stated limits of gain, the interval holds them all.
_NEAR = 0.01


@dataclass(frozen=True)
class Law:
    """One law λ = `value` + slope·g(f): its intercept with `uncertainty`, how far beyond chance its `slope` is (standard deviations),
    what it leaves, `chi_squared`, and the probability of that, `p_value`.
    """

    name: str
    value: float
    uncertainty: float
    slope: float
    chi_squared: float
    p_value: float
    has_value: bool

    @property
    def accepted(self) -> bool:
        """True if the residuals of the trend are explained by chance."""
        return self.p_value > _ACCEPTED


@dataclass(frozen=True)
class OverSpeeds:
    """Flux linkage from several speeds with standard uncertainty and degrees of freedom; `law` by which it was referred to no speed,
    empty where it is a mean; `p_value` of the differences being chance, the `laws` that were tried, and the misfit.
    """

    value: float
    uncertainty: float
    degrees_of_freedom: float
    p_value: float
    law: str = ""
    laws: tuple[Law, ...] = ()
    misfit: Misfit = NO_MISFIT


def over_speeds(
    frequencies: ArrayLike,
    values: ArrayLike,
    uncertainties: ArrayLike,
    *,
    common: float = 0.0,
    common_freedom: float = 2.0,
    gain_limit: float = 0.0,
) -> OverSpeeds:
    """Return one flux linkage from those at several electrical frequencies (Hz), with their own standard uncertainties, (N,).

    `common` is a standard uncertainty that all of them share, with its degrees of freedom, as channels that differ have it; `gain_limit`
    is the stated limit of gain: a range is changed between speeds, and differences within it are expected, unless they follow a law
    over five speeds and more. Raises EstimationError where nothing is given, or values are no numbers.
    """
    over = _of_their_own(frequencies, values, uncertainties, gain_limit)
    if not common:
        return over
    total = math.hypot(over.uncertainty, common)
    freedom = total**4 / (common**4 / common_freedom + over.uncertainty**4 / max(over.degrees_of_freedom, 1.0))
    return replace(over, uncertainty=total, degrees_of_freedom=freedom)


def over_records(frequencies: ArrayLike, records: Sequence[Combined], *, gain_limit: float = 0.0) -> OverSpeeds:
    """Return one flux linkage from records (V·s/rad) at several electrical frequencies (Hz); see `over_speeds`."""
    scatter = [record.scatter for record in records]
    return over_speeds(
        frequencies,
        [record.value for record in records],
        [math.sqrt(max(record.uncertainty**2 - record.scatter**2, 0.0)) for record in records],
        common=max(scatter),
        common_freedom=records[int(np.argmax(scatter))].degrees_of_freedom,
        gain_limit=gain_limit,
    )


def _of_their_own(frequencies: ArrayLike, values: ArrayLike, uncertainties: ArrayLike, gain_limit: float) -> OverSpeeds:
    f, v, u = (
        series(n, a) for n, a in (("frequencies", frequencies), ("values", values), ("uncertainties", uncertainties))
    )
    same_length(frequencies=f, values=v, uncertainties=u)
    if np.any(f <= 0.0):
        raise EstimationError("a frequency is not above 0 Hz; give the electrical frequency of each record")
    mean, spread, freedom = mean_of_estimates([float(x) for x in v], [float(x) for x in u])
    if v.size < 2 or np.any(u <= 0.0):
        return OverSpeeds(mean, spread, freedom, 1.0)
    weighted = float(np.sum(v / u**2) / np.sum(u**-2.0))
    p_value = float(special.chdtrc(v.size - 1, np.sum(((v - weighted) / u) ** 2)))
    apart = float(np.max(np.abs(v / weighted - 1.0)))
    distinct = np.unique(np.round(np.log(f), 2)).size
    if distinct < 2:
        return OverSpeeds(mean, spread, freedom, p_value)
    laws = tuple(_law(name, shape, with_value, f, v, u) for name, shape, with_value in _LAWS)
    if apart <= gain_limit and not (
        p_value <= _CHANCE and distinct >= _ENOUGH and any(_despite_limits(law, v.size) for law in laws)
    ):
        return OverSpeeds(mean, spread, freedom, p_value)
    if p_value > _CHANCE:
        # A trend that is not seen may be there as far as its slope exceeds chance.
        hidden = [(law.value - mean) ** 2 * (1.0 - 1.0 / max(law.slope**2, 1.0)) for law in laws if law.has_value]
        return OverSpeeds(mean, math.hypot(spread, math.sqrt(max(hidden))), freedom, p_value)
    accepted = [law for law in laws if law.accepted and v.size > 2]
    best = min(law.chi_squared for law in laws)
    rivals = [law for law in laws if law.chi_squared < best + _RIVAL]
    figures: dict[str, float | str] = {
        "span": float(np.ptp(v) / weighted),
        "slowest": float(np.min(f)),
        "fastest": float(np.max(f)),
        "laws": ", ".join(law.name for law in accepted) or "–",
    }
    score = math.sqrt(float(np.sum(((v - weighted) / u) ** 2)))

    def found(answer: Answer) -> Misfit:
        return Misfit((Finding(Cause.SPEED_TREND, answer, ("flux_linkage",), score, figures),))

    if distinct >= _ENOUGH and len(rivals) == 1 and rivals[0].accepted and rivals[0].has_value:
        law = rivals[0]
        return OverSpeeds(
            law.value, law.uncertainty, float(v.size - 2), p_value, law.name, laws, found(Answer.MODELLED)
        )
    reached = [abs(law.value - mean) + 2.0 * law.uncertainty for law in laws if law.has_value]
    farthest = max(*reached, float(np.max(np.abs(v - mean))))
    answer = Answer.WIDENED if farthest <= max(_NEAR, gain_limit) * abs(mean) else Answer.WITHHELD
    return OverSpeeds(mean, math.hypot(spread, farthest / math.sqrt(3.0)), math.inf, p_value, "", laws, found(answer))


def _despite_limits(law: Law, count: int) -> bool:
    """Return whether a law's slope stands out from what it leaves of `count` figures, as it does not where each range errs by itself."""
    left = max(law.chi_squared / (count - 2), 1.0)
    return float(special.fdtrc(1, count - 2, law.slope**2 / left)) < _DESPITE_LIMITS


def _law(
    name: str,
    shape: Callable[[FloatArray], FloatArray],
    has_value: bool,
    f: FloatArray,
    v: FloatArray,
    u: FloatArray,
) -> Law:
    along = shape(f / float(np.exp(np.mean(np.log(f)))))
    design = np.array((np.ones_like(f), along)) / u
    inverse = np.linalg.inv(design @ design.T)
    values = inverse @ design @ (v / u)
    left = float(np.sum((v / u - values @ design) ** 2))
    p_value = float(special.chdtrc(v.size - 2, left)) if v.size > 2 else 1.0
    slope = float(values[1] / math.sqrt(inverse[1, 1]))
    return Law(name, float(values[0]), math.sqrt(float(inverse[0, 0])), slope, left, p_value, has_value)
