"""Reasons why a figure must not go into a controller: it is missing, it is implausible, or its uncertainty is too large."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from drivers.interfaces.text import Text, text
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.result import Parameter
from reports.exports.map_quantities import FromMap, map_objections
from reports.exports.quantities import Fixed, FromPlate, Source
from reports.exports.subject import Subject
from reports.tables.figures import percent


class ExportRefusedError(Exception):
    """The run's figures cannot be exported; `reasons` says for each parameter what is wrong and what would help."""

    def __init__(self, target: str, reasons: tuple[Text, ...]) -> None:
        self.target = target
        self.reasons = reasons
        super().__init__(f"{target}: " + "; ".join(str(reason) for reason in reasons))


@dataclass(frozen=True)
class UncertaintyBounds:
    """The bounds on relative standard uncertainty; `replaced` takes the place of all of them."""

    replaced: float | None = None

    def of(self, definition: ParameterDefinition) -> float:
        """Return the bound of a parameter."""
        return self.replaced if self.replaced is not None else definition.controller_uncertainty


def objections(source: Source, subject: Subject, limits: UncertaintyBounds) -> Iterator[tuple[str, Text]]:
    """Give the parameter (or key of the motor file) and the reason for everything that stands against a quantity."""
    if isinstance(source, Fixed):
        return
    if isinstance(source, FromMap):
        yield from map_objections(source, subject, limits.replaced)
        return
    if isinstance(source, FromPlate):
        if source.value(subject.datasheet) is None:
            yield (
                source.key,
                text(
                    "{key} is needed and the data sheet's figure is not known; add it to the motor file", key=source.key
                ),
            )
        return
    for definition in source.needs:
        name = definition.name
        parameter = subject.parameters.get(name)
        if parameter is None:
            yield name, _missing(name, subject)
        elif name == "pole_pairs":
            yield from ((name, reason) for reason in _count(parameter, subject))
        else:
            yield from ((name, reason) for reason in _measured(parameter, limits.of(definition)))


def _missing(name: str, subject: Subject) -> Text:
    if name in subject.withheld:
        return subject.withheld[name][0].sentence
    procedures = list(subject.given_by.get(name, ()))
    if not procedures:
        return text("{name} is needed and the run has none", name=name)
    return text("{name} is needed and the run has none; run {procedures}", name=name, procedures=procedures)


def _count(parameter: Parameter, subject: Subject) -> Iterator[Text]:
    if not math.isfinite(parameter.value) or parameter.value < 1.0 or parameter.value != round(parameter.value):
        yield text("pole_pairs is {value:g}, which is not a whole number of 1 or more", value=parameter.value)
    elif subject.pole_pairs_doubt is not None:
        yield text("the number of pole pairs is not certain: {doubt}", doubt=subject.pole_pairs_doubt)


def _measured(parameter: Parameter, bound: float) -> Iterator[Text]:
    name, value, spread = parameter.name, parameter.value, parameter.standard_uncertainty
    low, high = parameter.coverage_interval
    if not math.isfinite(value) or value <= 0.0:
        yield text("{name} is {value:g} {unit}, it must be above 0", name=name, value=value, unit=parameter.unit)
    elif not math.isfinite(spread) or not spread > 0.0:
        yield text("{name} has no stated uncertainty", name=name)
    elif not low > 0.0 or not math.isfinite(high):
        yield text(
            "{name} is {value:.3g} {unit}, but its 95 % interval {low:.3g} … {high:.3g} {unit} contains zero; measure it better",
            name=name,
            value=value,
            unit=parameter.unit,
            low=low,
            high=high,
        )
    elif spread > bound * value:
        yield text(
            "{name} is known to {relative} % only (standard uncertainty), but at most {bound} % is allowed; "
            "measure it more accurately, or allow more",
            name=name,
            relative=percent(spread / value),
            bound=percent(bound),
        )
