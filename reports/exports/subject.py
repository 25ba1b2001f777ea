"""The subject of an export: one motor's figures, and doubts about them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from drivers.interfaces.text import Text, text
from procedures.core.parameter_set import ParameterSet
from procedures.core.result import Notice, Parameter, ProcedureResult, Withheld
from reports.exports.exported_map import ExportedMap

#: Findings of a run that make a parameter unfit for a controller, by the beginning of their names.
_DOUBTS = ("consistency-", "disagreement", "uncertain-count")


@dataclass(frozen=True)
class Datasheet:
    """The nameplate's figures, SI, currents phase peak: None if not stated."""

    rated_current: float | None = None
    maximum_current: float | None = None
    rated_speed_rpm: float | None = None
    maximum_speed_rpm: float | None = None


@dataclass(frozen=True)
class Subject:
    """A motor's measured parameters by name, its plate, where they come from, and what stands against them.

    `warnings` are those of the run that cast doubt on a figure. `pole_pairs_doubt` says why the count is not certain, or
    nothing where it is. `withheld` says why a figure is not given; `flux_map` is None where the run has none.
    """

    motor: str
    serial_number: str
    run: str
    measured_on: str
    software: str
    parameters: Mapping[str, Parameter]
    datasheet: Datasheet
    warnings: Sequence[Notice] = ()
    pole_pairs_doubt: Text | None = None
    given_by: Mapping[str, Sequence[str]] = field(default_factory=dict)
    withheld: Mapping[str, Sequence[Withheld]] = field(default_factory=dict)
    flux_map: ExportedMap | None = None


def doubtful(warnings: Sequence[tuple[str, Notice]]) -> tuple[Notice, ...]:
    """Return the warnings of a run (each with its procedure) that cast doubt on figures."""
    return tuple(notice for _, notice in warnings if notice.identifier.startswith(_DOUBTS))


def pole_pairs_doubt(found: ParameterSet, results: Mapping[str, ProcedureResult]) -> Text | None:
    """Return why the number of pole pairs is not certain: it may be another whole number, or two procedures disagree."""
    counted = found.parameters.get("pole_pairs")
    if counted is None:
        return None
    others = found.alternatives.get("pole_pairs", ())
    different = [other for other in others if other.value != counted.value]
    if different:
        return text(
            "{first} counts {value:g} pole pairs, {second} {other:g}",
            first=counted.procedure,
            value=counted.value,
            second=different[0].procedure,
            other=different[0].value,
        )
    sure = [p for p in (counted, *others) if results[p.procedure].findings.get("certain", True)]
    if not sure:
        return text(
            "{procedure}: frequency and speed allow more than one whole number of pole pairs",
            procedure=counted.procedure,
        )
    return None
