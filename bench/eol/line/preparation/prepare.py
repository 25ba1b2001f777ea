"""Before a batch begins: its plan, motor and line read and checked against one another, and the procedures' order."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

from bench.eol.limits import ParameterLimits
from bench.eol.line.preparation.declared_order import order_notes, safety_tests
from bench.eol.line.preparation.limit_notes import check_limits, limit_notes
from bench.eol.line.preparation.line_file import ProductionLine, load_line
from bench.eol.line.preparation.stored_names import check_names
from bench.eol.line.preparation.wanted_figures import with_wanted_before
from bench.eol.plan import Plan, PlannedCheck, load_plan
from bench.eol.plans_beside import check_name
from bench.files.toml_file import nearest, validate
from bench.i18n.errors import FileError, UsageError, at
from bench.motor.motor_file import MotorFile, load_motor
from bench.operators.fixture import ROLES as FIXTURE_ROLES
from bench.plugins.catalogues import Catalogues
from bench.run.needs import check_needs
from bench.run.plan import Catalogue, Planned
from bench.station.calibration_list import calibration_list
from bench.station.clock import wall_date
from bench.station.station_file import Station
from bench.virtual.virtual_station import virtual_roles
from drivers.interfaces.text import Text, text, text_of
from procedures.core.bench import Role
from procedures.core.parameter_definition import ParameterDefinition
from procedures.known_parameters import givers
from reports.labels import ParameterLabels


@dataclass(frozen=True)
class BatchRequest:
    """The command line's request. `motors` is the batch's size on virtual benches without serial numbers, whose generated ones
    begin with number `first_serial`.

    With `procedure_times`, each run's folder on a virtual bench gets its procedures' times and what of them was needless.
    """

    plan: Path
    station: str
    runs: Path
    sockets: int | None = None
    batch: str = ""
    serials: str = ""
    motors: int | None = None
    first_serial: int = 1
    records: str = "records.sqlite"
    person: str = ""
    operator: str = ""
    language: str = "en"
    seed: int = 0
    again: bool = False
    warm: bool = False
    procedure_times: bool = False


@dataclass(frozen=True)
class Prepared:
    """A plan with its motor and line, read and checked against one another; `roles` are those that its procedures use.

    `notes` say what of it is allowed and likely a mistake; `parameters` are those that its procedures give; `safety_tests` are
    those of its procedures that come first by rule.
    """

    plan: Plan
    motor: MotorFile
    line: ProductionLine
    limits: dict[str, ParameterLimits]
    roles: frozenset[Role] = frozenset()
    notes: tuple[Text, ...] = ()
    parameters: Mapping[str, ParameterDefinition] = field(default_factory=dict)
    safety_tests: tuple[str, ...] = ()

    @property
    def labels(self) -> ParameterLabels:
        """The labels of the parameters, those of plug-ins among them."""
        return ParameterLabels({name: definition.label.render() for name, definition in self.parameters.items()})


def prepare(plan_file: Path, station: str, sockets: int | None, operator: str = "") -> Prepared:
    """Read plan, motor and station and check them against one another, for hand work by `operator`.

    Raises InputError for whatever does not go together.
    """
    line = load_line(station, sockets)
    plan = load_plan(plan_file, line.catalogues)
    check_name(plan)
    catalogues = plan.catalogues(line.catalogues)
    try:
        motor = load_motor(plan.motor, catalogues.procedures)
    except FileError as error:
        raise FileError(at(f"{plan.source}: plan.motor", text_of(error))) from None
    check_names(plan, motor, line)
    planned = planned_of(plan.checks, plan.source, catalogues.procedures)
    check_parameters(plan, planned, catalogues.procedures)
    plan = with_wanted_before(plan, planned, motor.nameplate, catalogues.procedures)
    # A virtual socket has a fixture, unless virtual hands work in its place.
    check_station(line, planned, virtual_roles(fixture=operator != "virtual", six_step=motor.six_step is not None))
    if line.is_virtual:
        motor.virtual_motor()
    roles = frozenset(role for each in planned for role in each.procedure.roles)
    limits = plan.limits(motor.nameplate.expected)
    check_limits(plan, limits)
    notes = (
        *_unused_plugins(catalogues),
        *limit_notes(plan, limits, motor.nameplate.expected, catalogues.procedures),
        *order_notes(plan, planned),
    )
    parameters = {name: one for each in planned for name, one in each.procedure.parameters.items()}
    return Prepared(plan, motor, line, limits, roles, notes, parameters, safety_tests(planned))


def _unused_plugins(catalogues: Catalogues) -> list[Text]:
    """Return which plug-in files of plan and station, or which names of theirs, cannot be used, and why."""
    files = {file.origin for file in catalogues.files}
    return [broken.sentence for broken in catalogues.broken(load=False) if broken.origin in files] if files else []


def planned_of(checks: Iterable[PlannedCheck], source: str, known: Catalogue) -> list[Planned]:
    """Return checks as a run takes them, from the procedures there are. Raises InputError for settings that one does not allow."""
    checks = list(checks)
    if manual := next((check.name for check in checks if known[check.name].manual), None):
        raise FileError(
            text(
                "{source}: {name} needs a person's commands and cannot be part of a plan; use motorbench run {name}",
                source=source,
                name=manual,
            )
        )
    return [
        Planned(
            check.name,
            known[check.name],
            validate(known[check.name].settings_type(), check.settings, source, f"procedure {check.name}: settings"),
        )
        for check in checks
    ]


def operator_of(requested: str, station: Station | None) -> str:
    """Return who does the hand work at a socket: as requested, else its fixture where it has one, else the usual one."""
    if requested or station is None:
        return requested
    return "fixture" if FIXTURE_ROLES & station.entries.keys() else ""


def check_parameters(plan: Plan, planned: Sequence[Planned], known: Catalogue) -> None:
    """Raise InputError for a limit on a parameter that none of the plan's procedures gives."""
    available = sorted({name for each in planned for name in each.procedure.parameters})
    for parameter in sorted(plan.limited):
        if parameter in available:
            continue
        owners = givers(known).get(parameter)
        hint = text("add the procedure {names}", names=" or ".join(owners)) if owners else nearest(parameter, available)
        raise FileError(
            text(
                "{source}: limit on {parameter}: no procedure of the plan gives it; {hint}",
                source=plan.source,
                parameter=parameter,
                hint=hint,
            )
        )


def check_station(line: ProductionLine, planned: Sequence[Planned], available: Collection[str]) -> None:
    """Raise InputError where a socket has not the instruments that a procedure needs; virtual ones have those `available`."""
    for socket in line.sockets:
        if socket.station is not None:
            check_needs(planned, socket.station)
            continue
        for each in planned:
            missing = sorted(role.value for role in each.procedure.roles if role.value not in available)
            if missing:
                raise FileError(
                    text(
                        "{name} needs {names}, which the virtual bench does not have",
                        name=each.name,
                        names=", ".join(missing),
                    )
                )


def calibrations_of(line: ProductionLine, roles: frozenset[Role], today: date | None = None) -> list[Text]:
    """Return what of the line's calibrations is overdue or soon due today, soonest first; each instrument once.

    Raises InputError where the station refuses what is overdue, before any motor.
    """
    shared = {role.value for role in line.shared}
    today = today or wall_date()
    pressing: dict[str, Text] = {}
    for socket in line.sockets:
        if socket.station is None:
            continue
        used = [entry for role, entry in socket.station.entries.items() if role in roles]
        socket.station.check_calibrations(today, [entry.role for entry in used])
        for each in calibration_list(used, today):
            if each.pressing:
                of_one = text("socket {socket}: {words}", socket=socket.name, words=each.words)
                words = each.words if each.role in shared else of_one
                pressing[str(words)] = words
    return list(pressing.values())


def check_operator(request: BatchRequest, line: ProductionLine) -> None:
    """Raise UsageError for an operator that the line's sockets cannot have."""
    if request.operator not in ("", "fixture", "virtual", "terminal"):
        raise UsageError(
            text("--operator {operator}: allowed are fixture, virtual, terminal", operator=request.operator)
        )
    if line.is_virtual:
        if request.operator == "terminal":
            raise UsageError(
                text("--operator terminal: on the virtual bench only a fixture or virtual hands can do anything")
            )
        return
    by_hand = any(
        operator_of(request.operator, socket.station) in ("", "terminal")
        and not (socket.station and socket.station.control)
        for socket in line.sockets
    )
    if by_hand and (len(line.sockets) > 1 or request.serials in ("", "-")):
        raise UsageError(
            text(
                "a person at the terminal serves one socket, and the keyboard answers the questions: give --serials FILE, "
                "or each socket a fixture ([sockets.NAME.instruments.switch_matrix], rotor_actuator)"
            )
        )
