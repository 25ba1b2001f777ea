"""Checks that the results of a procedure are numbers within the bounds of their parameters."""

import math
from collections.abc import Iterable

from drivers.interfaces.text import Text, text
from procedures.core.procedure_error import ProcedureError
from procedures.core.result import Parameter, Withheld

#: The cause of a figure that is withheld because it lies where none can be.
OUT_OF_BOUNDS = "out-of-bounds"


def possible(parameters: Iterable[Parameter]) -> tuple[list[Parameter], list[Withheld]]:
    """Return the parameters whose interval reaches into their definition's bounds, and the others as withheld.

    Raises ProcedureError for a value or an uncertainty that is no number.
    """
    kept: list[Parameter] = []
    withheld: list[Withheld] = []
    for each in parameters:
        if not math.isfinite(each.value) or math.isnan(each.standard_uncertainty):
            raise ProcedureError(
                text(
                    "the result for {label} is {value:g} ± {uncertainty:g}, which is not a finite number: check "
                    "the readings in the journal",
                    label=each.label,
                    value=each.value,
                    uncertainty=each.standard_uncertainty,
                )
            )
        message = _outside(each)
        if message is None:
            kept.append(each)
        else:
            withheld.append(Withheld(each.name, each.procedure, each.section, OUT_OF_BOUNDS, message, each.definition))
    return kept, withheld


def _outside(parameter: Parameter) -> Text | None:
    if parameter.definition is None:
        return None
    bounds, (low, high) = parameter.definition.bounds, parameter.coverage_interval
    below = high < bounds.low or (bounds.open and high <= bounds.low)
    if not below and (bounds.high is None or low <= bounds.high):
        return None
    return text(
        "it would be {value:.4g} {unit}, and its whole interval lies {side} {bound:g} {unit}, outside the "
        "possible range: check for interchanged leads, a wrong sign, an offset or a wrong unit",
        value=parameter.value,
        unit=parameter.unit,
        side=text("below") if below else text("above"),
        bound=bounds.low if below else bounds.high,
    )
