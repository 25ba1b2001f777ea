"""The surroundings of a run: a real bench with a person, a replay of typed readings, or the virtual bench."""

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from bench.i18n.errors import UsageError
from bench.i18n.language import translator
from bench.plugins.catalogues import installed
from bench.run.request import RunRequest
from bench.run.run_operator import (
    FixtureHands,
    PanelHands,
    RunOperator,
    TerminalHands,
    TypedAnswers,
    VirtualHands,
)
from bench.run.simulation import InProcessSimulation, ServedSimulation, Simulation
from bench.safety.interrupts import Interrupts
from bench.safety.ownership.owner import Ownership, Unowned
from bench.safety.ownership.stations import owning_stations
from bench.station.clock import ReplayClock, SystemClock
from bench.station.sharing import NotShared, Sharing
from bench.station.station_file import VIRTUAL, Station, load_station
from bench.station.visa_library import StationVisa
from bench.virtual.fault_hooks import inject
from drivers.catalogue import MANUAL
from drivers.interfaces import Clock, InverterAbility
from drivers.interfaces.text import text

if TYPE_CHECKING:
    from rich.console import Console

    from bench.operators.virtual import VirtualOperator

OPERATORS = ("terminal", "virtual", "answers", "panel", "fixture")


@dataclass(frozen=True)
class RunContext:
    """Context of a run: station, operator, clock and what belongs to them.

    `visa` is the library of its VISA instruments. `sharing` is the way to what other
    sockets use too, `owner` has the station's instruments for the length of the run.
    """

    station: Station
    clock: Clock
    operator: RunOperator
    visa: StationVisa
    simulation: Simulation = field(default_factory=Simulation)
    sharing: Sharing = field(default_factory=NotShared)
    owner: Ownership = field(default_factory=Unowned)


@contextmanager
def run_context(
    request: RunRequest, console: "Console", interrupts: Interrupts, owner_purpose: str = ""
) -> Iterator[RunContext]:
    """Give the context of a run; `interrupts` is how a panel ends it, `owner_purpose` is what others are told who want the same
    instruments.

    Raises UsageError where station and operator do not go together, InputError for a bad file, HeldError where somebody else
    has one of the station's instruments: before anything is opened.
    """
    operator = request.operator
    if operator and operator not in OPERATORS:
        raise UsageError(text("--operator {operator}: allowed are {names}", operator=operator, names=OPERATORS))
    if (request.answers is not None) != (operator == "answers"):
        raise UsageError(text("--operator answers and --answers FILE go together"))
    if request.station == VIRTUAL:
        with _virtual(request, console, interrupts) as context:
            yield context
        return
    if request.disturbances is not None:
        raise UsageError(
            text(
                "--disturbances: {source} is not --station virtual, and only a bench of this command's own is disturbed; "
                "where motorbench sim serve serves one, give --disturbances there",
                source=request.station,
            )
        )
    station = load_station(Path(request.station))
    with (
        owning_stations([station], owner_purpose) as owner,
        station_context(station, request, console, interrupts) as context,
    ):
        yield replace(context, owner=owner or context.owner)


@contextmanager
def station_context(
    station: Station, request: RunRequest, console: "Console", interrupts: Interrupts
) -> Iterator[RunContext]:
    """Give the context of a run at a station that was read; otherwise as `run_context`."""
    operator = request.operator
    if station.control:
        with _served(station, request, console, interrupts) as context:
            yield context
        return
    if operator == "virtual":
        raise UsageError(
            text(
                "--operator virtual works on a virtual bench only: --station virtual, "
                "or a station file with [station] control, as motorbench sim serve writes it"
            )
        )
    if request.faults:
        raise UsageError(
            text(
                "--faults, --fault: {source} is no virtual bench, and faults are injected on one only: --station virtual, "
                "or a station file with [station] control, as motorbench sim serve writes it",
                source=station.source,
            )
        )
    if operator == "panel":
        with _at_panel(station, interrupts) as context:
            yield context
        return
    if request.answers is not None:
        yield _replayed(station, request.answers)
        return
    by_hand = _by_hand(station, request, console, interrupts)
    yield with_fixture(by_hand, lambda: station.fixture.winding_temperature) if operator == "fixture" else by_hand


def with_fixture(context: RunContext, thermometer: Callable[[], float | None]) -> RunContext:
    """Return the same context with the station's own fixture in place of hands. Raises UsageError where it has none."""
    from bench.operators.fixture import ROLES, FixtureOperator

    roles = ROLES & context.station.entries.keys()
    if not roles:
        raise UsageError(
            text(
                "--operator fixture: {source} has neither [instruments.switch_matrix] nor "
                "[instruments.rotor_actuator], which do the work of hands",
                source=context.station.source,
            )
        )
    fixture = FixtureOperator(context.clock, thermometer)
    return replace(
        context,
        operator=FixtureHands(
            hands=fixture, prompts=context.operator.prompts, roles=roles, fixture=fixture, beside=context.operator
        ),
    )


@contextmanager
def _at_panel(station: Station, interrupts: Interrupts) -> Iterator[RunContext]:
    from bench.operators.panel_operator import DistantOperator
    from bench.operators.person_prompt import PersonPrompt

    with closing(DistantOperator(interrupts)) as person:
        operator = PanelHands(hands=person, prompts=lambda role: PersonPrompt(person, role.value), person=person)
        yield RunContext(station, SystemClock(), operator, StationVisa(station.visa_library))


@contextmanager
def _in_front(
    context: RunContext, worker: "VirtualOperator", request: RunRequest, console: "Console", interrupts: Interrupts
) -> Iterator[RunContext]:
    """Put a person, or a file of answers, in front of virtual hands where one is wanted."""
    behind = context.operator
    if request.operator == "terminal":
        from bench.operators.terminal import TerminalOperator

        colours = request.motor.nameplate.wire_colours
        typing = TerminalOperator(
            console, translator(request.language), colours, interrupts=interrupts, hands=behind.hands
        )
        yield replace(
            context, operator=TerminalHands(hands=typing, prompts=behind.prompts, person=typing, behind=behind)
        )
    elif request.answers is not None:
        from bench.operators.answers import AnswersOperator, load_answers

        given = load_answers(request.answers)
        replaying = AnswersOperator(given, behind.hands)
        yield replace(context, operator=TypedAnswers(hands=replaying, prompts=behind.prompts, answers=given))
    elif request.operator == "panel":
        from bench.operators.panel_operator import DistantOperator

        with closing(DistantOperator(interrupts, worker)) as person:
            at_panel = PanelHands(hands=person, prompts=behind.prompts, person=person, behind=behind)
            yield replace(context, operator=at_panel)
    else:
        yield context


def _by_hand(station: Station, request: RunRequest, console: "Console", interrupts: Interrupts) -> RunContext:
    from bench.operators.person_prompt import PersonPrompt
    from bench.operators.terminal import TerminalOperator

    person = TerminalOperator(
        console, translator(request.language), request.motor.nameplate.wire_colours, interrupts=interrupts
    )
    operator = TerminalHands(hands=person, prompts=lambda role: PersonPrompt(person, role.value), person=person)
    return RunContext(station, SystemClock(), operator, StationVisa(station.visa_library))


def _replayed(station: Station, answers: Path) -> RunContext:
    from bench.operators.answers import AnswersOperator, AnswersPrompt, load_answers

    given = load_answers(answers)
    only_typed = all(entry.driver.name == MANUAL for entry in station.entries.values())
    operator = TypedAnswers(
        hands=AnswersOperator(given), prompts=lambda role: AnswersPrompt(given, role.value), answers=given
    )
    clock = ReplayClock() if only_typed else SystemClock()
    return RunContext(station, clock, operator, StationVisa(station.visa_library))


@contextmanager
def _served(station: Station, request: RunRequest, console: "Console", interrupts: Interrupts) -> Iterator[RunContext]:
    from bench.operators.virtual import VirtualOperator
    from bench.virtual.served_world import ServedWorld

    with ServedWorld(station.control, interrupts) as world:
        worker = VirtualOperator(world, request.seed)
        inject(request.faults, lambda described: world.inject(described.told()))
        context = RunContext(
            station,
            world.clock,
            VirtualHands.of(worker),
            StationVisa(station.visa_library),
            ServedSimulation(world),
        )
        if request.operator == "fixture":
            context = with_fixture(context, worker.thermometer)
        with _in_front(context, worker, request, console, interrupts) as operated:
            yield operated


@contextmanager
def _virtual(request: RunRequest, console: "Console", interrupts: Interrupts) -> Iterator[RunContext]:
    from bench.operators.virtual import VirtualOperator
    from bench.virtual.virtual_station import (
        bench_size_for,
        dc_voltage_for,
        dq_inverter_for,
        virtual_station,
    )
    from sim_instruments.bench import BenchSetting, VirtualBench
    from sim_instruments.catalogue import standard_units

    motor, by_fixture = request.motor, request.operator == "fixture"
    truth, setting = motor.virtual_motor(), None
    if request.disturbances is not None:
        from bench.virtual.disturbance_file import load_disturbances

        setting = BenchSetting(disturbances=load_disturbances(request.disturbances))
    dq_inverter = dq_inverter_for(motor.nameplate) if commands_dq(request) else None
    size = bench_size_for(truth, motor.nameplate)
    units = standard_units(
        six_step=motor.six_step is not None,
        fixture=by_fixture,
        dq_inverter=dq_inverter,
        dc_voltage=dc_voltage_for(motor.nameplate),
        torque=size.torque,
        inverter_current=size.inverter_current,
    )
    with VirtualBench(
        truth, units, seed=request.seed, six_step=motor.six_step, sockets=False, fixture=by_fixture, setting=setting
    ) as bench:
        worker = VirtualOperator(bench.world, request.seed)
        inject(request.faults, bench.injector.add)
        context = RunContext(
            virtual_station(bench.addresses(), dq_inverter, size=size),
            bench.clock,
            VirtualHands.of(worker),
            StationVisa(bench.visa_library),
            InProcessSimulation(bench, truth, motor.six_step),
        )
        if by_fixture:
            context = with_fixture(context, worker.thermometer)
        with _in_front(context, worker, request, console, interrupts) as operated:
            yield operated


def commands_dq(request: RunRequest) -> bool:
    """Tell whether a procedure of a run needs an inverter that d- and q-axis currents can be commanded of."""
    known = installed().procedures
    named = [known[name] for name in request.procedures if name in known]
    return any(
        InverterAbility.DQ_CURRENT in demand.abilities for procedure in named for demand in procedure.needs.values()
    )
