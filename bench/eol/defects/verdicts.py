"""Verdicts of limits on motors that were measured: which are rejected, and by which figure of which procedure."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from bench.eol.defects.trial import FigureReading, MotorTrial
from bench.eol.limits import GuardBand, ParameterLimits, judge
from bench.eol.plan import Plan, PlannedCheck
from bench.eol.verdict import Verdict

#: The figure of a procedure that gives none: it refuses the motor.
REFUSED = ""


@dataclass(frozen=True)
class RejectReason:
    """One reason why a motor does not pass: a figure, or with `parameter` REFUSED that the procedure could not measure."""

    procedure: str
    parameter: str


@dataclass(frozen=True)
class PlanRules:
    """Limits, how uncertainty guards them, and which checks a motor of which number has."""

    checks: Sequence[PlannedCheck]
    limits: Mapping[str, ParameterLimits]
    guard: GuardBand
    minimum_ratio: float

    @staticmethod
    def of(plan: Plan, limits: Mapping[str, ParameterLimits]) -> "PlanRules":
        """Return a plan's."""
        return PlanRules(plan.checks, limits, plan.guard, plan.minimum_ratio)

    def catches(self, trial: MotorTrial) -> frozenset[RejectReason]:
        """Return everything that speaks against a motor, as a line of this plan finds it; it passes where there is nothing."""
        result = set[RejectReason]()
        if trial.ended:
            result.add(RejectReason(REFUSED, REFUSED))
        # The line's records hold of each parameter the best figure of all procedures, and every procedure judges its own.
        given = {name for check in self._of(trial) for name in trial.procedures[check.name].readings}
        for check in self._of(trial):
            attempted = trial.procedures[check.name]
            if attempted.refused and not attempted.unmodelled:
                result.add(RejectReason(check.name, REFUSED))
            for name, reading in attempted.readings.items():
                if name in self.limits and not self.passes(reading, self.limits[name]):
                    result.add(RejectReason(check.name, name))
            result |= {RejectReason(check.name, name) for name in self._missing(attempted.withheld, given)}
        return frozenset(result)

    def passes(self, reading: FigureReading, limits: ParameterLimits) -> bool:
        """Tell whether a figure is within limits, and certain enough to say so."""
        judgement = judge(reading.value, reading.expanded, limits, self.guard)
        undecided = not math.isinf(limits.tolerance) and judgement.ratio < self.minimum_ratio
        return judgement.verdict is Verdict.PASS and not undecided

    def _of(self, trial: MotorTrial) -> Iterable[PlannedCheck]:
        return (
            check for check in self.checks if (trial.number - 1) % check.every == 0 and check.name in trial.procedures
        )

    def _missing(self, withheld: Iterable[str], given: set[str]) -> set[str]:
        return {name for name in withheld if name in self.limits and name not in given}
