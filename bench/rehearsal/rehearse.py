"""Tries a plan on the twin and gives the script; nothing of the station is opened."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.i18n.errors import UsageError
from bench.i18n.language import translator
from bench.journal.disk import write_file
from bench.journal.encoding import plain, to_bytes
from bench.journal.events.run import SCHEMA, RehearsalStarted
from bench.journal.journal import Journal
from bench.journal.run_folder import REHEARSAL, new_run_folder
from bench.journal.run_view import RunView
from bench.journal.unrecorded import Unrecorded
from bench.operators.fixture import ROLES as FIXTURE
from bench.rehearsal.assumed import assumed_motor
from bench.rehearsal.script import Script, highest_as_dict
from bench.rehearsal.twin import Twin, twin_of
from bench.run.context import commands_dq
from bench.run.needs import check_needs, possible
from bench.run.plan import Catalogue, make_plan, titles_of
from bench.run.progress import Progress
from bench.run.request import RunRequest
from bench.run.retry_policy import never_stop
from bench.run.sequencer import Runner
from bench.run.software import software
from bench.safety.limits.bounds import NO_LIMIT, Limit, known_pole_pairs
from bench.safety.station_instruments import StationInstruments
from bench.safety.watchdogs import RoleWatchdog, planned_watchdogs
from bench.station.station_file import VIRTUAL, Entry, Station, load_station
from bench.virtual.virtual_station import bench_size_for, dq_inverter_for, virtual_station
from drivers.interfaces.declarations import Amount, declarations
from drivers.interfaces.text import Translate, english, text
from procedures.core.bench import Role

if TYPE_CHECKING:
    from rich.console import Console

#: Folder under that of the runs; its own are no runs and hold no `journal.jsonl`, so that none can be resumed.
FOLDER = "rehearsals"
SCRIPT = "rehearsal.json"


@dataclass(frozen=True)
class Rehearsed:
    """A rehearsal that has ended: its folder, its script, what was assumed, how it ended, and the watchdogs of the station's roles."""

    path: Path
    twin: Twin
    script: Script
    view: RunView
    hand_time: float
    station: Station
    request: RunRequest
    watchdogs: tuple[RoleWatchdog, ...] = ()

    @property
    def good(self) -> bool:
        """True if every procedure was completed and no limit would be exceeded."""
        return self.view.status == "completed" and not self.script.violations

    def as_dict(self, translate: Translate = english) -> dict[str, Any]:
        """Return it as `rehearsal.json` holds it."""
        return {
            "rehearsal": str(self.path),
            "good": self.good,
            "status": self.view.status,
            "cause": self.view.cause or None,
            "motor": {"name": self.request.motor.nameplate.name, "source": self.request.motor.source},
            "station": {"name": self.station.name, "source": self.station.source},
            "assumed": [
                {"name": one.name, "value": one.value, "unit": one.unit, "why": one.why.render(translate)}
                for one in self.twin.assumed
            ],
            "differences": [difference.render(translate) for difference in self.twin.differences],
            "procedures": [
                {
                    "name": procedure.name,
                    "section": procedure.section,
                    "status": "failed" if procedure.cause else "completed",
                    "cause": procedure.cause or None,
                    "bench_time": procedure.duration,
                    "hand_time": procedure.hand_time,
                    "steps": [
                        {
                            "id": step.identifier,
                            "text": step.sentence,
                            "time": step.began - procedure.began,
                            "lines": [line.as_dict() for line in step.lines],
                        }
                        for step in procedure.steps
                    ],
                }
                for procedure in self.script.procedures
            ],
            "highest": highest_as_dict(self.script.highest),
            "reached": [
                {"instrument": name, "value": value, "unit": unit}
                for (name, unit), value in sorted(self.script.reached.items())
            ],
            "watchdogs": [one.as_dict() for one in self.watchdogs],
            "violations": [{"procedure": name, "message": message} for name, message in self.script.violations],
            "bench_time": self.view.bench_time,
            "hand_time": self.hand_time,
        }


def rehearse(request: RunRequest, catalogue: Catalogue, console: "Console") -> Rehearsed:
    """Run the plan on the twin of the station, every procedure even if earlier ones fail.

    Raises InputError for a plan, station or motor that a run would refuse.
    """
    given = request.resume or request.faults or request.disturbances or request.answers
    if given or request.operator not in ("", "virtual"):
        raise UsageError(
            text(
                "--rehearse tries a whole plan with virtual hands: leave out --resume, --faults, --fault, --disturbances, --answers "
                "and --operator"
            )
        )
    plan = make_plan(request.procedures, request.assignments, catalogue)
    if manual := next((each.name for each in plan if each.procedure.manual), None):
        raise UsageError(
            text(
                "{name} cannot be rehearsed, because a person gives each command; its limits still apply",
                name=manual,
            )
        )
    translate = translator(request.language)
    station = _station(request)
    if list(request.procedures) == ["all"]:
        plan = possible(plan, station, console, translate)
    check_needs(plan, station)
    with twin_of(station, request.motor, request.seed) as twin:
        context, view = twin.context, RunView()
        folder = new_run_folder(request.runs / FOLDER, f"rehearsal-{request.motor.nameplate.name}")
        journal = Journal(folder.path / REHEARSAL, context.clock.now, durable=False)
        instruments: StationInstruments

        def own(name: str, parameter: str) -> Limit:
            return _own_limit(station, instruments, name, parameter)

        names = {role.value: entry.name for role, entry in context.station.entries.items()}
        offered = partial(_offered, station)
        script = Script(context.clock.now, lambda: context.operator.hand_time, own, offered, names, translate)
        journal.listen(view.apply)
        journal.listen(script.hear)
        journal.listen(Progress(console, titles_of(plan, translate), live=True).hear)
        instruments = StationInstruments(
            context.station,
            request.motor.nameplate,
            context.clock,
            journal,
            Unrecorded(),
            context.visa,
            context.operator.prompts,
            in_process=context.simulation.in_process,
            trace=request.trace,
            pole_pairs=lambda: known_pole_pairs(request.motor.nameplate, view.parameters().parameters),
            observe=script.set_point,
        )
        runner = Runner(
            instruments=instruments,
            operator=context.operator.hands,
            clock=context.clock,
            journal=journal,
            view=view,
            nameplate=request.motor.nameplate,
            translate=translate,
            way_down=context.station.way_down,
        )
        begin = RehearsalStarted(
            schema=SCHEMA,
            rehearsal=str(folder.path),
            motor=request.motor.source,
            station=station.source,
            procedures=[planned.name for planned in plan],
            settings=list(request.assignments),
            seed=request.seed,
            software=software(),
        )
        runner.run(plan, begin, after=never_stop)
        roles = {role for planned in plan for role in planned.procedure.roles}
        watchdogs = () if station.source == VIRTUAL else tuple(planned_watchdogs(station, roles))
        done = Rehearsed(folder.path, twin, script, view, context.operator.hand_time, station, request, watchdogs)
    write_file(done.path / SCRIPT, to_bytes(_json(done.as_dict(translate))))
    return done


def _own_limit(station: Station, instruments: StationInstruments, name: str, parameter: str) -> Limit:
    """Return what an instrument itself takes of a parameter, which its driver's options may have lowered."""
    entry = _entry(station, name)
    amount = _amount(entry, parameter)
    key = amount.own if amount else ""
    if not key:
        return NO_LIMIT
    bound = getattr(instruments.get(entry.role), key)
    if bound == getattr(entry.options, key, None):
        return Limit(bound, text("the station ({key})", key=f"instruments.{entry.role.value}.{key}"))
    return Limit(bound, text("the model"))


def _offered(station: Station, name: str, parameter: str) -> Sequence[float]:
    """Return the only values that an instrument takes of a parameter, by its entry in the station file."""
    entry = _entry(station, name)
    amount = _amount(entry, parameter)
    return getattr(entry.options, amount.offered, ()) if amount and amount.offered else ()


def _entry(station: Station, name: str) -> Entry:
    return next(entry for entry in station.entries.values() if entry.name == name)


def _amount(entry: Entry, parameter: str) -> Amount | None:
    amounts = (one for each in declarations(entry.role.interface).values() for one in each.amounts.values())
    return next((one for one in amounts if parameter in (one.label, one.vector)), None)


def _station(request: RunRequest) -> Station:
    if request.station != VIRTUAL:
        return load_station(Path(request.station))
    absent = {*FIXTURE, Role.INSULATION_TESTER, *(() if request.motor.six_step is not None else (Role.DRIVE,))}
    motor = request.motor
    truth = motor.virtual or assumed_motor(motor.nameplate)[0]
    return virtual_station(
        {role.value: "-" for role in Role if role not in absent},
        dq_inverter_for(motor.nameplate) if commands_dq(request) else None,
        size=bench_size_for(truth, motor.nameplate),
    )


def _json(made: dict[str, Any]) -> str:
    import json

    return json.dumps(plain(made), ensure_ascii=False, allow_nan=False, indent=2) + "\n"
