"""Carries out what is typed, one line after the other; what is refused changes nothing."""

from collections.abc import Callable
from functools import partial
from typing import Any, cast

from bench.by_hand.commands import JudgesCalls
from bench.by_hand.connections import refusal
from bench.by_hand.hand_work import WHILE_ON
from bench.by_hand.look_over import fitted_probes, probe_words, question
from bench.by_hand.outcome import help_on, kept, outcome_of
from bench.by_hand.outputs import Outputs, StillOnError, stop
from bench.by_hand.requests import Confirm, Finish, HandTask, Help, Request, SwitchOff, TypedCommand, request_of
from drivers.interfaces import InstrumentError, MeasurementError, Oscilloscope, Role, SetpointError
from drivers.interfaces.declarations import Effect, Lasting, UndeclaredError
from drivers.interfaces.text import Text, lines, text, text_of
from procedures.core.actions import EnterCommand
from procedures.core.bench import Bench, ProcedureError
from procedures.core.setup import BenchSetup


class CommandRefusedError(Exception):
    """Something that is not done, and why; nothing was sent."""

    def __init__(self, why: Text) -> None:
        self.text = why
        super().__init__(why.render())


class CommandLoop:
    """The instruments in `roles` under a person's commands. `ranges` has the largest values of arguments, as far as they are known.

    `idle` (s) is how long something may be on without a command. What was read is kept in `read`.
    """

    def __init__(
        self, bench: Bench, roles: tuple[Role, ...], ranges: dict[str, float], outputs: Outputs, idle: float
    ) -> None:
        self._bench = bench
        self._roles = roles
        self._ranges = ranges
        self._outputs = outputs
        self._idle = idle
        self._said = text(
            "Ready: {roles}. First state what is connected to the motor's terminals (connect); help lists everything",
            roles=[role.value for role in roles],
        )
        self._refused, self._typed = False, ""
        self._probes = (
            fitted_probes(cast("Oscilloscope", bench.instrument(Role.OSCILLOSCOPE)))
            if Role.OSCILLOSCOPE in roles
            else ()
        )
        #: What is switched on once it is confirmed, and the setup that was looked at before.
        self._asked: TypedCommand | None = None
        self._looked_at: BenchSetup | None = None
        self.read: list[dict[str, Any]] = []
        #: What was typed and did nothing.
        self.refused: list[str] = []

    def until_finished(self) -> None:
        """Ask for commands and carry them out until the word is finish."""
        while (request := self._next()) is None or not isinstance(request, Finish):
            asked, self._asked = self._asked, None
            if isinstance(request, Confirm):
                if asked is None:
                    self._refused, self._said = True, text("there is nothing to confirm; help lists the commands")
                    continue
                self._looked_at, request = self._bench.state.setup, asked
            if request is not None:
                self._refused = False
                self._said = self._carried_out(request)

    def _next(self) -> Request | None:
        """Return what is commanded next; None where that is refused, or where nobody commanded anything in time."""
        line = self._bench.command(self._question())
        if self._refused and self._typed:
            self.refused.append(self._typed)
        self._typed = line or ""
        if line is None:
            self._refused = True
            self._said = text(
                "No command for {idle:g} s. {off}", idle=self._idle, off=self._switched_off(self._outputs.all_off)
            )
            return None
        try:
            return request_of(line, self._roles)
        except ValueError as refused:
            self._refused, self._said = True, text_of(refused)
            return None

    def _question(self) -> EnterCommand:
        on = self._outputs.words
        roles = tuple(role.value for role in self._roles)
        confirms = self._asked.typed if self._asked else ""
        idle = self._idle if on else None
        return EnterCommand(self._said, self._refused, on, idle, roles, self._ranges, self._probes, confirms)

    def _carried_out(self, request: TypedCommand | HandTask | Help | SwitchOff) -> Text:
        """Do it and return what came of it. Raises StillOnError where something cannot be switched off."""
        match request:
            case Help(role):
                told = [probe_words(probe) for probe in self._probes] if role is Role.OSCILLOSCOPE else []
                return lines([help_on(role, self._roles, self._ranges), *told])
            case SwitchOff(role):
                off = self._outputs.all_off if role is None else partial(self._switch_off, role)
                return self._switched_off(off)
        try:
            return self._by_hand(request) if isinstance(request, HandTask) else self._call(request)
        except (CommandRefusedError, SetpointError, UndeclaredError, ProcedureError) as refused:
            self._refused = True
            return refused.text
        except StillOnError:
            raise
        except InstrumentError as failed:
            self._refused = True
            return self._after(failed)

    def _switched_off(self, off: Callable[[], None]) -> Text:
        """Switch off and say so, and what an instrument reported of it, as that a protection had switched it off before."""
        try:
            off()
        except StillOnError:
            raise
        except InstrumentError as reported:
            self._refused = True
            return reported.text
        on = self._outputs.words
        return text("Off; still on: {on}", on=list(on)) if on else text("Everything is off")

    def _switch_off(self, role: Role) -> None:
        if role in self._outputs:
            self._outputs.off(role)
        else:
            # It may be on although nobody here switched it on.
            stop(role, self._bench.instrument(role))

    def _by_hand(self, work: HandTask) -> Text:
        if self._outputs and not isinstance(work.action, WHILE_ON):
            raise CommandRefusedError(
                text(
                    "switch everything off before working by hand; this is still on: {on}. Type off first",
                    on=list(self._outputs.words),
                )
            )
        self._bench.perform(work.action)
        return text("Done: {typed}", typed=work.typed)

    def _call(self, call: TypedCommand) -> Text:
        command, role = call.command, call.command.role
        instrument, declaration = self._bench.instrument(role), call.command.declaration
        if declaration.effect is Effect.MAKES_SAFE:
            command.carried_out(instrument, call.values)
            self._outputs.off(role)
            return outcome_of(call, None)
        if declaration.effect is not Effect.ENERGISES:
            given = command.carried_out(instrument, call.values)
            result = outcome_of(call, given)
            if given is not None:
                self.read.append(kept(call, given))
            return result
        if role in self._outputs:
            raise CommandRefusedError(text("{role} is already on; type off {role} first", role=role.value))
        if (why := refusal(role, self._bench.state.setup)) is not None:
            raise CommandRefusedError(why)
        # Nobody looks over a bench for what is refused anyway.
        command.judged(cast("JudgesCalls", instrument), call.values)
        if self._bench.state.setup != self._looked_at:
            self._asked = call
            return question(call.typed, self._bench.state.setup, self._probes)
        return self._energise(call)

    def _energise(self, call: TypedCommand) -> Text:
        role, instrument = call.command.role, self._bench.instrument(call.command.role)
        match call.command.declaration.lasting:
            case Lasting.BLOCK:
                self._outputs.block(role, call.typed, call.command.carried_out(instrument, call.values))
            case Lasting.UNTIL_STOPPED:
                try:
                    call.command.carried_out(instrument, call.values)
                except BaseException:
                    stop(role, instrument)
                    raise
                self._outputs.turning(role, call.typed, instrument)
            case _:
                result = call.command.carried_out(instrument, call.values)
                self.read.append(kept(call, result))
                return outcome_of(call, result)
        return outcome_of(call, None)

    def _after(self, failed: InstrumentError) -> Text:
        """Switch everything off where an instrument failed; a reading that is none leaves things as they are."""
        if isinstance(failed, MeasurementError) or not self._outputs:
            return failed.text
        self._outputs.all_off(failed)
        return text("{failed}. Everything was switched off", failed=failed.text)
