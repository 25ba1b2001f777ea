"""A plan held against virtual motors with and without defects."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from bench.distribution.workforce import Workforce
from bench.eol.defects.campaign import Campaign, measure_all, tasks_of
from bench.eol.defects.cases import DefectCases, defect_cases
from bench.eol.defects.findings import Findings, findings
from bench.eol.defects.function_cost import RatedPoint
from bench.eol.defects.proposal import Proposal, propose
from bench.eol.defects.trial import TrialSetup
from bench.eol.defects.verdicts import PlanRules
from bench.eol.line.preparation.dry_run import virtually
from bench.eol.line.preparation.prepare import BatchRequest, Prepared, prepare
from bench.eol.line.workers.messages import Batch
from bench.eol.plan import Plan
from bench.eol.plan_file import SpreadSection
from bench.i18n.errors import InputError
from bench.run.software import software
from drivers.interfaces.text import Text, text
from reports.labels import ParameterLabels

#: Spread (standard deviations, per cent) of a type of which the plan says nothing; usual ones.
USUAL_SPREAD = SpreadSection(resistance=1.5, inductance=2.0, flux=1.5, inertia=1.0, friction=5.0)


@dataclass(frozen=True)
class DefectRequest:
    """The number of motors of each case and of sound ones, and the workforce; `progress` is called with how many of all are done."""

    each: int
    sound: int
    workforce: Workforce
    progress: Callable[[int, int], None] = field(default=lambda _done, _all: None)


@dataclass(frozen=True)
class DefectCheck:
    """The findings, and the population that the motors were drawn from; a proposal can be made of it.

    `safety_tests` are the procedures that come first in every order that is proposed.
    """

    plan: Plan
    cases: DefectCases
    spread: Text
    rules: PlanRules
    campaign: Campaign
    findings: Findings
    labels: ParameterLabels
    safety_tests: tuple[str, ...] = ()

    @property
    def unmodelled(self) -> Mapping[str, tuple[str, int]]:
        """By procedure that the virtual bench refused for what it does not model: why the first time, and of how many motors."""
        result: dict[str, tuple[str, int]] = {}
        for trial in self.campaign.trials:
            for name, attempted in trial.procedures.items():
                if attempted.unmodelled:
                    why, count = result.get(name, (attempted.refused, 0))
                    result[name] = why, count + 1
        return result

    def propose(self) -> Proposal:
        """Return the limits and the order that what was measured speaks for. Raises InputError as `propose` does."""
        return propose(self.campaign.trials, self.cases.cases, self.rules)


def check_defects(request: BatchRequest, wanted: DefectRequest) -> DefectCheck:
    """Measure virtual motors of the plan's type, sound and with every defect, and judge them by the plan.

    Raises InputError for a plan, motor or station that is not right.
    """
    prepared = prepare(request.plan, request.station, request.sockets, request.operator)
    plan, line = prepared.plan, prepared.line
    prepared, _ = virtually(prepared)
    spread, said = _spread(plan)
    batch = Batch(
        name="check",
        uid="0" * 32,
        plan=replace(plan, spread=spread),
        limits=prepared.limits,
        motor=prepared.motor,
        line=line.name,
        folder="",
        request=replace(request, procedure_times=False),
    )
    cases = defect_cases(
        prepared.motor.virtual_motor(),
        prepared.motor.six_step,
        _rating(prepared),
        fixture=request.operator != "virtual",
    )
    twin = line.sockets[0].station or line.sockets[0].twin_of
    setup = TrialSetup(batch, cases.cases, twin.content if twin else "", line.source, software()["code"])
    tasks = tasks_of(cases, wanted.each, wanted.sound)
    campaign = measure_all(setup, tasks, wanted.workforce, lambda done: wanted.progress(done, len(tasks)))
    rules = PlanRules.of(plan, prepared.limits)
    found = findings(campaign, cases.cases, rules)
    return DefectCheck(plan, cases, said, rules, campaign, found, prepared.labels, prepared.safety_tests)


def _spread(plan: Plan) -> tuple[SpreadSection, Text]:
    given = plan.spread.model_copy(update={"defects": 0.0})
    if any((given.resistance, given.inductance, given.flux, given.inertia, given.friction)):
        return given, text("the spread of [virtual] in {source}", source=plan.source)
    return USUAL_SPREAD, text("a usual spread, for {source} has none under [virtual]", source=plan.source)


def _rating(prepared: Prepared) -> RatedPoint:
    plate = prepared.motor.nameplate
    if plate.rated_speed_rpm is None:
        raise InputError(
            text(
                "{motor}: what a defect costs is reckoned at rated speed; add nameplate.rated_speed_rpm",
                motor=prepared.motor.source,
            )
        )
    return RatedPoint(plate.rated_current, plate.rated_speed_rpm * math.pi / 30.0)
