"""The reference of parameters as a page: what each is, in which unit, by which convention, and which procedures give it."""

from collections.abc import Iterable, Mapping, Sequence

from drivers.interfaces.text import Translate, english
from procedures.core.parameter_definition import Bounds, ParameterDefinition

_HEAD = """# Parameters

Made from the table of parameters by `motorbench parameters --markdown > docs/reference/parameters.md`.

A parameter is one row of `procedures/core/parameters.py`. Results, type values under `[expected]` of a motor file, limits of
a plan, statistics, reports and exports take name, unit, label and convention from there. To add one, write its row, a
procedure that `gives` it, and the Chinese of label and convention. A procedure of your own has a `ParameterDefinition` in its
`gives` instead of a row's name.

*For controllers* is the largest relative standard uncertainty with which the figure is exported to one. *True value* says where
a virtual motor has it: an attribute of the virtual motor or of its six-step drive, or a formula of
`bench/virtual/true_values.py`. Without one, it depends on the test.
"""
_COLUMNS = (
    "name",
    "symbol",
    "unit",
    "what it is",
    "convention",
    "values",
    "procedures",
    "`[expected]`",
    "for controllers",
    "true value",
)


def page(
    definitions: Iterable[ParameterDefinition], givers: Mapping[str, Sequence[str]], translate: Translate = english
) -> str:
    """Return the page in Markdown."""
    rows = [_row(_COLUMNS), _row(["---"] * len(_COLUMNS))]
    for each in definitions:
        procedures = ", ".join(f"`{name}`" for name in givers.get(each.name, ()))
        relative = "" if each.controller_uncertainty == float("inf") else f"{100.0 * each.controller_uncertainty:g} %"
        rows.append(
            _row(
                (
                    f"`{each.name}`",
                    _typeset(each.symbol),
                    _unit(each),
                    each.label.render(translate),
                    translate(each.convention) if each.convention else "",
                    values(each.bounds),
                    procedures or "`motorbench analyze`",
                    "yes" if each.type_value else "",
                    relative,
                    f"`{each.true_value}`" if each.true_value else "",
                )
            )
        )
    return "\n".join([_HEAD, *rows, ""])


def values(bounds: Bounds) -> str:
    """Return an interval as readers expect it."""
    low = f"{'>' if bounds.open else '≥'} {bounds.low:g}"
    return low if bounds.high is None else f"{bounds.low:g} … {bounds.high:g}"


def _unit(definition: ParameterDefinition) -> str:
    if definition.reader_unit:
        return f"{definition.unit} ({definition.reader_unit})"
    return "" if definition.unit == "1" else definition.unit


def _typeset(symbol: str) -> str:
    base, _, index = symbol.partition("_")
    return f"*{base}*" * bool(base) + f"<sub>{index}</sub>" * bool(index)


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"
