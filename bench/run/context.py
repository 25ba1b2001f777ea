"""Where a run takes place: a real bench with a person, a replay of typed readings, or the virtual bench."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.i18n.errors import UsageError
from bench.i18n.language import catalogue, translator
from bench.motor.motor_file import MotorFile
from bench.safety.interrupts import Interrupts
from bench.safety.ownership.owner import Ownership, Unowned
from bench.safety.ownership.stations import owning_stations
from bench.safety.station_instruments import Prompts, system_visa
from bench.station.clock import ReplayClock, SystemClock
from bench.station.sharing import Alone, Sharing
from bench.station.station_file import VIRTUAL, Station, load_station
from bench.virtual.fault_hooks import FaultHeard, StepStarted
from bench.virtual.true_values import truth_of
from drivers import catalogue as registry
from drivers.interfaces import Clock, Instrument
from drivers.interfaces.text import text
from drivers.transport.in_process import InProcess
from procedures.core.bench import Operator, Role

if TYPE_CHECKING:
    from pyvisa import ResourceManager
    from rich.console import Console

    from bench.virtual.fault_file import GivenFault

OPERATORS = ("terminal", "virtual", "answers", "panel", "fixture")


def _nothing_taken(_: Mapping[Role, Instrument]) -> None:
    """Need no instruments."""


@dataclass(frozen=True)
class Place:
    """What a run takes place with; `truth` is empty for a real motor, `hand_time` gives the bench time of hand work (s).

    `announce` says in the run's folder how its operator is reached, where that is needed. `in_process` opens the
    instruments of a bench in this process. A virtual bench is told by `step_started` which step begins, and asked by `really`
    what is really so; `listen_to_faults` has one told of the faults that begin and mend there. `sharing` is the way to what other
    sockets use too.
    An operator that works with instruments of the station uses those in `operators_roles`, is given them by `equip`, and
    hears the journal by `operator_hears`. `owner` has the station's instruments for the length of the run.
    """

    station: Station
    clock: Clock
    operator: Operator
    prompts: Prompts
    visa: "Callable[[], ResourceManager]"
    truth: dict[str, float]
    hand_time: Callable[[], float]
    announce: Callable[[Path], None] = lambda _: None
    in_process: InProcess | None = None
    step_started: StepStarted = lambda _step, _procedure: None
    listen_to_faults: Callable[[FaultHeard], None] = lambda _: None
    really: Callable[[], dict[str, Any]] = dict
    operators_roles: frozenset[Role] = frozenset()
    equip: Callable[[Mapping[Role, Instrument]], None] = _nothing_taken
    operator_hears: Callable[[str, Mapping[str, Any]], None] = lambda _kind, _data: None
    sharing: Sharing = field(default_factory=Alone)
    owner: Ownership = field(default_factory=Unowned)


@contextmanager
def place(
    station: str,
    motor: MotorFile,
    operator: str,
    *,
    answers: Path | None,
    seed: int,
    console: "Console",
    language: str,
    interrupts: Interrupts,
    faults: "Sequence[GivenFault]" = (),
    what: str = "",
) -> Iterator[Place]:
    """Give the surroundings for a run; `station` is a file or `virtual`, `operator` one of OPERATORS or empty for the usual one.

    `interrupts` is how a panel ends the run, `faults` are injected on a virtual bench, `what` is what others are told
    who want the same instruments.
    Raises UsageError where they do not go together, InputError for a bad file, HeldError where somebody else has one of
    the station's instruments: before anything is opened.
    """
    if operator and operator not in OPERATORS:
        raise UsageError(text("--operator {operator}: allowed are {names}", operator=operator, names=OPERATORS))
    if (answers is not None) != (operator == "answers"):
        raise UsageError(text("--operator answers and --answers FILE go together"))
    if station == VIRTUAL:
        if operator not in ("", "virtual", "panel", "fixture"):
            raise UsageError(
                text(
                    "--operator {operator}: the virtual bench has the virtual operator's hands or a fixture",
                    operator=operator,
                )
            )
        by_fixture = operator == "fixture"
        with _virtual(motor, seed, faults, fixture=by_fixture) as made, _watched(made, operator, interrupts) as watched:
            yield watched
        return
    read = load_station(Path(station))
    with (
        owning_stations([read], what) as owner,
        place_at(
            read,
            motor,
            operator,
            answers=answers,
            seed=seed,
            console=console,
            language=language,
            interrupts=interrupts,
            faults=faults,
        ) as made,
    ):
        yield replace(made, owner=owner or made.owner)


@contextmanager
def place_at(
    read: Station,
    motor: MotorFile,
    operator: str,
    *,
    answers: Path | None,
    seed: int,
    console: "Console",
    language: str,
    interrupts: Interrupts,
    faults: "Sequence[GivenFault]" = (),
) -> Iterator[Place]:
    """Give the surroundings for a run at a station that was read; otherwise as `place`."""
    if operator == "virtual" or (read.control and operator in ("", "fixture")):
        if not read.control:
            raise UsageError(
                text(
                    "--operator virtual works on a virtual bench only: --station virtual, "
                    "or a station file with [station] control, as motorbench sim serve writes it"
                )
            )
        with _served(read, seed, interrupts, faults, fixture=operator == "fixture") as made:
            yield made
        return
    if not (read.control and operator == "panel"):
        _refuse_faults(read, faults)
    if operator == "panel":
        with _at_panel(read, seed, interrupts, faults) as made:
            yield made
        return
    if answers is not None:
        yield _replayed(read, answers)
        return
    by_hand = _by_hand(read, motor, console, language, interrupts)
    yield with_fixture(by_hand, lambda: read.fixture.winding_temperature) if operator == "fixture" else by_hand


def _refuse_faults(station: Station, faults: "Sequence[GivenFault]") -> None:
    if faults:
        raise UsageError(
            text(
                "--faults, --fault: {source} is no virtual bench, and faults are injected on one only: --station virtual, "
                "or a station file with [station] control, as motorbench sim serve writes it",
                source=station.source,
            )
        )


def with_fixture(made: Place, thermometer: Callable[[], float | None]) -> Place:
    """Return the same place with the station's own fixture in place of hands. Raises UsageError where it has none."""
    from bench.operators.fixture import ROLES, FixtureOperator

    there = ROLES & made.station.entries.keys()
    if not there:
        raise UsageError(
            text(
                "--operator fixture: {source} has neither [instruments.switch_matrix] nor "
                "[instruments.rotor_actuator], which do the work of hands",
                source=made.station.source,
            )
        )
    fixture = FixtureOperator(made.clock, thermometer)
    return replace(
        made,
        operator=fixture,
        hand_time=lambda: fixture.hand_time,
        operators_roles=there,
        equip=fixture.take,
        operator_hears=fixture.hear,
    )


@contextmanager
def _at_panel(station: Station, seed: int, interrupts: Interrupts, faults: "Sequence[GivenFault]") -> Iterator[Place]:
    """Give a bench with a person at a panel; a served virtual bench's hands do what the person confirms."""
    from bench.operators.panel_operator import DistantOperator, DistantPrompt

    if station.control:
        with _served(station, seed, interrupts, faults) as made, _watched(made, "panel", interrupts) as watched:
            yield watched
        return
    with closing(DistantOperator(interrupts)) as person:
        yield Place(
            station,
            SystemClock(),
            person,
            lambda role: DistantPrompt(person, role.value),
            system_visa(station.visa_library),
            {},
            lambda: 0.0,
            person.line.announce,
        )


@contextmanager
def _watched(made: Place, operator: str, interrupts: Interrupts) -> Iterator[Place]:
    """Put a person at a panel in front of virtual hands, where one is wanted."""
    if operator != "panel":
        yield made
        return
    from bench.operators.panel_operator import DistantOperator

    with closing(DistantOperator(interrupts, made.operator)) as person:
        yield replace(made, operator=person, announce=person.line.announce)


def _by_hand(station: Station, motor: MotorFile, console: "Console", language: str, interrupts: Interrupts) -> Place:
    from bench.operators.terminal import TerminalOperator, TerminalPrompt

    templates = catalogue(language)
    person = TerminalOperator(console, translator(language), motor.nameplate.wire_colours, interrupts=interrupts)
    return Place(
        station,
        SystemClock(),
        person,
        lambda role: TerminalPrompt(person, role.value, templates),
        system_visa(station.visa_library),
        {},
        lambda: 0.0,
    )


def _replayed(station: Station, answers: Path) -> Place:
    from bench.operators.answers import AnswersOperator, AnswersPrompt, load_answers

    given = load_answers(answers)
    only_typed = all(entry.driver.name == registry.MANUAL for entry in station.entries.values())
    return Place(
        station,
        ReplayClock() if only_typed else SystemClock(),
        AnswersOperator(given),
        lambda role: AnswersPrompt(given, role.value),
        system_visa(station.visa_library),
        {},
        lambda: 0.0,
    )


@contextmanager
def _served(
    station: Station, seed: int, interrupts: Interrupts, faults: "Sequence[GivenFault]", *, fixture: bool = False
) -> Iterator[Place]:
    from bench.operators.virtual import VirtualOperator
    from bench.virtual.fault_file import inject
    from bench.virtual.served_world import ServedWorld

    with ServedWorld(station.control, interrupts) as world:
        hands = VirtualOperator(world, seed)
        inject(faults, lambda described: world.inject(described.told()))
        made = Place(
            station,
            world.clock,
            hands,
            lambda _: None,
            system_visa(station.visa_library),
            world.motor_truth(),
            lambda: hands.hand_time,
            step_started=world.step_started,
            really=world.truth,
        )
        yield with_fixture(made, hands.thermometer) if fixture else made


@contextmanager
def _virtual(motor: MotorFile, seed: int, faults: "Sequence[GivenFault]", *, fixture: bool) -> Iterator[Place]:
    from pyvisa import ResourceManager

    from bench.operators.virtual import VirtualOperator
    from bench.virtual.fault_file import inject
    from bench.virtual.virtual_station import virtual_station
    from sim_instruments.bench import VirtualBench

    truth = motor.virtual_motor()
    with VirtualBench(truth, seed=seed, six_step=motor.six_step, sockets=False, fixture=fixture) as bench:
        hands = VirtualOperator(bench.world, seed)
        inject(faults, bench.injector.add)
        made = Place(
            virtual_station(bench.addresses()),
            bench.clock,
            hands,
            lambda _: None,
            lambda: ResourceManager(bench.visa_library),
            truth_of(truth, motor.six_step),
            lambda: hands.hand_time,
            in_process=bench,
            step_started=bench.injector.step_started,
            listen_to_faults=bench.injector.listen,
            really=bench.world.truth,
        )
        yield with_fixture(made, hands.thermometer) if fixture else made
