"""Sensitivity of estimates to an error of the readings, by repeated estimation (GUM, JCGM 100, 5.1.4, note 2)."""

from collections.abc import Callable, Sequence

from bench.i18n.errors import InputError
from drivers.interfaces.text import text
from procedures.estimation.fitting.fit import EstimationError, Fit

#: Changes below this share of the estimate's own uncertainty are the solver's, not the error's.
_NEGLIGIBLE = 1e-3


def half_differences(fit: Fit, names: Sequence[str], again: Callable[[float], Fit], what: str) -> dict[str, float]:
    """Return by how much each estimate named changes with an error at its limit; `again` fits with that error times its
    argument.

    `what` names the error. Raises InputError where readings that far off leave no estimate.
    """
    try:
        above, below = again(1.0), again(-1.0)
    except EstimationError as error:
        raise InputError(
            text(
                "accuracy of {what}: readings with an error of that size give no estimate: {error}",
                what=what,
                error=error,
            )
        ) from error
    changes = {name: 0.5 * (above.value(name) - below.value(name)) for name in names}
    return {name: by if abs(by) > _NEGLIGIBLE * fit.uncertainty(name) else 0.0 for name, by in changes.items()}
