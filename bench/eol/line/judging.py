"""Judgement of a motor during its run: a verdict on each attempt, its consequence, and the record in the end."""

import math
from collections.abc import Collection, Mapping, Sequence

from bench.eol.limits import GuardBand, ParameterLimits, judge, least_ratio
from bench.eol.plan import PlannedCheck
from bench.eol.record import CheckRecord, MeasuredFigure
from bench.eol.verdict import Verdict, together
from bench.i18n.errors import NOTHING
from bench.run.retry_policy import Attempt, Next
from drivers.interfaces.text import Text, Translate, english, lines, text, word
from procedures.core.parameter_set import ParameterSet
from procedures.core.procedure_error import MotorFaultError, OnlyBoundedError
from procedures.core.result import MISSING_PART, Parameter, Withheld
from procedures.verification.verifier import WiringError
from reports.labels import ParameterLabels
from reports.tables.figures import scale_of

_NO_LIMITS = ParameterLimits()


class MotorJudge:
    """Judges one motor by the limits of its plan; `minimum_ratio` is the least tolerance over the 95 % interval's width.

    Why it does not pass is written in the batch's language, and kept for readers of any.
    """

    def __init__(
        self,
        checks: Sequence[PlannedCheck],
        limits: Mapping[str, ParameterLimits],
        guard: GuardBand,
        minimum_ratio: float,
        translate: Translate = english,
    ) -> None:
        self._translate = translate
        self._checks = {check.name: check for check in checks}
        self._limits = limits
        self._guard = guard
        self._minimum_ratio = minimum_ratio
        self._attempts: list[CheckRecord] = []
        self._causes: dict[tuple[str, int], Text] = {}
        #: By procedure: parameters for the want of which alone its last attempt was an error.
        self._withheld: dict[str, frozenset[str]] = {}
        self._errors: dict[str, Exception | SystemExit | None] = {}
        #: What was judged already, by the parameter's identity: each is in an attempt's result, and in the run's in the end.
        self._judged: dict[int, tuple[Parameter, MeasuredFigure]] = {}

    @property
    def errors(self) -> tuple[BaseException, ...]:
        """The errors of the last attempt at each procedure that gave nothing; a bound is among them only if it rejects the motor."""
        return tuple(
            error
            for error in self._errors.values()
            if error is not None and (not isinstance(error, OnlyBoundedError) or self._beyond(error))
        )

    @property
    def attempts(self) -> tuple[CheckRecord, ...]:
        """Every attempt so far."""
        return tuple(self._attempts)

    @property
    def causes(self) -> Mapping[tuple[str, int], Text]:
        """Why attempts did not pass, by procedure and number, for readers of any language."""
        return self._causes

    def after(self, attempt: Attempt) -> Next:
        """Judge an attempt, keep it, and say what the plan has follow."""
        check = self._checks[attempt.planned.name]
        self._withheld.pop(check.name, None)
        self._errors[check.name] = attempt.error
        verdict, cause = self._verdict(attempt)
        number = 1 + sum(kept.procedure == check.name for kept in self._attempts)
        words = cause.render(self._translate)
        self._attempts.append(CheckRecord(check.name, number, verdict, attempt.ended - attempt.started, words))
        if words:
            self._causes[check.name, number] = cause
        if verdict is Verdict.PASS or check.on_failure == "go_on":
            return Next.GO_ON
        if check.on_failure == "retry" and number <= check.retries:
            return Next.AGAIN
        return Next.STOP

    def measured(self, parameter: Parameter) -> MeasuredFigure:
        """Return a figure held against its limits, if it has any; one that its uncertainty leaves undecided is an error."""
        if id(parameter) not in self._judged:
            self._judged[id(parameter)] = (parameter, self._measured(parameter))
        return self._judged[id(parameter)][1]

    def _measured(self, parameter: Parameter) -> MeasuredFigure:
        limits = self._limits.get(parameter.name, _NO_LIMITS)
        expanded = half_width(parameter.coverage_interval)
        judgement = judge(parameter.value, expanded, limits, self._guard)
        own = parameter.own_definition
        least = least_ratio(self._guard, self._minimum_ratio, limits)
        undecided = not math.isinf(limits.tolerance) and judgement.ratio < least
        # An interval that lies outside as a whole decides, however wide it is.
        outside = parameter.value - expanded > limits.high or parameter.value + expanded < limits.low
        return MeasuredFigure(
            parameter.name,
            parameter.value,
            parameter.unit,
            parameter.standard_uncertainty,
            expanded,
            limits.low,
            limits.high,
            Verdict.ERROR if undecided and not outside else judgement.verdict,
            "" if own is None else own.label.render(),
        )

    def figures(self, found: ParameterSet) -> tuple[MeasuredFigure, ...]:
        """Return all figures of a run; one that has limits and is withheld is among them without a value, not judged."""
        measured = [self.measured(parameter) for parameter in found.parameters.values()]
        lacking = [self._not_judged(reasons[0]) for name, reasons in found.withheld.items() if name in self._limits]
        return (*measured, *lacking)

    def _not_judged(self, reason: Withheld) -> MeasuredFigure:
        limits, nothing = self._limits[reason.name], math.nan
        label = "" if reason.own_definition is None else reason.label.render()
        return MeasuredFigure(
            reason.name,
            nothing,
            reason.unit,
            nothing,
            nothing,
            limits.low,
            limits.high,
            Verdict.NOT_JUDGED,
            label,
        )

    def verdict(self, figures: Collection[MeasuredFigure], *, aborted: bool, planned: int) -> Verdict:
        """Return the verdict on the motor: of each check the last attempt's, and of each parameter the best figure's.

        A check that only withheld what another one gave counts as passed.
        """
        last = {attempt.procedure: attempt.verdict for attempt in self._attempts}
        given = {figure.parameter for figure in figures if figure.verdict is not Verdict.NOT_JUDGED}
        excused = {procedure for procedure, lacking in self._withheld.items() if lacking <= given}
        last |= dict.fromkeys(excused & last.keys(), Verdict.PASS)
        verdicts = [*last.values(), *(figure.verdict for figure in figures if figure.parameter in self._limits)]
        if aborted:
            verdicts.append(Verdict.ABORTED)
        elif len(last) < planned and together(verdicts) is Verdict.PASS:
            verdicts.append(Verdict.ERROR)
        return together(verdicts)

    def first_pass(self, verdict: Verdict) -> bool:
        """Tell whether the motor passed without any check's second attempt."""
        return verdict is Verdict.PASS and all(attempt.attempt == 1 for attempt in self._attempts)

    def _beyond(self, error: OnlyBoundedError) -> bool:
        return error.low > self._limits.get(error.parameter, _NO_LIMITS).high

    def _verdict(self, attempt: Attempt) -> tuple[Verdict, Text]:
        if attempt.result is None:
            # Where the connections are made by machine, terminals that do not conduct as they should are the motor's, and so is
            # a part that is missing or dead, and a figure that is beyond its limit however large it is.
            error = attempt.error
            motors = isinstance(error, WiringError | MotorFaultError)
            motors |= isinstance(error, OnlyBoundedError) and self._beyond(error)
            return (Verdict.FAIL if motors else Verdict.ERROR), attempt.told
        figures = [self.measured(parameter) for parameter in attempt.result.parameters]
        bad = [figure for figure in figures if figure.verdict is not Verdict.PASS and figure.parameter in self._limits]
        missing = (set(attempt.planned.procedure.parameters) & set(self._limits)) - {
            figure.parameter for figure in figures
        }
        reasons = {reason.name: reason for reason in reversed(attempt.result.withheld) if reason.name in missing}
        if reasons and not bad and missing == reasons.keys():
            self._withheld[attempt.planned.name] = frozenset(missing)
        verdicts = [*(figure.verdict for figure in bad), *(Verdict.ERROR for _ in missing), Verdict.PASS]
        causes: list[Text] = [described(figure) for figure in bad]
        if absent := attempt.result.findings.get(MISSING_PART):
            # A figure that is not there for the want of the part is no fault of the station.
            verdicts.append(Verdict.FAIL)
            causes.append(text("missing or dead: {part}", part=word(str(absent))))
        verdict = together(verdicts)
        causes += [self._lacking(name, reasons.get(name)) for name in sorted(missing)]
        return verdict, lines(causes, "; ") if causes else NOTHING

    def _lacking(self, name: str, reason: Withheld | None) -> Text:
        if reason is None:
            return text("{parameter} was not found", parameter=ParameterLabels({})[name])
        return text(
            "{parameter} is not judged, {cause}: {why}",
            parameter=reason.label,
            cause=word(reason.cause),
            why=reason.message,
        )


def described(figure: MeasuredFigure) -> Text:
    """Return a figure with what speaks against it, in one line."""
    scale = scale_of(figure.value, figure.unit)
    value, expanded, low, high = (
        one / scale.factor for one in (figure.value, figure.expanded, figure.low, figure.high)
    )
    label = ParameterLabels({figure.parameter: figure.label})[figure.parameter]
    said = f"{value:.5g} ± {expanded:.2g} {scale.unit}".rstrip()
    limits = f"{low:.5g} … {high:.5g} {scale.unit}".rstrip()
    if math.isinf(low) or math.isinf(high):
        limits = f"≤ {high:.5g} {scale.unit}".rstrip() if math.isinf(low) else f"≥ {low:.5g} {scale.unit}".rstrip()
    if figure.verdict is Verdict.NOT_JUDGED:
        return text("{parameter} is not judged: no figure is given", parameter=label)
    if figure.verdict is Verdict.ERROR:
        return text(
            "{parameter} = {value} cannot be compared with {limits}: its uncertainty is too large",
            parameter=label,
            value=said,
            limits=limits,
        )
    return text("{parameter} = {value}, limits {limits}", parameter=label, value=said, limits=limits)


def half_width(interval: tuple[float, float]) -> float:
    """Return half of an interval's width; NaN where it has an end that is infinite."""
    half = 0.5 * (interval[1] - interval[0])
    return half if math.isfinite(half) else math.nan
