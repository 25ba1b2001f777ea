"""Result of a procedure: parameters with uncertainty and evidence, warnings, findings."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from drivers.interfaces.text import Text, Translate, english, text, word
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.parameters import PARAMETERS

#: The finding that names a part of the motor which is missing or dead, so that what it would show cannot be given.
MISSING_PART = "missing_part"


@dataclass(frozen=True)
class Contribution:
    """One row of an uncertainty budget.

    `value` is the input's estimate, `standard_uncertainty` its own, `sensitivity` the derivative, `contribution`
    the size of their product in the parameter's unit, `kind` "A" (statistics) or "B" (specification, calibration).
    Rows of two parameters with one `identity` are the same input; a row without has none in common.
    """

    source: Text
    value: float
    standard_uncertainty: float
    sensitivity: float
    contribution: float
    kind: str
    identity: str = ""


@dataclass(frozen=True)
class Parameter:
    """A measured (or, for the data sheet's, entered) quantity.

    `note_value` is what the document's simple formula gives on the same readings. `winding` is the value of one
    winding of a delta, `value` then being the Y-equivalent (E8). `definition` is the one that the procedure gives it by; without,
    the table's row counts.
    """

    name: str
    value: float
    unit: str
    standard_uncertainty: float
    degrees_of_freedom: float
    coverage_interval: tuple[float, float]
    procedure: str
    section: str
    estimator: str
    note_value: float | None = None
    convention: str = ""
    winding: float | None = None
    source: str = "measured"
    budget: tuple[Contribution, ...] = ()
    definition: ParameterDefinition | None = field(default=None, compare=False)

    @property
    def label(self) -> Text:
        """The label for readers; a parameter without a definition keeps its name."""
        definition = self._defined
        return definition.label if definition else word(self.name)

    @property
    def reader_unit(self) -> str:
        """The unit in which readers expect it: flux linkage in webers, which are volt-seconds."""
        definition = self._defined
        return (definition.reader_unit if definition else "") or self.unit

    @property
    def own_definition(self) -> ParameterDefinition | None:
        """The parameter's definition if the procedure defines it beside the table, so that a record can be read without the
        procedure; otherwise None.
        """
        return None if self.name in PARAMETERS else self.definition

    @property
    def _defined(self) -> ParameterDefinition | None:
        return self.definition or PARAMETERS.get(self.name)

    def covariance(self, other: "Parameter") -> float:
        """Return the covariance with another parameter of the same run, in both units: from the inputs they share (GUM F.1.2)."""
        mine = {row.identity: row.sensitivity * row.standard_uncertainty for row in self.budget if row.identity}
        return sum(
            mine.get(row.identity, 0.0) * row.sensitivity * row.standard_uncertainty
            for row in other.budget
            if row.identity
        )

    def as_dict(self, budget: Sequence[Mapping[str, Any]] | None = None) -> dict[str, Any]:
        """Return it as it stands in `result.json`; one that is not in the table with symbol, label and readers' unit.

        `budget` is put in place of its own rows, whose sources are English words.
        """
        own = self.own_definition
        return {
            "value": self.value,
            "unit": self.unit,
            "standard_uncertainty": self.standard_uncertainty,
            "degrees_of_freedom": None if self.degrees_of_freedom == float("inf") else self.degrees_of_freedom,
            "coverage_interval": list(self.coverage_interval),
            "procedure": self.procedure,
            "section": self.section,
            "estimator": self.estimator,
            "note_value": self.note_value,
            "convention": self.convention,
            "winding": self.winding,
            "source": self.source,
            "budget": [{**vars(row), "source": str(row.source)} for row in self.budget] if budget is None else budget,
            **({} if own is None else {"definition": own.for_readers()}),
        }


@dataclass(frozen=True)
class Notice:
    """A warning for the reader: an erratum that applies (`E1` …) or a finding of this run (a short name)."""

    identifier: str
    message: Text

    def as_dict(self, translate: Translate = english) -> dict[str, Any]:
        """Return it as it stands in `result.json`."""
        return {"id": self.identifier, "message": self.message.render(translate)}


@dataclass(frozen=True)
class Withheld:
    """A parameter that is not given, because no interval from this record would contain the true value.

    `cause` is the likely one by its short name (`clipped` …), `message` what was seen and what to do.
    """

    name: str
    procedure: str
    section: str
    cause: str
    message: Text
    definition: ParameterDefinition | None = field(default=None, compare=False)

    @property
    def label(self) -> Text:
        """The label for readers; a parameter without a definition keeps its name."""
        definition = self._defined
        return definition.label if definition else word(self.name)

    @property
    def unit(self) -> str:
        """The unit in which results would give it; empty without a definition."""
        return self._defined.unit if self._defined else ""

    @property
    def reader_unit(self) -> str:
        """The unit in which readers would expect it."""
        return (self._defined.reader_unit if self._defined else "") or self.unit

    @property
    def own_definition(self) -> ParameterDefinition | None:
        """The parameter's definition if the procedure defines it beside the table, so that a record can be read without the
        procedure; otherwise None.
        """
        return None if self.name in PARAMETERS else self.definition

    @property
    def _defined(self) -> ParameterDefinition | None:
        return self.definition or PARAMETERS.get(self.name)

    @property
    def sentence(self) -> Text:
        """The message for those who need the figure: its name, the procedure, the cause, what was seen and what to do."""
        return text(
            "{name} was withheld by {procedure} ({cause}): {why}",
            name=self.label,
            procedure=word(self.procedure),
            cause=word(self.cause),
            why=self.message,
        )

    def as_dict(self, translate: Translate = english) -> dict[str, Any]:
        """Return it as it stands under `withheld` in `result.json`."""
        own = self.own_definition
        return {
            "procedure": self.procedure,
            "section": self.section,
            "cause": self.cause,
            "message": self.message.render(translate),
            **({} if own is None else {"unit": own.unit, "definition": own.for_readers()}),
        }


def said_of(withheld: Iterable[Withheld]) -> list[Text]:
    """Return the message in place of withheld figures: which figures, the procedure, the cause, what was seen and what to do.

    Figures that are withheld for the same reason have one sentence.
    """
    alike: dict[tuple[str, str, str], list[Withheld]] = {}
    for reason in withheld:
        alike.setdefault((reason.procedure, reason.cause, str(reason.message)), []).append(reason)
    return [
        text(
            "{names} ({procedure}), {cause}: {why}",
            names=[reason.label for reason in reasons],
            procedure=word(reasons[0].procedure),
            cause=word(reasons[0].cause),
            why=reasons[0].message,
        )
        for reasons in alike.values()
    ]


@dataclass(frozen=True)
class ProcedureResult:
    """All that one procedure found. `findings` are further figures, JSON-ready, by name; what its records show beyond the model is
    the list `misfit` among them.
    """

    procedure: str
    section: str
    parameters: tuple[Parameter, ...]
    warnings: tuple[Notice, ...] = ()
    findings: Mapping[str, Any] = field(default_factory=dict)
    withheld: tuple[Withheld, ...] = ()

    def parameter(self, name: str) -> Parameter:
        """Return the parameter of this name; KeyError where the procedure gave none."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(f"{self.procedure} gave no {name}; it gave {', '.join(p.name for p in self.parameters)}")
