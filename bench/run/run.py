"""One run from the command line's wishes to the written result."""

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.i18n.language import translator
from bench.journal.disk import Reserve
from bench.journal.journal import DURABLE, Journal, Listener
from bench.journal.journal_file import JournalFile
from bench.journal.recording import WaveformSink
from bench.journal.run_folder import RunFolder, new_run_folder
from bench.journal.run_result import conclude
from bench.journal.run_view import RunView, view_of
from bench.journal.unrecorded import Unrecorded
from bench.journal.waveforms import WaveformFolder
from bench.motor.motor_file import MotorFile
from bench.run.context import Place, place
from bench.run.guarding import guarded
from bench.run.plan import Catalogue, Planned, check_roles, make_plan, possible
from bench.run.progress import Progress
from bench.run.resume import begun, check_identities, check_unchanged, left_unsafe
from bench.run.retry_policy import After, never_stop, stop_at_failure
from bench.run.sequencer import Runner, secure
from bench.run.software import software
from bench.safety.calls import CallWatches
from bench.safety.interlocks import ready as interlocks_ready
from bench.safety.interrupts import Interrupts
from bench.safety.limits.bounds import known_pole_pairs
from bench.safety.shutdown import failures, shut_down
from bench.safety.station_instruments import StationInstruments
from bench.safety.watchdog_relays import relays_ready
from bench.safety.watchdogs import planned_watchdogs
from bench.station.clock import wall_date
from bench.station.library_logs import quieten_libraries
from bench.station.shutdown_sequence import OFF_BY, Do
from bench.station.station_file import VIRTUAL
from bench.virtual.fault_hooks import StepTeller, recording
from drivers.interfaces import Clock, InstrumentError
from drivers.interfaces.text import Translate
from procedures.core.bench import Role
from procedures.core.result import Notice

if TYPE_CHECKING:
    from rich.console import Console

    from bench.virtual.fault_file import GivenFault


@dataclass(frozen=True)
class Wishes:
    """What the command line asks for; `language` is settled already. Without `guardian`, none is started: for tests."""

    procedures: Sequence[str]
    motor: MotorFile
    station: str
    language: str
    runs: Path
    operator: str = ""
    person: str = ""
    answers: Path | None = None
    assignments: Sequence[str] = field(default_factory=tuple)
    seed: int = 0
    trace: bool = False
    faults: "Sequence[GivenFault]" = ()
    go_on: bool = False
    resume: RunFolder | None = None
    repeat: Sequence[str] = ()
    guardian: bool = True


def _as_it_is(clock: Clock) -> Clock:
    return clock


@dataclass(frozen=True)
class How:
    """What a line does otherwise than a single run.

    `folder` is made already; `versions` are known already; `waveforms` gives where samples go, for their folder; `lifelines` are
    file descriptors that a guardian keeps open for as long as it lives; `waits` gives the clock that procedures wait by; `durable` are the
    kinds of events that must have reached the disk before what follows them; without `reserve` no room is kept for a run's end.
    `about` is told at the     run's beginning besides; `concluded` writes and gives the result.
    """

    after: After = stop_at_failure
    warnings: Sequence[Notice] = ()
    listeners: Sequence[Listener] = ()
    folder: RunFolder | None = None
    versions: Mapping[str, str] = field(default_factory=dict)
    waveforms: Callable[[Path], WaveformSink] = WaveformFolder
    lifelines: Sequence[int] = ()
    waits: Callable[[Clock], Clock] = _as_it_is
    durable: frozenset[str] = DURABLE
    reserve: bool = True
    about: Mapping[str, Any] = field(default_factory=dict)
    concluded: Callable[[RunFolder, RunView, Translate], dict[str, Any]] = conclude


@dataclass(frozen=True)
class Finished:
    """A run that has ended: its folder, what it came to, that as JSON, and the bench time (s) that hands needed.

    `journal_sha256` is the hash of the journal's last event. `left` is what was really so on a virtual bench after the
    way down, empty for a real one.
    """

    folder: RunFolder
    view: RunView
    result: dict[str, Any]
    hand_time: float
    journal_sha256: str = ""
    left: Mapping[str, Any] = field(default_factory=dict)


def run(
    wishes: Wishes,
    catalogue: Catalogue,
    console: "Console",
    today: Callable[[], date] = wall_date,
    listeners: Sequence[Listener] = (),
) -> Finished:
    """Do it; progress and questions go to `console`, calibrations are held against `today`, `listeners` hear the journal.

    Raises InputError before anything is touched.
    """
    quieten_libraries()
    plan = make_plan(wishes.procedures, wishes.assignments, catalogue)
    translate = translator(wishes.language)
    interrupts = Interrupts()
    with place(
        wishes.station,
        wishes.motor,
        wishes.operator,
        answers=wishes.answers,
        seed=wishes.seed,
        console=console,
        language=wishes.language,
        interrupts=interrupts,
        faults=wishes.faults,
        what=f"motorbench run {' '.join(wishes.procedures)}",
    ) as where:
        if list(wishes.procedures) == ["all"]:
            plan = possible(plan, where.station, console, translate)
        check_roles(plan, where.station)
        used = {role for planned in plan for role in planned.procedure.roles} | where.operators_roles
        live = wishes.station == VIRTUAL or wishes.operator == "answers"
        how = How(
            after=never_stop if wishes.go_on else stop_at_failure,
            warnings=where.station.check_calibrations(today(), used),
            listeners=(*listeners, Progress(console, [planned.name for planned in plan], live=live).hear),
        )
        return carry_out(wishes, plan, where, interrupts, how)


def carry_out(wishes: Wishes, plan: Sequence[Planned], where: Place, interrupts: Interrupts, how: How) -> Finished:
    """Run a plan at a place, with journal, guardian and way down; `where` has every instrument that the plan needs.

    Raises InputError before anything is touched.
    """
    translate = translator(wishes.language)
    with ExitStack() as leaving:
        used = {role for planned in plan for role in planned.procedure.roles} | where.operators_roles
        versions = how.versions or software()
        previous, view = None, RunView()
        if wishes.resume:
            previous, began = begun(wishes.resume)
            check_unchanged(wishes.resume, began, wishes.motor, where.station, versions)
            view = view_of(previous.events)
            _check_instruments(wishes, previous, plan, where, set(view.finished) - set(wishes.repeat))
        interlocks = leaving.enter_context(interlocks_ready(where.station, where.owner.state))
        relays = leaving.enter_context(relays_ready(where.station.watchdog_relays, used, where.station.source))
        folder = wishes.resume or how.folder or new_run_folder(wishes.runs, wishes.motor.nameplate.name)
        if how.folder is None:
            where.owner.work_in(folder.path)
        where.announce(folder.path)
        calls = CallWatches(
            interrupts,
            {role: entry.reply_time for role, entry in where.station.entries.items()},
            interruptible=where.in_process is None,
        )
        where, guard = leaving.enter_context(
            guarded(
                where,
                used - where.sharing.roles,
                folder.path,
                interrupts,
                calls,
                wanted=wishes.guardian,
                lifelines=(*how.lifelines, *where.owner.descriptors),
            )
        )
        reserve = Reserve(folder.reserve) if how.reserve else None
        journal = Journal(folder.journal, where.clock.now, durable=how.durable, previous=previous, reserve=reserve)
        braked = {item.role for item in where.station.way_down.items if item.do is Do.BRAKE}
        guard = relays.beside(guard, braked, journal, interrupts)
        journal.listen(view.apply)
        journal.listen(calls.hear)
        guard.record_in(journal)
        journal.listen(guard.hear)
        journal.listen(where.operator_hears)
        where.listen_to_faults(recording(journal))
        journal.listen(StepTeller(where.step_started).hear)
        for listener in how.listeners:
            journal.listen(listener)
        instruments = StationInstruments(
            where.station,
            wishes.motor.nameplate,
            where.clock,
            journal,
            how.waveforms(folder.waveforms),
            where.visa,
            where.prompts,
            in_process=where.in_process,
            trace=wishes.trace,
            pole_pairs=lambda: known_pole_pairs(wishes.motor.nameplate, view.parameters().parameters),
            calls=calls,
            owner=where.owner,
        )
        where.equip(instruments.available())
        runner = Runner(
            instruments,
            where.operator,
            how.waits(where.clock),
            journal,
            view,
            wishes.motor.nameplate,
            translate,
            where.station.way_down,
            interrupts,
            guard,
            where.sharing,
        )
        about = _about(wishes, plan, where, folder, versions) | dict(how.about)
        if previous:
            about["torn_bytes"] = previous.torn_bytes
        about["interlocks"] = interlocks.about()
        about["guardian"] = guard.about()
        if where.station.source != VIRTUAL:
            about["watchdogs"] = [one.as_dict() for one in planned_watchdogs(where.station, used)]
        interlocks.watch(journal, interrupts)
        runner.run(
            plan,
            "run_resumed" if previous else "run_started",
            about,
            after=how.after,
            repeat=wishes.repeat,
            warnings=how.warnings,
            unsafe_before=previous is not None and left_unsafe(previous.events),
        )
        return Finished(
            folder,
            view,
            how.concluded(folder, view, translate),
            where.hand_time(),
            journal.last_hash,
            where.really(),
        )


def _check_instruments(
    wishes: Wishes, previous: JournalFile, plan: Sequence[Planned], where: Place, finished: Collection[str]
) -> None:
    """Open what is still needed, see that the same instruments answer as before, and close it; nothing is recorded of that."""
    folder = wishes.resume
    if folder is None:
        return
    needed = {role for planned in plan if planned.name not in finished for role in planned.procedure.roles}
    needed |= where.operators_roles if needed else set()
    nowhere = Unrecorded()
    instruments = StationInstruments(
        where.station,
        wishes.motor.nameplate,
        where.clock,
        nowhere,
        nowhere,
        where.visa,
        where.prompts,
        in_process=where.in_process,
        owner=where.owner,
    )
    try:
        if left_unsafe(previous.events):
            _secure(instruments, previous, where)
        for role in sorted(needed, key=lambda role: role.value):
            instruments.open(role)
        check_identities(folder, previous.events, instruments.opened())
    finally:
        instruments.close()


def _secure(instruments: StationInstruments, previous: JournalFile, where: Place) -> None:
    """Switch off what an earlier session left on before anything is asked of it: whatever keeps the run from going on, it is off."""
    way_down = where.station.way_down
    # What a person switches is asked for once the run goes on.
    used = {Role(event.data["instrument"]) for event in previous.events if event.kind == "instrument_opened"}
    sources = {role for role in used - way_down.by_hand if role in OFF_BY and role in where.station.entries}

    def walk() -> list[str]:
        return failures(shut_down(way_down, instruments.opened(), Unrecorded(), where.clock))

    if unsafe := secure(instruments, sources, walk):
        raise InstrumentError("the bench", "; ".join(unsafe), remedy="Switch it off by hand, then go on with --resume")


def _about(
    wishes: Wishes, plan: Sequence[Planned], where: Place, folder: RunFolder, versions: Mapping[str, str]
) -> dict[str, Any]:
    station = where.station
    return {
        "run": str(folder.path),
        "motor": {
            "name": wishes.motor.nameplate.name,
            "serial_number": wishes.motor.nameplate.serial_number,
            "source": wishes.motor.source,
            "sha256": wishes.motor.sha256,
        },
        "station": {
            "name": station.name,
            "source": station.source,
            "sha256": station.sha256,
            "instruments": {
                role.value: {
                    "driver": entry.driver.name,
                    "address": entry.address,
                    "calibration": entry.calibration.as_dict() if entry.calibration else None,
                }
                for role, entry in station.entries.items()
            },
        },
        "operator": wishes.operator,
        "person": wishes.person,
        "procedures": [planned.name for planned in plan],
        "settings": list(wishes.assignments),
        "seed": wishes.seed,
        "faults": [fault.described.told() for fault in wishes.faults],
        "language": wishes.language,
        "software": dict(versions),
        "truth": where.truth,
        "motor_file": wishes.motor.content,
        "station_file": station.content,
    }
