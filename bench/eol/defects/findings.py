"""Findings of a check: escapes and false rejects with their intervals, and what each figure and procedure is worth."""

import math
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from bench.eol.defects.campaign import Campaign
from bench.eol.defects.cases import DefectCase
from bench.eol.defects.function_cost import DefectSeverity, FunctionCost
from bench.eol.defects.trial import MotorTrial
from bench.eol.defects.verdicts import REFUSED, PlanRules, RejectReason
from bench.eol.limits import ParameterLimits
from bench.eol.statistics.proportion import Proportion, proportion
from drivers.interfaces.text import Text
from procedures.core.parameters import PARAMETERS


@dataclass(frozen=True)
class DefectFinding:
    """Count of motors with a defect of one severity that the plan lets through."""

    defect: str
    label: Text
    severity: Text
    cost: FunctionCost
    through: Proportion


@dataclass(frozen=True)
class FigureFinding:
    """A figure on sound motors (mean and standard deviation in `unit`), and what its limits do; infinite ones are none.

    `catches` are defective motors outside, gross and marginal ones; `alone` those that nothing else rejects.
    """

    parameter: str
    procedures: tuple[str, ...]
    unit: str
    mean: float
    deviation: float
    low: float
    high: float
    false_rejects: Proportion
    catches: int
    alone: int

    @property
    def limited(self) -> bool:
        """Return whether it has a limit."""
        return math.isfinite(self.low) or math.isfinite(self.high)


@dataclass(frozen=True)
class ProcedureFinding:
    """A procedure's mean time (s) on sound motors, the defective motors that it rejects, and those that would escape without it."""

    procedure: str
    time: float
    catches: int
    alone: int


@dataclass(frozen=True)
class Findings:
    """The defects that a plan accepts and rejects; `complete` if all `planned` motors were measured.

    `defective` are the motors with a gross or marginal defect; `through` is by grade.
    """

    planned: int
    measured: int
    defective: int
    false_rejects: Proportion
    through: Mapping[DefectSeverity, Proportion]
    defects: tuple[DefectFinding, ...]
    figures: tuple[FigureFinding, ...]
    procedures: tuple[ProcedureFinding, ...]

    @property
    def complete(self) -> bool:
        """Return whether every motor was measured."""
        return self.measured == self.planned

    @property
    def good(self) -> bool:
        """Return whether all motors were measured and none with a gross defect passed."""
        return self.complete and not self.through[DefectSeverity.GROSS].hits

    def as_dict(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        content = asdict(self)
        content["through"] = {grade.value: asdict(share) for grade, share in self.through.items()}
        for row, defect in zip(content["defects"], self.defects, strict=True):
            row["label"], row["severity"] = defect.label.render(), defect.severity.render()
            row["cost"]["grade"] = defect.cost.grade.value
        for row, figure in zip(content["figures"], self.figures, strict=True):
            row["limited"] = figure.limited
        return content | {"complete": self.complete}


def findings(campaign: Campaign, cases: Sequence[DefectCase], rules: PlanRules) -> Findings:
    """Return what the rules make of the motors that were measured; a defect that had no part in anything is left out."""
    trials = [trial for trial in campaign.trials if trial.felt]
    caught = {trial.number: rules.catches(trial) for trial in trials}
    sound = [trial for trial in trials if trial.case < 0]
    by_case = defaultdict[int, list[MotorTrial]](list)
    for trial in trials:
        if trial.case >= 0:
            by_case[trial.case].append(trial)
    defects = tuple(
        DefectFinding(case.defect, case.label, case.severity, case.cost, _through(by_case[number], caught))
        for number, case in enumerate(cases)
        if by_case[number]
    )
    graded = {
        grade: [trial for number, some in by_case.items() if cases[number].cost.grade is grade for trial in some]
        for grade in DefectSeverity
    }
    matters = [*graded[DefectSeverity.GROSS], *graded[DefectSeverity.MARGINAL]]
    return Findings(
        planned=campaign.planned,
        measured=len(campaign.trials),
        defective=len(matters),
        false_rejects=proportion(sum(bool(caught[trial.number]) for trial in sound), len(sound)),
        through={grade: _through(some, caught) for grade, some in graded.items()},
        defects=defects,
        figures=tuple(_figures(sound, matters, caught, rules)),
        procedures=tuple(
            ProcedureFinding(
                check.name,
                _mean([t.procedures[check.name].duration for t in sound if check.name in t.procedures]),
                sum(any(catch.procedure == check.name for catch in caught[trial.number]) for trial in matters),
                sum(_alone({c.procedure for c in caught[trial.number]}, check.name) for trial in matters),
            )
            for check in rules.checks
        ),
    )


def restated(parameter: str, among: Collection[str]) -> bool:
    """Tell whether a figure says no more than another one that is there too, in other units."""
    return parameter in PARAMETERS and PARAMETERS[parameter].restates in among


def sound_values(trials: Sequence[MotorTrial], parameter: str) -> list[float]:
    """Return a figure of the sound motors, by whatever procedure each has."""
    return [
        attempted.readings[parameter].value
        for trial in trials
        if trial.case < 0
        for attempted in trial.procedures.values()
        if parameter in attempted.readings
    ]


def _figures(
    sound: Sequence[MotorTrial],
    matters: Sequence[MotorTrial],
    caught: Mapping[int, Collection[RejectReason]],
    rules: PlanRules,
) -> list[FigureFinding]:
    givers = defaultdict[str, dict[str, str]](dict)
    for trial in sound:
        for procedure, attempted in trial.procedures.items():
            for name, reading in attempted.readings.items():
                givers[name][procedure] = reading.unit
    result = []
    for name, procedures in givers.items():
        if restated(name, givers) and name not in rules.limits:
            continue
        limits = rules.limits.get(name, ParameterLimits())
        values = sound_values(sound, name)
        mean = _mean(values)
        result.append(
            FigureFinding(
                parameter=name,
                procedures=tuple(procedures),
                unit=next(iter(procedures.values())),
                mean=mean,
                deviation=math.sqrt(_mean([(value - mean) ** 2 for value in values])),
                low=limits.low,
                high=limits.high,
                false_rejects=proportion(
                    sum(_by(caught[trial.number], name) for trial in sound),
                    sum(any(name in done.readings for done in trial.procedures.values()) for trial in sound),
                ),
                catches=sum(_by(caught[trial.number], name) for trial in matters),
                alone=sum(_alone({c.parameter for c in caught[trial.number]}, name) for trial in matters),
            )
        )
    return result


def _through(trials: Sequence[MotorTrial], caught: Mapping[int, Collection[RejectReason]]) -> Proportion:
    return proportion(sum(not caught[trial.number] for trial in trials), len(trials))


def _by(catches: Collection[RejectReason], parameter: str) -> bool:
    return any(catch.parameter == parameter != REFUSED for catch in catches)


def _alone(names: set[str], name: str) -> bool:
    return names == {name}


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else math.nan
