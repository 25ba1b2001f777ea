"""Operator of a run, who does its hand work."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bench.journal.events.run import ProcedureStarted
from bench.operators.entry import TypedEntry
from bench.safety.read_back import SourceReader
from bench.safety.station_instruments import Prompts
from drivers.interfaces import Instrument
from procedures.core.bench import Operator, Recorder, Role
from procedures.core.events import Event
from procedures.core.live_plot import NoObserver, RunObserver

if TYPE_CHECKING:
    from bench.operators.answers import Answers
    from bench.operators.fixture import FixtureOperator
    from bench.operators.panel_operator import DistantOperator
    from bench.operators.terminal import TerminalOperator
    from bench.operators.virtual import VirtualOperator


@dataclass(frozen=True, kw_only=True)
class RunOperator:
    """Somebody who needs nothing of the run; `prompts` asks for the readings of manual instruments.

    An operator that works with instruments of the station uses those in `roles`.
    """

    hands: Operator
    prompts: Prompts
    roles: frozenset[Role] = frozenset()

    @property
    def hand_time(self) -> float:
        """Bench time (s) of hand work, where it is known beforehand."""
        return 0.0

    @property
    def onlooker(self) -> RunObserver:
        """Observer of the run."""
        return NoObserver()

    @property
    def typing(self) -> TypedEntry | None:
        """The entry through which a person types readings; None if nobody does."""
        return None

    def announce(self, folder: Path) -> None:
        """Say in the run's folder how the operator is reached, where that is needed."""

    def equip(self, instruments: Mapping[Role, Instrument]) -> None:
        """Hand over the station's instruments."""

    def read_back(self, sources: SourceReader) -> None:
        """Hand over what reads the run's sources back while a person is asked."""

    def hear(self, event: Event) -> None:
        """Take an event of the journal."""

    def record_in(self, recorder: Recorder) -> None:
        """Give the run's journal to who keeps what is typed."""


def _no_prompt(_: Role) -> None:
    """Ask nobody: the virtual bench has no manual instruments."""


@dataclass(frozen=True, kw_only=True)
class TypedAnswers(RunOperator):
    """A file of answers, which hears which step asks."""

    answers: "Answers"

    def hear(self, event: Event) -> None:
        """Pass on what happens."""
        self.answers.hear(event)


@dataclass(frozen=True, kw_only=True)
class VirtualHands(RunOperator):
    """The virtual operator of a virtual bench."""

    worker: "VirtualOperator"

    @classmethod
    def of(cls, worker: "VirtualOperator") -> "VirtualHands":
        """Return them."""
        return cls(hands=worker, prompts=_no_prompt, worker=worker)

    @property
    def hand_time(self) -> float:
        """Bench time (s) of hand work."""
        return self.worker.hand_time


@dataclass(frozen=True, kw_only=True)
class TerminalHands(RunOperator):
    """A person at a terminal; on a virtual bench the hands `behind` do what the person confirms."""

    person: "TerminalOperator"
    behind: RunOperator | None = None

    @property
    def hand_time(self) -> float:
        """Bench time (s) of hand work, on a virtual bench."""
        return self.behind.hand_time if self.behind else 0.0

    @property
    def typing(self) -> TypedEntry | None:
        """The entry through which the person types readings."""
        return self.person.entry

    def hear(self, event: Event) -> None:
        """Take an event of the journal: which reading is about to be typed."""
        self.person.entry.hear(event)

    def record_in(self, recorder: Recorder) -> None:
        """Keep what is typed in the run's journal."""
        self.person.entry.recorder = recorder


@dataclass(frozen=True, kw_only=True)
class PanelHands(RunOperator):
    """A person at a panel; on a virtual bench the hands `behind` do what the person confirms."""

    person: "DistantOperator"
    behind: RunOperator | None = None

    @property
    def hand_time(self) -> float:
        """Bench time (s) of hand work, on a virtual bench."""
        return self.behind.hand_time if self.behind else 0.0

    @property
    def onlooker(self) -> RunObserver:
        """Observer at the panels."""
        return self.person

    def announce(self, folder: Path) -> None:
        """Say in the run's folder how the person is reached."""
        self.person.line.announce(folder)

    def read_back(self, sources: SourceReader) -> None:
        """Show the sources' state on the run's line."""
        self.person.sources = sources

    @property
    def typing(self) -> TypedEntry | None:
        """The entry through which the person types readings."""
        return self.person.entry

    def hear(self, event: Event) -> None:
        """Take an event of the journal: which reading is about to be typed, and where another procedure begins."""
        if isinstance(event, ProcedureStarted):
            self.person.show(None)
        self.person.entry.hear(event)

    def record_in(self, recorder: Recorder) -> None:
        """Keep what is typed in the run's journal."""
        self.person.entry.recorder = recorder


@dataclass(frozen=True, kw_only=True)
class FixtureHands(RunOperator):
    """The station's own fixture, which works with its instruments in `roles`; `beside` is who reads what is read by hand."""

    fixture: "FixtureOperator"
    beside: RunOperator

    @property
    def hand_time(self) -> float:
        """Bench time (s) of the fixture's work."""
        return self.fixture.hand_time

    @property
    def typing(self) -> TypedEntry | None:
        """The entry through which the person types readings."""
        return self.beside.typing

    def equip(self, instruments: Mapping[Role, Instrument]) -> None:
        """Hand over the station's instruments."""
        self.fixture.take(instruments)

    def hear(self, event: Event) -> None:
        """Take an event of the journal: what is energised, and when the shutdown opens the relays."""
        self.fixture.hear(event)
        self.beside.hear(event)

    def record_in(self, recorder: Recorder) -> None:
        """Keep what is typed in the run's journal."""
        self.beside.record_in(recorder)
