"""A run's parameters on one axis of per cent: value, interval, the note's formula, and the type's value with its tolerance."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from drivers.interfaces.text import Text, text
from procedures.core.parameter_set import ParameterSet
from procedures.core.parameters import PARAMETERS
from procedures.core.result import Parameter
from procedures.plausibility.type_tolerance import Conformity, conformity
from reports.tables.figures import decimals_for, figure, scale_of

#: Ends (%) that an axis may have; what lies beyond the last is written at the edge.
_ENDS = (1.0, 2.0, 5.0, 10.0, 20.0)
#: Units in which a deviation says nothing: such a figure is a deviation, an angle or a sign itself.
_ABSOLUTE = ("%", "°")


@dataclass(frozen=True)
class OnAxis:
    """The place of a parameter, in per cent of the reference: value, interval, and the note's formula if it gave a figure."""

    value: float
    interval: tuple[float, float]
    note: float | None


@dataclass(frozen=True)
class DeviationRow:
    """One quantity: its figure in print, what else it is called, and where it stands.

    `expanded` is the half width of the 95 % interval. `on_axis` is None where per cent mean nothing; `of_type` tells that the
    reference is the type's value, else it is the figure itself. `tolerance` is in per cent of the type's value, None without one,
    `verdict` says whether the interval keeps it.
    """

    name: str
    label: Text
    condition: str
    value: str
    expanded: str
    unit: str
    also: tuple[str, ...]
    procedure: str
    on_axis: OnAxis | None
    of_type: bool
    tolerance: float | None
    verdict: Conformity | None
    exact: Text | None = None


def deviations(
    parameters: ParameterSet, expected: Mapping[str, float], tolerance: Mapping[str, float]
) -> list[DeviationRow]:
    """Return a row for every quantity that was measured; figures that restate one stand with it."""
    found = parameters.parameters
    restated = {name: PARAMETERS[name].restates for name in found if name in PARAMETERS}
    rows = []
    for name, parameter in found.items():
        if parameter.source != "measured" or restated.get(name) in found:
            continue
        others = [found[other] for other, what in restated.items() if what == name]
        rows.append(_row(parameter, others, expected.get(name), tolerance.get(name)))
    return rows


def axis_end(rows: Iterable[DeviationRow]) -> float:
    """Return the end (%) of an axis about zero on which intervals and tolerances have room, as far as can be."""
    reach = [0.0]
    for row in rows:
        if row.on_axis is not None:
            reach += [abs(end) for end in row.on_axis.interval]
        reach += [] if row.tolerance is None else [row.tolerance]
    inside = [each for each in reach if each <= _ENDS[-1]]
    return next(end for end in _ENDS if max(inside) <= end)


def _row(
    parameter: Parameter, others: Iterable[Parameter], expected: float | None, tolerance: float | None
) -> DeviationRow:
    value, unit, expanded = _printed(parameter)
    counted = parameter.unit == "1" and parameter.value == round(parameter.value) and not parameter.standard_uncertainty
    whole = counted and expected is not None
    reference = expected or parameter.value
    relative = not counted and parameter.unit not in _ABSOLUTE and reference != 0.0
    return DeviationRow(
        parameter.name,
        parameter.label,
        parameter.convention,
        value,
        expanded,
        unit,
        tuple(" ".join(_printed(other)[:2]) for other in others),
        parameter.procedure,
        _on_axis(parameter, reference) if relative else None,
        of_type=bool(expected) and relative,
        tolerance=100.0 * tolerance if tolerance is not None and relative and expected else None,
        verdict=conformity(parameter, expected, tolerance) if expected and tolerance is not None else None,
        exact=_counted(parameter.value, expected) if whole else None,
    )


def _on_axis(parameter: Parameter, reference: float) -> OnAxis:
    def of(value: float) -> float:
        return 100.0 * (value / reference - 1.0)

    low, high = sorted(of(bound) for bound in parameter.coverage_interval)
    note = parameter.note_value
    return OnAxis(of(parameter.value), (low, high), None if note is None or not math.isfinite(note) else of(note))


def _counted(value: float, expected: float | None) -> Text:
    if value == expected:
        return text("as the type says")
    return text("the type says {expected:g}", expected=expected)


def _printed(parameter: Parameter) -> tuple[str, str, str]:
    """Return value, unit and expanded uncertainty in print; the last is empty for none."""
    scale = scale_of(parameter.value, parameter.reader_unit)
    low, high = parameter.coverage_interval
    half = (high - low) / 2.0 / scale.factor
    shown = parameter.value / scale.factor
    decimals = decimals_for(half, shown)
    return figure(shown, decimals), scale.unit, figure(half, decimals) if half else ""
