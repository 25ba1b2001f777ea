"""The bench as a procedure uses it: instruments by role, an operator for manual work, the clock and the journal."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
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
from drivers.interfaces.text import text
from procedures.core.actions import (
    Action,
    DoByHand,
    DoubtReading,
    EnterCommand,
    HandWork,
    Mend,
    UncoupleDynamometer,
    Wanted,
)
from procedures.core.events import ActionDone, ActionStarted, Event, Given, StepFailed, StepFinished, StepStarted
from procedures.core.live_plot import LivePlot, NoObserver, RunObserver
from procedures.core.procedure_error import ProcedureError as ProcedureError
from procedures.core.setup_change import ChangeSetup
from procedures.core.setup_order import ordered_changes
from procedures.core.setup_rules import SetupRules
from procedures.core.setup_wanted import setup_wanted
from procedures.core.steps import Step
from procedures.verification.bench_state import BenchState


class Operator(Protocol):
    """Performs manual work: a person at a terminal or a panel, a virtual operator, or a fixture with a switch matrix."""

    def perform(self, action: HandWork) -> object:
        """Perform an action and return its result.

        A float for `EnterReading`, angles in rad for `MarkRestPositions`, whether it was done for `Mend`, whether to read
        again for `DoubtReading`, the words typed for `EnterCommand`, else None.
        """


class Feeding(Protocol):
    """Sources that feed the motor or drive its shaft."""

    @property
    def roles(self) -> Collection[Role]:
        """The roles that feed the motor or drive its shaft now."""

    @property
    def turned(self) -> bool:
        """True if something has driven the shaft since it was last seen at rest."""

    def stands(self) -> None:
        """Say that the shaft was seen at rest."""


class NothingEnergised:
    """A bench state without any instrument that is known to be on."""

    roles: Collection[Role] = ()
    turned = False

    def stands(self) -> None:
        """Do nothing: there is nothing to reset."""


class Recorder(Protocol):
    """The journal, as a procedure sees it."""

    def record(self, event: Event) -> None:
        """Append one event; when this returns, it has been handed to the operating system."""


class Bench:
    """The instruments of a station by role, the operator, the clock, the journal, and the run's uncertainty inputs.

    `session` is the number of the run's session: 1, and one more each time the run is resumed. `feeding` tells what is on, `onlooker`
    whether somebody watches.
    """

    def __init__(
        self,
        instruments: Mapping[Role, Instrument],
        operator: Operator,
        clock: Clock,
        recorder: Recorder,
        session: int = 1,
        feeding: "Feeding | None" = None,
        onlooker: RunObserver | None = None,
    ) -> None:
        self._instruments = dict(instruments)
        self._operator = operator
        self.clock = clock
        self.recorder = recorder
        self._feeding = feeding or NothingEnergised()
        self._onlooker = onlooker or NoObserver()
        # Late: whoever only needs the roles, as a guardian does, is ready in half the time without.
        from procedures.core.budget import Uncertainties
        from procedures.techniques.temperature.thermometer import Thermometer

        self.uncertainties: Uncertainties = Uncertainties(session)
        self.thermometer: Thermometer = Thermometer(self.uncertainties)
        #: What hands have left, and what is known of the wiring.
        self.state = BenchState()

    def check_off(self) -> None:
        """Raise ProcedureError if an instrument still feeds the motor or drives its shaft."""
        if roles := sorted(role.value for role in self._feeding.roles):
            raise ProcedureError(
                text("{roles} was still on when the procedure ended: this is an error of the procedure", roles=roles)
            )

    def without_instruments(self) -> "Bench":
        """Return this bench without its instruments, for calculations after the measurement."""
        left = copy(self)
        left._instruments = {}
        return left

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
        """The oscilloscope, corrected by its verification; without one, with its probes' limits, which the operator is asked for."""
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

    def perform(self, *actions: Action) -> None:
        """Let the operator perform actions that give no reading.

        Actions that change the setup are done together, in the safe order; what is already as requested is not asked for again. Raises
        ProcedureError, before anything is changed, if an instrument is on or if the requested connections are not allowed together.
        """
        if wanted := [action for action in actions if isinstance(action, Wanted)]:
            self._change_setup(wanted)
        for action in actions:
            if isinstance(action, DoByHand):
                self._check_off()
            if not isinstance(action, Wanted):
                self._perform(action)

    def angles(self, action: HandWork) -> list[float]:
        """Let the operator perform an action that gives angles (rad)."""
        return [float(angle) for angle in cast("list[float]", self._perform(action))]

    def reading(self, action: HandWork) -> float:
        """Let the operator enter a reading."""
        return float(cast("float", self._perform(action)))

    def mended(self, mend: Mend) -> bool:
        """Ask the operator to correct a connection; return whether that was done."""
        return self._perform(mend) is True

    def doubted(self, doubt: DoubtReading) -> bool:
        """Ask about a reading that contradicts the others of its series; return whether to take it again."""
        return self._perform(doubt) is True

    @contextmanager
    def step(self, step: Step, values: dict[str, object]) -> Iterator[None]:
        """Run one step; the journal records its start, and its end or failure."""
        words = step.words(values)
        self.recorder.record(StepStarted(step=step.identifier, text=words.render(), time=self.clock.now()))
        try:
            yield
        except BaseException as error:
            message = f"{type(error).__name__}: {error}"
            self.recorder.record(StepFailed(step=step.identifier, error=message, time=self.clock.now()))
            raise
        self.recorder.record(StepFinished(step=step.identifier, time=self.clock.now()))

    def show(self, make: Callable[[], LivePlot]) -> None:
        """Show a plot to the people who watch the run; the plot is made only if somebody watches."""
        if self._onlooker.looks:
            self._onlooker.show(make())

    def command(self, action: EnterCommand) -> str | None:
        """Ask for a command; None if nobody gives one in time."""
        return cast("str | None", self._perform(action))

    def instrument(self, role: Role) -> Instrument:
        """Return the instrument of a role, as its driver gives it. Raises ProcedureError if the station has none."""
        return self._get(role)

    def _change_setup(self, wanted: Sequence[Wanted]) -> None:
        if Role.DYNAMOMETER not in self._instruments:
            # There is nothing to take the shaft off.
            wanted = [each for each in wanted if not isinstance(each, UncoupleDynamometer)]
        before, rules = self.state.setup, SetupRules(self._instruments, self.state.in_use, self.state.motor_voltage)
        after = setup_wanted(before, wanted, rules.may_stay)
        rules.check(after)
        changes = ordered_changes(before, after, turned=self._feeding.turned)
        if not changes:
            self.state.changed(after)
            return
        touched = set(before.contacts) != set(after.contacts) or before.coupled != after.coupled
        if touched:
            self._check_off()
        try:
            self._perform(ChangeSetup(changes, before, after))
        except BaseException:
            # Nobody can tell how far the hands have got.
            self.state.forget()
            raise
        self._feeding.stands()
        self.state.changed(after)

    def _check_off(self) -> None:
        """Raise ProcedureError where something feeds the motor or drives its shaft."""
        if self._feeding.roles:
            raise ProcedureError(
                text(
                    "{roles} is on: switch it off before any lead or coupling is touched",
                    roles=sorted(role.value for role in self._feeding.roles),
                )
            )

    def _perform(self, action: HandWork) -> object:
        name = type(action).__name__
        lines = [str(line) for line in action.lines({})]
        self.recorder.record(ActionStarted(action=name, details=action, text=lines))
        result = cast("Given", self._operator.perform(action))
        self.recorder.record(ActionDone(action=name, given=result))
        return result

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
