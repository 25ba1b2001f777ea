"""One run from the command line's wishes to the written result."""

import logging
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.clock import wall_date
from bench.fault_hooks import StepTeller, recording
from bench.files.motor_file import MotorFile
from bench.instruments import StationInstruments
from bench.language import translator
from bench.plan import Catalogue, Planned, check_roles, make_plan, possible
from bench.progress import Progress
from bench.record.disk import Reserve
from bench.record.journal import Journal, Listener
from bench.record.journal_file import JournalFile
from bench.record.run_folder import RunFolder, new_run_folder
from bench.record.run_result import conclude
from bench.record.run_view import RunView, view_of
from bench.record.unrecorded import Unrecorded
from bench.record.waveforms import WaveformFolder
from bench.resume import begun, check_identities, check_unchanged, left_unsafe
from bench.runner import Runner
from bench.safety.guarding import guarded
from bench.safety.interlocks import ready as interlocks_ready
from bench.safety.interrupts import Interrupts
from bench.safety.limits import known_pole_pairs
from bench.software import software
from bench.surroundings import Place, place

if TYPE_CHECKING:
    from rich.console import Console

    from bench.files.fault_file import GivenFault


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


@dataclass(frozen=True)
class Finished:
    """A run that has ended: its folder, what it came to, that as JSON, and the bench time (s) that hands needed.

    `left` is what was really so on a virtual bench after the way down, empty for a real one.
    """

    folder: RunFolder
    view: RunView
    result: dict[str, Any]
    hand_time: float
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
    _quieten_libraries()
    plan = make_plan(wishes.procedures, wishes.assignments, catalogue)
    translate = translator(wishes.language)
    interrupts = Interrupts()
    with (
        place(
            wishes.station,
            wishes.motor,
            wishes.operator,
            answers=wishes.answers,
            seed=wishes.seed,
            console=console,
            language=wishes.language,
            interrupts=interrupts,
            faults=wishes.faults,
        ) as where,
        ExitStack() as leaving,
    ):
        if list(wishes.procedures) == ["all"]:
            plan = possible(plan, where.station, console, translate)
        check_roles(plan, where.station)
        used = {role for planned in plan for role in planned.procedure.roles} | where.operators_roles
        overdue = where.station.check_calibrations(today(), used)
        versions = software()
        previous, view = None, RunView()
        if wishes.resume:
            previous, began = begun(wishes.resume)
            check_unchanged(wishes.resume, began, wishes.motor, where.station, versions)
            view = view_of(previous.events)
            _check_instruments(wishes, previous, plan, where, set(view.finished) - set(wishes.repeat))
        interlocks = leaving.enter_context(interlocks_ready(where.station.interlocks, where.station.source))
        folder = wishes.resume or new_run_folder(wishes.runs, wishes.motor.nameplate.name)
        where.announce(folder.path)
        where, guard = leaving.enter_context(guarded(where, used, folder.path, interrupts, wanted=wishes.guardian))
        journal = Journal(folder.journal, where.clock.now, previous=previous, reserve=Reserve(folder.reserve))
        journal.listen(view.apply)
        for listener in listeners:
            journal.listen(listener)
        journal.listen(guard.hear)
        journal.listen(interrupts.hear)
        journal.listen(where.operator_hears)
        live = wishes.station == "virtual" or wishes.operator == "answers"
        where.listen_to_faults(recording(journal))
        journal.listen(StepTeller(where.step_started).hear)
        journal.listen(Progress(console, [planned.name for planned in plan], live=live).hear)
        instruments = StationInstruments(
            where.station,
            wishes.motor.nameplate,
            where.clock,
            journal,
            WaveformFolder(folder.waveforms),
            where.visa,
            where.prompts,
            in_process=where.in_process,
            trace=wishes.trace,
            pole_pairs=lambda: known_pole_pairs(wishes.motor.nameplate, view.parameters().parameters),
        )
        where.equip(instruments.available())
        runner = Runner(
            instruments,
            where.operator,
            where.clock,
            journal,
            view,
            wishes.motor.nameplate,
            translate,
            where.station.way_down,
            interrupts,
            guard,
        )
        about = _about(wishes, plan, where, folder, versions)
        if previous:
            about["torn_bytes"] = previous.torn_bytes
        about["interlocks"] = interlocks.about()
        interlocks.watch(journal, interrupts)
        runner.run(
            plan,
            "run_resumed" if previous else "run_started",
            about,
            go_on=wishes.go_on,
            repeat=wishes.repeat,
            warnings=overdue,
            unsafe_before=previous is not None and left_unsafe(previous.events),
        )
        return Finished(folder, view, conclude(folder, view, translate), where.hand_time(), where.really())


def _quieten_libraries() -> None:
    """Have libraries' logs go where somebody has set them up to go, and not between the lines of the run.

    What they complain of is in the errors that the drivers raise.
    """
    root = logging.getLogger()
    if not root.handlers:
        root.addHandler(logging.NullHandler())


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
    )
    try:
        for role in sorted(needed, key=lambda role: role.value):
            instruments.open(role)
        check_identities(folder, previous.events, instruments.opened())
    finally:
        instruments.close()


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
