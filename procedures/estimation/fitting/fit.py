"""Results of estimators, and the error that is raised if the data do not determine the estimate."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import special

from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit

FloatArray = NDArray[np.float64]


class EstimationError(ValueError):
    """The data do not determine the estimate; the message says what is wrong with them and what to do."""


class WithheldError(EstimationError):
    """No estimate is given for a cause that has a name: `misfit` says which."""

    def __init__(self, message: str, misfit: Misfit) -> None:
        super().__init__(message)
        self.misfit = misfit


@dataclass(frozen=True)
class Fit:
    """Least-squares estimates with their covariance (Type A: from the scatter of the data, and their resolution).

    `names` and `values` (shape (k,)), `covariance` (k, k), `degrees_of_freedom` of the variances,
    `residuals` (measured minus fitted, in the data's unit) and `residual_rms` (their rms); `misfit` is what they show beyond the model.
    """

    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    degrees_of_freedom: float
    residuals: FloatArray
    residual_rms: float
    misfit: Misfit = field(default=NO_MISFIT, kw_only=True)

    def _index(self, name: str) -> int:
        try:
            return self.names.index(name)
        except ValueError:
            raise KeyError(f"no parameter '{name}' in this fit; it has {', '.join(self.names)}") from None

    def value(self, name: str) -> float:
        """Return the estimate of a parameter. Raises KeyError for an unknown name."""
        return float(self.values[self._index(name)])

    def uncertainty(self, name: str) -> float:
        """Return the standard uncertainty of a parameter, in its unit. Raises KeyError for an unknown name."""
        index = self._index(name)
        return float(np.sqrt(max(self.covariance[index, index], 0.0)))

    def correlation(self, a: str, b: str) -> float:
        """Return the correlation coefficient of two parameters; 0 where one of them has no uncertainty."""
        product = self.uncertainty(a) * self.uncertainty(b)
        return float(self.covariance[self._index(a), self._index(b)]) / product if product > 0 else 0.0

    def interval(self, name: str, coverage: float = 0.95) -> tuple[float, float]:
        """Return the coverage interval of a parameter by Student's t."""
        return coverage_interval(self.value(name), self.uncertainty(name), self.degrees_of_freedom, coverage)

    def derived(self, names: Sequence[str], values: Sequence[float], jacobian: FloatArray) -> "Fit":
        """Return quantities computed from these estimates; `jacobian` (m, k) holds their derivatives."""
        return Fit(
            tuple(names),
            np.asarray(values, dtype=np.float64),
            jacobian @ self.covariance @ jacobian.T,
            self.degrees_of_freedom,
            self.residuals,
            self.residual_rms,
            misfit=self.misfit,
        )


def coverage_interval(
    value: float, uncertainty: float, degrees_of_freedom: float, coverage: float = 0.95
) -> tuple[float, float]:
    """Return the interval that covers the true value with the given probability, by Student's t (GUM G.3)."""
    quantile = 0.5 * (1.0 + coverage)
    factor = (
        special.stdtrit(degrees_of_freedom, quantile) if np.isfinite(degrees_of_freedom) else special.ndtri(quantile)
    )
    return value - float(factor) * uncertainty, value + float(factor) * uncertainty
