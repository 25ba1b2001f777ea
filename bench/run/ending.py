"""How a run ends: the shutdown of all its instruments, and its last event."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from bench.journal.errors import RecordError
from bench.journal.events.run import RunFinished
from bench.journal.events.safety import ShutdownStarted
from bench.journal.journal import Journal
from bench.journal.run_view import RunView
from bench.journal.stored_result import Sentence
from bench.run.partial_results import PartialResults
from bench.safety.guardian.link import SWITCHED_OFF, Guard, Unguarded
from bench.safety.interrupts import Interrupts
from bench.safety.shutdown import failures, shut_down
from bench.station.sharing import NotShared, Sharing
from bench.station.shutdown_sequence import OFF_BY, ShutdownSequence
from drivers.interfaces import Clock, Instrument, InstrumentError
from drivers.interfaces.text import Text, Translate, lines, text
from procedures.core.bench import Role

_MAY_BE_ON = text(
    "What could not be made safe may still be on: switch it off by hand, at the mains switch or with the emergency stop"
)


class Instruments(Protocol):
    """The station's instruments, opened when first needed."""

    def available(self) -> Mapping[Role, Instrument]:
        """Return one for every role of the station; what is not open yet opens when first used."""

    def open(self, role: Role) -> None:
        """Open the instrument of a role now, where the station has one."""

    def opened(self) -> Mapping[Role, Instrument]:
        """Return those that are open, without anything in front of them."""

    def get(self, role: Role) -> Instrument:
        """Return the instrument of a role, opened, behind the limits; the journal hears nothing of its calls."""

    def silent(self) -> Collection[Role]:
        """Return the roles whose instrument did not answer its last call."""

    def close(self, roles: Collection[Role] | None = None) -> Sequence[str]:
        """Close all, or those of these roles, independently of each other; return what failed."""


@dataclass(frozen=True, kw_only=True)
class RunEnding:
    """The parts of a run that its end needs; `view` is what the journal comes to."""

    instruments: Instruments
    clock: Clock
    journal: Journal
    view: RunView
    translate: Translate
    way_down: ShutdownSequence = field(default_factory=ShutdownSequence)
    interrupts: Interrupts = field(default_factory=Interrupts)
    guard: Guard = field(default_factory=Unguarded)
    sharing: Sharing = field(default_factory=NotShared)
    #: Bench time (s) of hand work so far, where it is known.
    hand_time: Callable[[], float] = lambda: 0.0
    partial: PartialResults = field(default_factory=PartialResults)
    #: What ended the run where its record could not be written.
    unwritten: list[RecordError] = field(default_factory=list)
    #: What neither the run nor its guardian could switch off, or verify that it is.
    left_on: list[str] = field(default_factory=list)

    def _down(self, causes: Sequence[Text]) -> list[str]:
        self.interrupts.shutdown_begins()
        self.guard.going_down()
        try:
            why = lines(causes).render(self.translate) if causes else "the procedures have ended"
            self.journal.record(ShutdownStarted(cause=why, **self.interrupts.delays()))
        except OSError:
            # The shutdown does not need the journal; what needs it is said when the run is finished.
            pass
        unsafe = self._walk()
        faults = self.instruments.close()
        self.sharing.release()
        journal_lost = self.journal.failure is not None
        result = [*unsafe, *faults, *self.guard.dismiss(journal_lost=journal_lost, unsafe=bool(unsafe))]
        if unsafe and SWITCHED_OFF not in result:
            self.left_on.extend(unsafe)
            result.append(_MAY_BE_ON.render(self.translate))
        return result

    def _conclude_left(self, causes: list[Text]) -> None:
        """Have the procedure that an abort has left make what it can of what it took; whoever is in a hurry has it in the journal."""
        if self.interrupts.hurry.is_set():
            return
        try:
            unmade = self.partial.conclude(self.journal, lines(causes))
        except OSError:
            # Said when the run is finished.
            return
        if unmade is not None:
            causes.append(unmade)

    def _walk(self) -> list[str]:
        opened, hurry = self.instruments.opened(), self.interrupts.hurry
        silent = self.instruments.silent()
        return failures(shut_down(self.way_down, opened, self.journal, self.clock, hurry=hurry, silent=silent))

    def _finish(self, status: str, causes: Sequence[Text], bench_time: float, wall_time: float) -> None:
        ended = RunFinished(
            status=status,
            **self._why(causes),
            bench_time=bench_time,
            wall_time=wall_time,
            guardian=self.guard.record_end(),
            hand_time=self.hand_time(),
        )
        try:
            self.journal.record(ended)
        except OSError as error:
            # The disk is full or gone: the view is told directly, so that the caller still learns how it ended.
            if not any(str(error) in str(cause) for cause in causes):
                causes = [*causes, text("the journal cannot be written: {error}", error=error)]
            self.view.apply(replace(ended, status="failed", **self._why(causes)))
        self.journal.close()

    def _why(self, causes: Sequence[Text]) -> dict[str, Any]:
        """Return why a run ended as its last event has it."""
        if not causes:
            return {"cause": ""}
        why = lines(causes)
        return {"cause": why.render(self.translate), "told": Sentence(why)}


def secure(instruments: Instruments, roles: Iterable[Role], walk: Callable[[], Sequence[str]]) -> list[str]:
    """Open the instruments of these roles independently of each other, and carry out the shutdown; return what failed."""
    unreached = []
    for role in sorted(roles, key=lambda role: role.value):
        try:
            instruments.open(role)
        except InstrumentError as error:
            left_on = "it may be on, and " if role in OFF_BY else ""
            unreached.append(f"{role.value} cannot be reached, {left_on}nobody has switched it off: {error}")
    return [*unreached, *walk()]
