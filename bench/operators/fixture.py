"""A fixture in place of hands: a switch matrix connects, a rotor actuator holds, turns and frees the shaft."""

from collections.abc import Callable, Mapping
from typing import assert_never, cast

from bench.journal.events.instruments import DeEnergised, Energising
from bench.journal.events.safety import MadeSafe
from bench.operators.rest import RestFinder
from drivers.interfaces import Clock, Instrument, Role, RotorActuator, SwitchMatrix
from drivers.interfaces.role import ROLES as SPECS
from drivers.interfaces.text import text
from procedures.core.actions import (
    Action,
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    ConnectVoltmeterToSupply,
    CoupleDynamometer,
    CurrentProbe,
    DisconnectVoltmeter,
    DoubtReading,
    EnterCommand,
    EnterReading,
    LockRotor,
    MarkRestPositions,
    Mend,
    ReleaseRotor,
    SeparateMeterLeads,
    ShortMeterLeads,
    Socket,
    StartTurning,
    StopTurning,
    TurnToRest,
    UncoupleDynamometer,
)
from procedures.core.bench import ProcedureError
from procedures.core.events import Event

#: The roles that a fixture consists of.
ROLES = frozenset(role for role, spec in SPECS.items() if spec.in_fixture)
#: What feeds the terminals; while one of them does, no relay is switched.
_SOURCES = frozenset(role.value for role, spec in SPECS.items() if spec.feeds_winding)
#: How far (rad) a shaft is moved to feel whether it is free: further than the actuator may stop short.
_FEELING = 0.1
#: The parts of what is connected, each changed by actions of its own.
_SOCKETS, _PROBES, _SENSES, _SHORT = "sockets", "probes", "senses", "short"
_NOTHING: Mapping[str, frozenset[str]] = dict.fromkeys((_SOCKETS, _PROBES, _SENSES, _SHORT), frozenset())


class FixtureOperator:
    """Performs actions by the instruments of a fixture; `take` hands them over, `hear` tells what the journal is told.

    `thermometer` gives the winding's temperature (°C), None where the fixture has none. `hand_time` counts the bench time (s)
    that the fixture's work took.
    """

    def __init__(self, clock: Clock, thermometer: Callable[[], float | None] = lambda: None) -> None:
        self._clock = clock
        self._thermometer = thermometer
        self._instruments: Mapping[Role, Instrument] = {}
        self._parts = dict(_NOTHING)
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
                self._parts = dict(_NOTHING)

    def perform(self, action: Action) -> object:
        """Do it; ProcedureError where the fixture cannot, and what its instruments raise."""
        start = self._clock.now()
        try:
            return self._do(action)
        finally:
            self.hand_time += self._clock.now() - start

    def _do(self, action: Action) -> object:
        match action:
            case Connect():
                self._connect(action)
            case ConnectProbes():
                self._join({_PROBES: self._probes(action)})
            case ConnectVoltmeter():
                ends = (f"{action.positive.value}:voltmeter+", f"{action.negative.value}:voltmeter-")
                self._join({_SENSES: frozenset(ends)})
            case ConnectVoltmeterToSupply():
                self._join({_SENSES: frozenset({"S+:voltmeter+", "S-:voltmeter-"})})
            case DisconnectVoltmeter():
                self._join({_SENSES: frozenset()})
            case ShortMeterLeads():
                self._join({_SOCKETS: frozenset(), _SHORT: frozenset({"leads:short"})})
            case SeparateMeterLeads():
                self._join({_SHORT: frozenset()})
            case LockRotor():
                self._rest().wait()
                self._actuator.lock()
            case ReleaseRotor():
                self._release()
            case TurnToRest():
                self._rest().nudge()
            case MarkRestPositions():
                return self._rest().mark(action.turns)
            case StartTurning():
                self._actuator.turn(action.speed)
            case StopTurning():
                self._actuator.stop()
            case CoupleDynamometer():
                self._rest().wait()
                self._actuator.couple_dynamometer()
            case UncoupleDynamometer():
                self._rest().wait()
                self._actuator.uncouple_dynamometer()
            case EnterReading():
                return self._read(action)
            case EnterCommand():
                raise ProcedureError(
                    text("a fixture commands nothing: take --operator terminal or panel for the instruments by hand")
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

    def _connect(self, action: Connect) -> None:
        sockets = {terminal: socket for terminal, socket in action.complete().items() if socket is not Socket.OPEN}
        names = frozenset(f"{terminal.value}:{socket.value}" for terminal, socket in sockets.items())
        changed = {_SOCKETS: names}
        if Socket.INSULATION_HIGH in sockets.values():
            # Nothing else may be on that voltage; whoever needs the probes afterwards asks for them.
            changed |= {_PROBES: frozenset(), _SENSES: frozenset(), _SHORT: frozenset()}
        self._join(changed)

    def _probes(self, action: ConnectProbes) -> frozenset[str]:
        _, fixed = self._known()
        wanted = set[str]()
        for probe in action.probes:
            if isinstance(probe, CurrentProbe):
                name = f"{probe.terminal.value}:channel{probe.channel}~"
                if name not in fixed:
                    raise ProcedureError(
                        text(
                            "the fixture has no current probe of channel {channel} round the wire of {terminal}: a current probe "
                            'is fitted for good; put "{name}" into fixed of [instruments.switch_matrix]',
                            channel=probe.channel,
                            terminal=probe.terminal.value,
                            name=name,
                        )
                    )
            else:
                wanted |= {
                    f"{probe.positive.value}:channel{probe.channel}+",
                    f"{probe.negative.value}:channel{probe.channel}-",
                }
        return frozenset(wanted)

    def _join(self, changed: Mapping[str, frozenset[str]]) -> None:
        """Have the crosspoints of all parts closed, those of some of them changed."""
        if self._feeding:
            raise ProcedureError(
                text(
                    "the fixture switches no relay while the supply, the inverter or the drive is on; switch it off first"
                )
            )
        there, fixed = self._known()
        parts = {**self._parts, **changed}
        wanted = frozenset[str]().union(*parts.values()) - fixed
        missing = sorted(wanted - there)
        if missing:
            raise ProcedureError(
                text(
                    "the fixture has no crosspoint {names}; wire it and give it a channel in crosspoints of "
                    "[instruments.switch_matrix]",
                    names=", ".join(missing),
                )
            )
        self._matrix.connect(sorted(wanted))
        self._parts = parts

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
                "the fixture has nothing to read {key} from; put it into the motor file's [nameplate] or the procedure's settings",
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
