"""Runs procedures one after the other, and carries out the shutdown however it ends."""

import traceback
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from time import monotonic
from typing import Any

from bench.i18n.errors import at, fault, message, told, untranslated
from bench.journal.errors import RecordError
from bench.journal.events.run import (
    CapabilityNotChecked,
    ConsistencyChecked,
    KnownBefore,
    LeaseBegun,
    LeaseEnded,
    ProcedureFailed,
    ProcedureFinished,
    ProcedureStarted,
)
from bench.journal.run_view import RunView
from bench.journal.stored_result import Sentence
from bench.plugins.faults import plugin_fault, procedure_origin
from bench.run.ending import RunEnding, secure
from bench.run.feeding import FeedingRoles
from bench.run.plan import Planned
from bench.run.retry_policy import After, Attempt, Next, stop_at_failure
from bench.run.tape import Tape
from bench.run.taped import taped_bench
from bench.safety.interrupts import Interrupted
from drivers.interfaces import InstrumentError
from drivers.interfaces.text import Text, lines, text, word
from procedures.core.bench import Bench, Operator, ProcedureError, Role
from procedures.core.earlier_call import EarlierAttempt
from procedures.core.events import Event
from procedures.core.live_plot import NoObserver, RunObserver
from procedures.core.nameplate import Nameplate
from procedures.core.procedure import Procedure
from procedures.core.procedure_error import RepeatRequestedError
from procedures.core.result import Notice
from procedures.estimation.fitting.fit import EstimationError
from procedures.plausibility.consistency import check_consistency
from procedures.verification.stated_probes import StatedProbes
from procedures.verification.verified_channels import PROBE_VERIFICATION, VerifiedChannels


@dataclass(frozen=True, kw_only=True)
class Runner(RunEnding):
    """Runs what is planned; the journal's view also holds what an earlier run of the same folder finished."""

    operator: Operator
    nameplate: Nameplate
    verified_channels: VerifiedChannels = field(default_factory=VerifiedChannels)
    stated_probes: StatedProbes = field(default_factory=StatedProbes)
    #: Keeps what procedures are given, where readings are typed.
    tape: Tape | None = None
    onlooker: RunObserver = field(default_factory=NoObserver)
    #: Raises where a virtual bench was brought, since a bench time (s), where its physics does not follow.
    check_modelled: Callable[[float], None] = lambda _: None
    #: What earlier sessions did in procedures that were left, by name.
    earlier: Mapping[str, Sequence[EarlierAttempt]] = field(default_factory=dict)

    def run(
        self,
        plan: Sequence[Planned],
        begin: Event,
        *,
        after: After = stop_at_failure,
        repeat: Collection[str] = (),
        warnings: Sequence[Notice] = (),
        unsafe_before: bool = False,
    ) -> RunView:
        """Run what is not finished yet and return the view; never raises for what happens on the bench.

        `begin` is the first event; `warnings` hold for the whole run. The status is `completed`,
        `failed` or `aborted`. `after` says what follows each attempt at a procedure. What is named in `repeat` runs
        although it is finished; its new result takes the place of the old one, which stays in the journal.
        `unsafe_before` says that an earlier session may have left something on: it is switched off before all else.
        """
        started, bench_started = monotonic(), self.clock.now()
        self.journal.listen(self.interrupts.hear)
        status, causes = "completed", list[Text]()
        with self.interrupts.raising():
            try:
                try:
                    status = self._measure(plan, begin, after, repeat, warnings, causes, unsafe_before=unsafe_before)
                finally:
                    # From here on no request to stop is raised any more.
                    self.interrupts.shutdown_begins()
            except (Interrupted, KeyboardInterrupt) as stop:
                status = "aborted"
                causes.append(_interruption(stop))
            except (Exception, SystemExit) as error:  # noqa: BLE001  the journal itself may have failed; the shutdown follows all the same
                status = "failed"
                causes.append(told(error))
                if isinstance(error, RecordError):
                    self.unwritten.append(error)
            finally:
                unsafe = self._down(causes)
                causes += map(untranslated, unsafe)
                self._conclude_left(causes)
                if unsafe and status == "completed":
                    status = "failed"
                self._finish(status, causes, self.clock.now() - bench_started, monotonic() - started)
        return self.view

    def _measure(
        self,
        plan: Sequence[Planned],
        begin: Event,
        after: After,
        repeat: Collection[str],
        warnings: Sequence[Notice],
        causes: list[Text],
        *,
        unsafe_before: bool,
    ) -> str:
        """Do what is planned; return the status, and put into `causes` why a procedure failed."""
        status = "completed"
        self.journal.record(begin)
        self.interrupts.check()
        feeding = FeedingRoles()
        self.journal.listen(feeding.hear)
        bench = self._bench(feeding)
        verified = self.view.finished.get(PROBE_VERIFICATION)
        bench.state.verified_channels = (
            VerifiedChannels.of_findings(verified.findings) if verified else self.verified_channels
        )
        bench.state.stated_probes = self.stated_probes
        for notice in warnings:
            self._tell("", notice)
        left = [planned for planned in plan if planned.name in repeat or planned.name not in self.view.finished]
        if unsafe_before:
            self._secure(left)
        for planned in left:
            if not self._shares(planned):
                self._check_capability(bench, planned)
        for planned in left:
            attempt = self._procedure(bench, planned)
            while isinstance(attempt.error, RepeatRequestedError) or (follows := after(attempt)) is Next.AGAIN:
                attempt = self._procedure(bench, planned)
            if attempt.error is not None:
                status = "failed"
                causes.append(at(planned.name, attempt.told))
            if follows is Next.STOP:
                break
        self._check_consistency(plan)
        # One that was swallowed is no reason to call the run complete.
        self.interrupts.check()
        return status

    def _bench(self, feeding: FeedingRoles) -> Bench:
        """Return what the procedures see of the world; behind the tape where somebody types readings."""
        instruments, beside = self.instruments.available(), (self.view.sessions, feeding, self.onlooker)
        if self.tape is None:
            return Bench(instruments, self.operator, self.clock, self.journal, *beside)
        return taped_bench(instruments, self.instruments.get, self.operator, self.clock, self.tape, *beside)

    def _secure(self, left: Sequence[Planned]) -> None:
        """Bring what is still needed to its harmless state; hands must not touch what was left on."""
        roles = {role for planned in left for role in planned.procedure.roles}
        if unsafe := secure(self.instruments, roles, self._walk):
            raise InstrumentError(
                "the bench", "; ".join(unsafe), remedy=text("Switch it off by hand, then go on with --resume")
            )

    def _tell(self, procedure: str, notice: Notice) -> None:
        """Put a warning into the journal that is known before anything is energised."""
        sentence = notice.message.render(self.translate)
        self.journal.record(KnownBefore(procedure=procedure, warning=notice, message=sentence))

    def _check_capability(self, bench: Bench, planned: Planned) -> None:
        try:
            for notice in planned.procedure.check_capability(bench, self.nameplate, planned.settings):
                self._tell(planned.name, notice)
        except (InstrumentError, ProcedureError) as error:
            # Nothing is claimed of an instrument that does not answer; the procedure itself will say so.
            self.journal.record(CapabilityNotChecked(procedure=planned.name, cause=message(error, self.translate)))

    def _check_consistency(self, plan: Sequence[Planned]) -> None:
        findings = {name: result.findings for name, result in self.view.finished.items()}
        procedures = {planned.name: planned.procedure for planned in plan}
        alarms = check_consistency(self.view.parameters(), findings, self.nameplate, procedures)
        self.journal.record(ConsistencyChecked(warnings=alarms))

    def _procedure(self, bench: Bench, planned: Planned) -> Attempt:
        """Make one attempt."""
        self.interrupts.check()
        parameters = self.view.parameters()

        def made() -> Procedure[Any]:
            procedure = planned.procedure(bench, self.nameplate, planned.settings, parameters.parameters)
            procedure.withheld_before = parameters.withheld
            procedure.earlier = self.earlier.get(planned.name, ())
            self.partial.begin(procedure)
            return procedure

        values = made().step_values()
        steps = {step.identifier: step.words(values).render(self.translate) for step in planned.procedure.steps()}
        self.journal.record(
            ProcedureStarted(
                procedure=planned.name,
                section=planned.procedure.section,
                settings=planned.settings.model_dump(mode="json"),
                values={name: value for name, value in values.items() if isinstance(value, int | float | str)},
                steps=steps,
            )
        )
        started, shared = self.clock.now(), self._shares(planned)
        try:
            if shared:
                waited = self.sharing.acquire(shared, planned.name)
                started += waited
                self.journal.record(LeaseBegun(instruments=sorted(role.value for role in shared), waited=waited))
                self._check_capability(bench, planned)
            for role in sorted(planned.procedure.roles, key=lambda role: role.value):
                self.instruments.open(role)
            result = self.tape.perform(bench, made) if self.tape else made().run()
            self.check_modelled(started)
            self.journal.record(ProcedureFinished(result=result))
            self.partial.forget()
        except BaseException as error:
            why = _cause(error, planned)
            cause = why.render(self.translate)
            self.journal.record(
                ProcedureFailed(
                    procedure=planned.name,
                    cause=cause,
                    told=Sentence(why),
                    trace=traceback.format_exception(error),
                )
            )
            if not isinstance(error, Exception | SystemExit) or isinstance(error, RecordError):
                # What is shared stays so until the shutdown is done.
                raise
            self._walk()
            # The shutdown has opened relays, and people look what is wrong.
            bench.state.forget()
            if isinstance(error, RepeatRequestedError):
                self.partial.forget()
            if unmade := self.partial.conclude(self.journal, why):
                why = lines([why, unmade])
            self._give_back(shared)
            return Attempt(planned, started, self.clock.now(), error=error, cause=cause, told=why)
        ended = self.clock.now()
        self._give_back(shared)
        return Attempt(planned, started, ended, result)

    def _shares(self, planned: Planned) -> frozenset[Role]:
        return planned.procedure.roles & self.sharing.roles

    def _give_back(self, shared: Collection[Role]) -> None:
        if shared:
            faults = self.instruments.close(shared)
            self.sharing.release()
            self.journal.record(LeaseEnded(faults=faults))


def _interruption(stop: BaseException) -> Text:
    return told(stop) if isinstance(stop, Interrupted) else text("interrupted")


def _cause(error: BaseException, planned: Planned) -> Text:
    if isinstance(error, ProcedureError | InstrumentError | EstimationError | Interrupted):
        return told(error)
    if isinstance(error, SystemExit):
        return text("it tried to end the program, which a procedure must not do: {fault}", fault=fault(error))
    origin = procedure_origin(planned.name, planned.procedure) if isinstance(error, Exception) else None
    if origin is None or isinstance(error, OSError | RecordError):
        return fault(error)
    return plugin_fault(error, text("procedure {name}", name=word(planned.name)), origin, planned.procedure.__module__)
