"""What a procedure sees of the world: instruments by role, hands, time, a record."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Protocol, cast

from drivers.interfaces import (
    BldcDrive,
    Clock,
    Dynamometer,
    Instrument,
    InsulationTester,
    Inverter,
    LcrMeter,
    Oscilloscope,
    Supply,
    Tachometer,
    Voltmeter,
)
from drivers.interfaces import Role as Role
from drivers.interfaces.text import Text, text
from procedures.core.actions import Action, DoubtReading, EnterCommand, Mend
from procedures.core.events import ActionDone, ActionStarted, Event, Given, StepFailed, StepFinished, StepStarted
from procedures.core.steps import Step
from procedures.verification.bench_state import BenchState


class Operator(Protocol):
    """Whoever has hands: a person at a terminal or a panel, a virtual operator, a switch matrix."""

    def perform(self, action: Action) -> object:
        """Do it and return what it gives.

        A float for `EnterReading`, angles in rad for `MarkRestPositions`, whether it was done for `Mend`, whether to read
        again for `DoubtReading`, the words typed for `EnterCommand`, else None.
        """


class Recorder(Protocol):
    """The journal, as a procedure sees it."""

    def record(self, event: Event) -> None:
        """Append one event; it is on its way to the disk when this returns."""


class ProcedureError(Exception):
    """A measurement cannot go on; the message names what was found and what to do."""

    def __init__(self, message: Text) -> None:
        self.text = message
        super().__init__(message.render())


class Bench:
    """The instruments of a station by role, the operator, the clock, the journal, and the run's uncertainty inputs.

    `session` counts a run's beginnings: 1, and one more each time it is resumed.
    """

    def __init__(
        self,
        instruments: Mapping[Role, Instrument],
        operator: Operator,
        clock: Clock,
        recorder: Recorder,
        session: int = 1,
    ) -> None:
        self._instruments = dict(instruments)
        self._operator = operator
        self.clock = clock
        self.recorder = recorder
        # Late: whoever only needs the roles, as a guardian does, is ready in half the time without.
        from procedures.core.budget import Uncertainties
        from procedures.techniques.thermometer import Thermometer

        self.uncertainties: Uncertainties = Uncertainties(session)
        self.thermometer: Thermometer = Thermometer(self.uncertainties)
        #: What the actions done so far leave, and what is known of the wiring.
        self.state = BenchState()

    def has(self, role: Role) -> bool:
        """Tell whether the station has an instrument in this role."""
        return role in self._instruments

    @property
    def supply(self) -> Supply:
        """The DC supply."""
        return cast("Supply", self._get(Role.SUPPLY))

    @property
    def lcr_meter(self) -> LcrMeter:
        """The LCR meter."""
        return cast("LcrMeter", self._get(Role.LCR_METER))

    @property
    def oscilloscope(self) -> Oscilloscope:
        """The oscilloscope: corrected by its verification where there was one, else with its probes' limits, which are asked for."""
        scope, state = self.bare_oscilloscope, self.state
        return state.verified_channels.on(scope, state.stated_probes.on(scope, self.reading))

    @property
    def bare_oscilloscope(self) -> Oscilloscope:
        """The oscilloscope as its driver gives it."""
        return cast("Oscilloscope", self._get(Role.OSCILLOSCOPE))

    @property
    def dynamometer(self) -> Dynamometer:
        """The dynamometer."""
        return cast("Dynamometer", self._get(Role.DYNAMOMETER))

    @property
    def tachometer(self) -> Tachometer:
        """The tachometer."""
        return cast("Tachometer", self._get(Role.TACHOMETER))

    @property
    def inverter(self) -> Inverter:
        """The inverter."""
        return cast("Inverter", self._get(Role.INVERTER))

    @property
    def voltmeter(self) -> Voltmeter:
        """The DC voltmeter."""
        return cast("Voltmeter", self._get(Role.VOLTMETER))

    @property
    def drive(self) -> BldcDrive:
        """The six-step drive."""
        return cast("BldcDrive", self._get(Role.DRIVE))

    @property
    def insulation_tester(self) -> InsulationTester:
        """The insulation tester."""
        return cast("InsulationTester", self._get(Role.INSULATION_TESTER))

    def perform(self, action: Action) -> None:
        """Have an action done that gives no reading."""
        self._perform(action)

    def angles(self, action: Action) -> list[float]:
        """Have an action done that gives angles (rad)."""
        return [float(angle) for angle in cast("list[float]", self._perform(action))]

    def reading(self, action: Action) -> float:
        """Have a reading entered."""
        return float(cast("float", self._perform(action)))

    def mended(self, mend: Mend) -> bool:
        """Have something put right; tell whether it was."""
        return self._perform(mend) is True

    def doubted(self, doubt: DoubtReading) -> bool:
        """Ask about a reading that contradicts its siblings; tell whether it is to be taken again."""
        return self._perform(doubt) is True

    @contextmanager
    def step(self, step: Step, values: dict[str, object]) -> Iterator[None]:
        """Run one step: it begins in the journal, and its end or its failure stands there too."""
        words = step.words(values)
        self.recorder.record(StepStarted(step=step.identifier, text=words.render(), time=self.clock.now()))
        try:
            yield
        except BaseException as error:
            said = f"{type(error).__name__}: {error}"
            self.recorder.record(StepFailed(step=step.identifier, error=said, time=self.clock.now()))
            raise
        self.recorder.record(StepFinished(step=step.identifier, time=self.clock.now()))

    def command(self, action: EnterCommand) -> str | None:
        """Have a command said; None where nobody has said one in time."""
        return cast("str | None", self._perform(action))

    def instrument(self, role: Role) -> Instrument:
        """Return the instrument of a role, as its driver gives it. Raises ProcedureError where the station has none."""
        return self._get(role)

    def _perform(self, action: Action) -> object:
        name = type(action).__name__
        lines = [str(line) for line in action.lines({})]
        self.recorder.record(ActionStarted(action=name, details=action, text=lines))
        given = cast("Given", self._operator.perform(action))
        self.state.after(action)
        self.recorder.record(ActionDone(action=name, given=given))
        return given

    def _get(self, role: Role) -> Instrument:
        try:
            return self._instruments[role]
        except KeyError:
            raise ProcedureError(
                text(
                    "this procedure needs a {role}, and the station has none; add [instruments.{role}] to the station file",
                    role=role.value,
                )
            ) from None
