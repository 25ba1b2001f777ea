"""All results of a run together: the best figure of each parameter, its alternatives, and disagreements between them."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from drivers.interfaces.text import text
from procedures.core.result import Notice, Parameter, ProcedureResult, Withheld

#: Two figures disagree beyond this multiple of their combined standard uncertainty (about 99 %).
DISAGREEMENT = 2.6


@dataclass(frozen=True)
class ParameterSet:
    """The reported figure of each parameter by name, and under the same name the `alternatives` of other procedures.

    `withheld` says by name why there is no figure of a parameter that procedures withheld and none gave: each in its own words.
    """

    parameters: dict[str, Parameter]
    alternatives: dict[str, tuple[Parameter, ...]]
    notices: tuple[Notice, ...]
    withheld: dict[str, tuple[Withheld, ...]] = field(default_factory=dict)


def merge(results: Iterable[ProcedureResult]) -> ParameterSet:
    """Take the figure with the smallest uncertainty for each parameter; warn if two differ by more than their uncertainties.

    If one procedure withholds a figure and another gives it, the given one is used.
    """
    found: dict[str, list[Parameter]] = {}
    withheld: dict[str, list[Withheld]] = {}
    for result in results:
        for parameter in result.parameters:
            found.setdefault(parameter.name, []).append(parameter)
        for reason in result.withheld:
            withheld.setdefault(reason.name, []).append(reason)
    best: dict[str, Parameter] = {}
    others: dict[str, tuple[Parameter, ...]] = {}
    notices: list[Notice] = []
    for name, figures in found.items():
        ordered = sorted(figures, key=lambda p: p.standard_uncertainty)
        best[name] = ordered[0]
        others[name] = tuple(ordered[1:])
        notices.extend(notice for other in ordered[1:] if (notice := _disagreement(ordered[0], other)) is not None)
    lacking = {name: tuple(reasons) for name, reasons in withheld.items() if name not in found}
    return ParameterSet(best, others, tuple(notices), lacking)


def _disagreement(first: Parameter, second: Parameter) -> Notice | None:
    distance = abs(first.value - second.value)
    combined = math.hypot(first.standard_uncertainty, second.standard_uncertainty)
    if distance <= DISAGREEMENT * combined:
        return None
    return Notice(
        "disagreement",
        text(
            "{name}: {first} gives {first_value:.5g} {unit} and {second} gives {second_value:.5g} {unit}; "
            "they differ by more than their uncertainties allow. Check the connections and the instruments of both",
            name=first.name,
            first=first.procedure,
            first_value=first.value,
            second=second.procedure,
            second_value=second.value,
            unit=first.unit,
        ),
    )
