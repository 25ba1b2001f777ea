"""All results of a run together: the best figure of each parameter, its alternatives, and disagreements between them."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from drivers.interfaces.text import text
from procedures.core.result import Notice, Parameter, ProcedureResult, Withheld

#: Two figures disagree beyond this multiple of their combined standard uncertainty (about 99 %).
DISAGREEMENT = 2.6
#: Whole numbers are right or wrong; nothing between two of them.
_COUNTS = frozenset({"pole_pairs"})
_INDUCTANCES = frozenset({"d_axis_inductance", "q_axis_inductance"})


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
        notices.extend(_disagreement(ordered[0], other) for other in ordered[1:] if disagree(ordered[0], other))
        best[name], *others_wide = _spanning(ordered)
        others[name] = tuple(others_wide)
    chord, axis = (best.get(name) for name in ("d_axis_chord_inductance", "d_axis_inductance"))
    if chord is not None and axis is not None and disagree(chord, axis):
        notices.append(_disagreement(chord, axis))
    lacking = {name: tuple(reasons) for name, reasons in withheld.items() if name not in found}
    return ParameterSet(best, others, tuple(notices), lacking)


def disagree(first: Parameter, second: Parameter) -> bool:
    """Tell whether two figures differ by more than their uncertainties allow."""
    combined = math.hypot(first.standard_uncertainty, second.standard_uncertainty)
    return abs(first.value - second.value) > DISAGREEMENT * combined


def _spanning(figures: Sequence[Parameter]) -> list[Parameter]:
    """Return the figures, the interval of each spanning those that it disagrees with: one of the two is wrong, and nobody knows which.

    Counts keep theirs.
    """
    wide = []
    for figure in figures:
        rivals = [other for other in figures if disagree(figure, other)] if figure.name not in _COUNTS else []
        ends = [end for each in (figure, *rivals) for end in each.coverage_interval]
        wide.append(replace(figure, coverage_interval=(min(ends), max(ends))) if rivals else figure)
    return wide


def _disagreement(first: Parameter, second: Parameter) -> Notice:
    values: dict[str, object] = {
        "name": first.name,
        "first": first.procedure,
        "first_value": first.value,
        "second": second.procedure,
        "second_value": second.value,
        "unit": first.unit,
    }
    if first.name == "d_axis_chord_inductance":
        message = text(
            "{name}: {first} gives {first_value:.5g} {unit}, and {second} gives {second_value:.5g} {unit} for the d-axis "
            "inductance; they differ by more than their uncertainties allow. Likely: the d axis saturates up to the "
            "short-circuit current; or a wrong factor of a current probe; or eddy currents, which make a bridge's figure "
            "too small",
            **values,
        )
    elif first.name in _INDUCTANCES:
        message = text(
            "{name}: {first} gives {first_value:.5g} {unit} and {second} gives {second_value:.5g} {unit}; they differ by "
            "more than their uncertainties allow, and the interval spans both. Likely: eddy currents, which make a "
            "bridge's figure smaller than the step's; or saturation by the step's current, which makes the step's smaller; "
            "or a wrong factor of a probe, which a smaller step does not change",
            **values,
        )
    else:
        message = text(
            "{name}: {first} gives {first_value:.5g} {unit} and {second} gives {second_value:.5g} {unit}; "
            "they differ by more than their uncertainties allow. Check the connections and the instruments of both",
            **values,
        )
    return Notice("disagreement", message)
