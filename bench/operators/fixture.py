"""A fixture in place of hands: a switch matrix connects, a rotor actuator holds, turns and frees the shaft."""

from collections.abc import Callable, Mapping, Sequence
from typing import assert_never, cast

from bench.journal.events.instruments import DeEnergised, Energising
from bench.journal.events.safety import MadeSafe
from bench.operators.rest import RestFinder
from drivers.interfaces import Clock, Instrument, Role, RotorActuator, SwitchMatrix
from drivers.interfaces.role import ROLES as SPECS
from drivers.interfaces.text import Text, text
from procedures.core.actions import (
    ChangeSetup,
    DoByHand,
    DoubtReading,
    EnterCommand,
    EnterReading,
    HandWork,
    MarkRestPositions,
    Mend,
    StartTurning,
    StopTurning,
    TurnToRest,
)
from procedures.core.bench import ProcedureError
from procedures.core.events import Event
from procedures.core.setup import BenchSetup, LeadContact
from procedures.core.setup_change import Change, ChangeKind

#: The roles that a fixture consists of.
ROLES = frozenset(role for role, spec in SPECS.items() if spec.in_fixture)
#: What feeds the terminals; while one of them does, no relay is switched.
_SOURCES = frozenset(role.value for role, spec in SPECS.items() if spec.feeds_winding)
#: How far (rad) a shaft is moved to feel whether it is free: further than the actuator may stop short.
_FEELING = 0.1
#: The relay that joins the bridge's leads.
_SHORT = "leads:short"


class FixtureOperator:
    """Performs actions with the instruments of a fixture; `take` passes them, `hear` passes the journal's events.

    `thermometer` gives the winding's temperature (°C), None where the fixture has none. `hand_time` counts the bench time (s)
    that the fixture's work took.
    """

    def __init__(self, clock: Clock, thermometer: Callable[[], float | None] = lambda: None) -> None:
        self._clock = clock
        self._thermometer = thermometer
        self._instruments: Mapping[Role, Instrument] = {}
        self._closed: frozenset[str] = frozenset()
        self._points: tuple[frozenset[str], frozenset[str]] | None = None
        self._feeding = 0
        self._felt = False
        self.hand_time = 0.0

    def take(self, instruments: Mapping[Role, Instrument]) -> None:
        """Take the station's instruments, by role, to work with."""
        self._instruments = instruments

    def hear(self, event: Event) -> None:
        """Take an event of the journal: what is energised, and when the shutdown opens the relays."""
        match event:
            case Energising():
                self._feeding += event.instrument in _SOURCES
            case DeEnergised():
                self._feeding -= event.instrument in _SOURCES
            case MadeSafe() if event.instrument == Role.SWITCH_MATRIX.value:
                self._closed = frozenset()

    def perform(self, action: HandWork) -> object:
        """Do it; ProcedureError where the fixture cannot, and what its instruments raise."""
        start = self._clock.now()
        try:
            return self._do(action)
        finally:
            self.hand_time += self._clock.now() - start

    def _do(self, action: HandWork) -> object:
        match action:
            case ChangeSetup():
                self._change_setup(action)
            case TurnToRest():
                self._rest().nudge()
            case MarkRestPositions():
                return self._rest().mark(action.turns)
            case StartTurning():
                self._actuator.turn(action.speed)
            case StopTurning():
                self._actuator.stop()
            case EnterReading():
                return self._read(action)
            case EnterCommand():
                raise ProcedureError(
                    text("a fixture gives no commands: use --operator terminal or panel for instruments by hand")
                )
            case DoByHand(said=said):
                raise ProcedureError(
                    text("a fixture cannot do this: {work}; use --operator terminal or panel for it", work=said)
                )
            case Mend():
                # What is wrong although every relay followed is for a person to find.
                return False
            case DoubtReading():
                # Nobody can tell; what was read stays, and the result says that it contradicts the rest.
                return False
            case _:
                assert_never(action)
        return None

    def _release(self) -> None:
        """Free the shaft; the first time it is moved forth and back, which the actuator refuses to call done where it jams."""
        self._actuator.release()
        if not self._felt:
            self._actuator.move_by(_FEELING)
            self._actuator.move_by(-_FEELING)
            self._felt = True

    def _change_setup(self, action: ChangeSetup) -> None:
        """Do one change after the other; relays that do alike are switched together, opened ones before those that close."""
        self._check(action.after)
        waiting: list[Change] = []
        for change in action.changes:
            if waiting and _batch(change) != _batch(waiting[0]):
                self._switch(waiting)
                waiting = []
            if _batch(change) is None:
                self._do_to_shaft(change.kind)
            else:
                waiting.append(change)
        if waiting:
            self._switch(waiting)

    def _do_to_shaft(self, kind: ChangeKind) -> None:
        match kind:
            case ChangeKind.STAND_STILL:
                if Role.ROTOR_ACTUATOR in self._instruments:
                    self._rest().wait()
            case ChangeKind.LOCK:
                self._rest().wait()
                self._actuator.lock()
            case ChangeKind.FREE:
                self._release()
            case ChangeKind.COUPLE:
                self._rest().wait()
                self._actuator.couple_dynamometer()
            case ChangeKind.UNCOUPLE:
                self._rest().wait()
                self._actuator.uncouple_dynamometer()

    def _check(self, setup: BenchSetup) -> None:
        """Raise ProcedureError, before anything is switched, for a setup that the fixture has no crosspoints for."""
        there, fixed = self._known()
        wanted = {contact.name: contact for contact in setup.contacts}
        names = {*wanted, *((_SHORT,) if setup.leads_shorted else ())} - fixed
        missing = sorted(names - there)
        for name in missing:
            if name.endswith("~"):
                raise ProcedureError(_no_current_probe(wanted[name]))
        if missing:
            raise ProcedureError(
                text(
                    "the fixture has no crosspoint {names}; wire it and give it a channel in crosspoints of "
                    "[instruments.switch_matrix]",
                    names=", ".join(missing),
                )
            )

    def _switch(self, changes: Sequence[Change]) -> None:
        """Have relays follow, those of what is wired for good excepted."""
        if self._feeding:
            raise ProcedureError(
                text(
                    "the fixture switches no relay while the supply, the inverter or the drive is on; switch it off first"
                )
            )
        _, fixed = self._known()
        closed = set(self._closed)
        for change in changes:
            match change.kind:
                case ChangeKind.CLEAR:
                    closed.clear()
                case ChangeKind.CLIP_TOGETHER:
                    closed.add(_SHORT)
                case ChangeKind.TAKE_APART:
                    closed.discard(_SHORT)
                case ChangeKind.TAKE_OFF:
                    closed.discard(LeadContact(change.lead, change.place).name)
                case _:
                    closed.discard(LeadContact(change.lead, change.origin).name)
                    closed.add(LeadContact(change.lead, change.place).name)
        switched = frozenset(closed) - fixed
        if switched == self._closed and not any(change.kind is ChangeKind.CLEAR for change in changes):
            return
        self._matrix.connect(sorted(switched))
        self._closed = switched

    def _known(self) -> tuple[frozenset[str], frozenset[str]]:
        """Return the crosspoints there are, and what is connected for good."""
        if self._points is None:
            self._points = self._matrix.crosspoints, self._matrix.fixed
        return self._points

    def _rest(self) -> RestFinder:
        return RestFinder(self._actuator, self._clock)

    def _read(self, action: EnterReading) -> float:
        if action.key == "winding_temperature":
            temperature = self._thermometer()
            if temperature is not None:
                return temperature
            raise ProcedureError(
                text(
                    "the fixture has no thermometer on the winding; put the temperature at which it tests into "
                    "winding_temperature of [fixture] in the station file, or set the procedure's winding_temperature"
                )
            )
        raise ProcedureError(
            text(
                "the fixture has no value for {key}; put it into the motor file's [nameplate] or the procedure's "
                "settings",
                key=action.key,
            )
        )

    @property
    def _matrix(self) -> SwitchMatrix:
        return cast("SwitchMatrix", self._get(Role.SWITCH_MATRIX))

    @property
    def _actuator(self) -> RotorActuator:
        return cast("RotorActuator", self._get(Role.ROTOR_ACTUATOR))

    def _get(self, role: Role) -> Instrument:
        try:
            return self._instruments[role]
        except KeyError:
            raise ProcedureError(
                text(
                    "the fixture needs a {role} for this, and the station has none; add [instruments.{role}] to the station file",
                    role=role.value,
                )
            ) from None


def _batch(change: Change) -> str | None:
    """Return which relays are switched together with that of a change: what comes off, what goes on; None for the shaft."""
    match change.kind:
        case ChangeKind.CLEAR | ChangeKind.TAKE_OFF | ChangeKind.TAKE_APART:
            return "off"
        case ChangeKind.CLIP_TOGETHER:
            return "leads"
        case ChangeKind.MOVE | ChangeKind.PUT_ON:
            return "wires" if LeadContact(change.lead, change.place).is_socket else "beside"
    return None


def _no_current_probe(contact: LeadContact) -> Text:
    return text(
        "the fixture has no current probe of channel {channel} round the wire of {terminal}. Current probes are "
        'installed permanently; put "{name}" into fixed of [instruments.switch_matrix]',
        channel=contact.lead.removeprefix("channel").rstrip("~"),
        terminal=contact.place,
        name=contact.name,
    )
