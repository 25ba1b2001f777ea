"""Checks that the results of a procedure are numbers within the bounds of their parameters."""

import math
from collections.abc import Iterable

from drivers.interfaces.text import Text, text
from procedures.core.procedure_error import ProcedureError
from procedures.core.result import Notice, Parameter, Withheld
from procedures.plausibility.sizes import IMPLAUSIBLE, TOO_UNCERTAIN, UNUSUAL, size_beyond, size_unusual, too_uncertain

#: The cause of a figure that is withheld because it lies where none can be.
OUT_OF_BOUNDS = "out-of-bounds"


def possible(parameters: Iterable[Parameter]) -> tuple[list[Parameter], list[Withheld]]:
    """Return the parameters whose interval reaches into their definition's bounds, whose size a motor may have and whose interval tells
    something, the others as withheld.

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
        cause, message = OUT_OF_BOUNDS, _outside(each)
        if message is None:
            cause, message = IMPLAUSIBLE, _beyond(each)
        if message is None:
            cause, message = TOO_UNCERTAIN, too_uncertain(each.name, each.value, each.coverage_interval, each.unit)
        if message is None:
            kept.append(each)
        else:
            withheld.append(Withheld(each.name, each.procedure, each.section, cause, message, each.definition))
    return kept, withheld


def unusual(parameters: Iterable[Parameter]) -> list[Notice]:
    """Return the warnings about parameters of a size that is unusual for motors on a bench."""
    return [
        Notice(
            UNUSUAL,
            text(
                "{label} is {value:.3g} {unit}, but motors on a bench have {least:g} to {most:g}: check the "
                "probes' factors, the instruments' ranges and units, and the values typed. No other sign shows a "
                "factor of ten or a thousand",
                label=each.label,
                value=each.value,
                unit=each.unit,
                least=sizes[0],
                most=sizes[1],
            ),
        )
        for each in parameters
        if (sizes := size_unusual(each.name, each.value)) is not None
    ]


def _beyond(parameter: Parameter) -> Text | None:
    sizes = size_beyond(parameter.name, parameter.value)
    if sizes is None:
        return None
    return text(
        "it would be {value:.3g} {unit}, but motors have {least:.0e} to {most:.0e}: check the probes' factors, "
        "the instruments' ranges and units, and the values typed",
        value=parameter.value,
        unit=parameter.unit,
        least=sizes[0],
        most=sizes[1],
    )


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
