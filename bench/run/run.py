"""One run from its request to the written result."""

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import replace
from datetime import date
from typing import TYPE_CHECKING

from bench.i18n.errors import UsageError
from bench.i18n.language import translator
from bench.journal.disk import Reserve, write_file
from bench.journal.earlier_attempts import attempts_of
from bench.journal.encoding import plain
from bench.journal.journal import Journal, Listener
from bench.journal.journal_file import JournalFile
from bench.journal.packed import unpack
from bench.journal.run_folder import new_run_folder
from bench.journal.run_result import conclude
from bench.journal.run_view import RunView, view_of
from bench.journal.unrecorded import Unrecorded
from bench.plugins.records import RecordOutputs
from bench.run.beginning import beginning
from bench.run.context import RunContext, run_context
from bench.run.ending import secure
from bench.run.guarding import guarded
from bench.run.needs import check_needs, possible
from bench.run.photos import kept_photos
from bench.run.plan import Catalogue, Planned, make_plan, roles_of, titles_of
from bench.run.probe_limits import check_asked, given_limits, unstated_probes
from bench.run.probe_verification import verified_before, verified_channels
from bench.run.progress import Progress
from bench.run.request import Finished, RunOptions, RunRequest
from bench.run.resume import begun, check_identities, check_resumable, check_unchanged, identities, left_unsafe
from bench.run.retry_policy import never_stop, stop_at_failure
from bench.run.run_operator import FixtureHands
from bench.run.sequencer import Runner
from bench.run.software import software
from bench.run.tape import Tape
from bench.safety.calls import CallWatches
from bench.safety.interlocks import ready as interlocks_ready
from bench.safety.interrupts import Interrupts
from bench.safety.limits.bounds import known_pole_pairs
from bench.safety.memory import set_aside, set_aside_newly_loaded
from bench.safety.read_back import SourceReader
from bench.safety.shutdown import failures, shut_down
from bench.safety.station_instruments import StationInstruments
from bench.safety.watchdog_relays import relays_ready
from bench.safety.watchdogs import planned_watchdogs
from bench.station.clock import wall_date
from bench.station.library_logs import quieten_libraries
from bench.station.shutdown_sequence import OFF_BY, ShutdownAction
from bench.station.station_file import VIRTUAL, Station
from bench.traffic.growing_file import GrowingFile
from bench.traffic.recorder import TrafficRecorder
from bench.virtual.fault_hooks import StepReporter, recording
from drivers.interfaces import InstrumentError
from drivers.interfaces.text import Text, text
from procedures.core.bench import Role
from procedures.core.earlier_call import EarlierAttempt
from procedures.verification.stated_probes import StatedProbes
from procedures.verification.verified_channels import VerifiedChannels

if TYPE_CHECKING:
    from rich.console import Console


def run(
    request: RunRequest,
    catalogue: Catalogue,
    console: "Console",
    today: Callable[[], date] = wall_date,
    listeners: Sequence[Listener] = (),
) -> Finished:
    """Do it; progress and questions go to `console`, calibrations are held against `today`, `listeners` hear the journal.

    Raises InputError before anything is touched.
    """
    quieten_libraries()
    plan = make_plan(request.procedures, request.assignments, catalogue)
    check_resumable(request.resume, plan)
    translate = translator(request.language)
    interrupts = Interrupts()
    purpose = f"motorbench run {' '.join(request.procedures)}"
    with run_context(request, console, interrupts, purpose) as context:
        if list(request.procedures) == ["all"]:
            plan = possible(plan, context.station, console, translate)
        check_needs(plan, context.station)
        used = roles_of(plan, context.station) | context.operator.roles
        live = (request.station == VIRTUAL and request.operator != "terminal") or request.operator == "answers"
        options = RunOptions(
            after=never_stop if request.go_on else stop_at_failure,
            warnings=context.station.check_calibrations(today(), used),
            listeners=(*listeners, Progress(console, titles_of(plan, translate), live=live).hear),
            # What is virtual is not left on by a power cut.
            durable=context.simulation.in_process is None,
        )
        done = carry_out(request, plan, context, interrupts, options)
        _hand_over(done, context.station, request, console)
        return done


def _hand_over(done: Finished, station: Station, request: RunRequest, console: "Console") -> None:
    """Hand the run's record to the outputs that the station names; what one does not take is said."""
    if not station.outputs:
        return
    translate = translator(request.language)

    def failed(words: Text) -> None:
        console.print(words.render(translate), markup=False, soft_wrap=True)

    outputs = RecordOutputs([station.catalogues.records[name] for name in station.outputs], request.runs, failed)
    record = {
        "kind": "run",
        "run": str(done.folder.path),
        "serial_number": request.motor.nameplate.serial_number,
        "plugins": station.catalogues.about(),
    }
    with closing(outputs):
        outputs.hand({**record, **plain(done.result)})


def carry_out(
    request: RunRequest, plan: Sequence[Planned], context: RunContext, interrupts: Interrupts, options: RunOptions
) -> Finished:
    """Run a plan in a context that has every instrument it needs, with journal, guardian and shutdown.

    Raises InputError before anything is touched.
    """
    translate = translator(request.language)
    with ExitStack() as leaving:
        used = roles_of(plan, context.station) | context.operator.roles
        options = options if options.versions else replace(options, versions=software(context.station.catalogues))
        probes = given_limits(request.probes, context.station)
        if Role.OSCILLOSCOPE in used and not verified_before(request, plan):
            check_asked(context.station, probes, somebody=not isinstance(context.operator, FixtureHands))
        previous, view, verified = None, RunView(), VerifiedChannels()
        earlier: Mapping[str, Sequence[EarlierAttempt]] = {}
        if request.probe_verification:
            verified = verified_channels(request.probe_verification, request.runs, context.station, wall_date())
        if request.resume:
            previous, began = begun(request.resume)
            check_unchanged(request.resume, began, request.motor, context.station, options.versions)
            view = view_of(previous.events)
            anew = {*view.finished, *request.repeat}
            earlier = attempts_of(previous.events, {each.name for each in plan if each.procedure.goes_on} - anew)
            _check_instruments(request, previous, plan, context, set(view.finished) - set(request.repeat))
        # Refused before the run has a folder.
        photos = kept_photos(request, context.station) if options.folder is None and previous is None else {}
        recorder = _recorder(request, context, leaving)
        interlocks = leaving.enter_context(interlocks_ready(context.station, context.owner.state))
        relays = leaving.enter_context(relays_ready(context.station.watchdog_relays, used, context.station.source))
        folder = request.resume or options.folder
        if folder is None:
            folder = new_run_folder(request.runs, request.motor.nameplate.name)
            leaving.callback(folder.remove_if_empty)
        # A motor of a virtual line is measured again; a run by itself has its end told, whatever its instruments are.
        reserve = options.reserve
        if reserve is None and (options.durable or options.folder is None):
            reserve = Reserve(folder.reserve)
            leaving.callback(reserve.release)
        if options.folder is None:
            context.owner.work_in(folder.path)
        for what, photo in photos.items():
            write_file(folder.photo(what), photo)
        context.operator.announce(folder.path)
        calls = CallWatches(
            interrupts,
            {role: entry.reply_time for role, entry in context.station.entries.items()},
            interruptible=context.simulation.in_process is None,
        )
        context, guard = leaving.enter_context(
            guarded(
                context,
                used - context.sharing.roles,
                folder.path,
                interrupts,
                calls,
                wanted=request.guardian,
                lifelines=(*options.lifelines, *context.owner.descriptors),
            )
        )
        if guard.about() is not None:
            leaving.enter_context(set_aside())
        unpack(folder.journal)
        journal = Journal(
            folder.journal, context.clock.now, durable=options.durable, previous=previous, reserve=reserve
        )
        braked = {item.role for item in context.station.way_down.items if item.do is ShutdownAction.BRAKE}
        guard = relays.beside(guard, braked, journal, interrupts)
        journal.listen(view.apply)
        journal.listen(calls.hear)
        guard.record_in(journal)
        journal.listen(guard.hear)
        if guard.about() is not None:
            journal.listen(set_aside_newly_loaded)
        context.operator.record_in(journal)
        journal.listen(context.operator.hear)
        context.simulation.listen_to_faults(recording(journal))
        journal.listen(StepReporter(context.simulation.step_started).hear)
        for listener in options.listeners:
            journal.listen(listener)
        instruments = StationInstruments(
            context.station,
            request.motor.nameplate,
            context.clock,
            journal,
            options.waveforms.sink(folder.waveforms, durable=options.durable),
            context.visa,
            context.operator.prompts,
            in_process=context.simulation.in_process,
            trace=request.trace,
            pole_pairs=lambda: known_pole_pairs(request.motor.nameplate, view.parameters().parameters),
            calls=calls,
            owner=context.owner,
            traffic_recorder=recorder,
        )
        context.operator.equip(instruments.available())
        own = used - context.sharing.roles
        context.operator.read_back(
            SourceReader(instruments, own & set(context.station.entries), context.station.way_down)
        )
        runner = Runner(
            instruments=instruments,
            operator=context.operator.hands,
            clock=options.procedure_clock or context.clock,
            journal=journal,
            view=view,
            nameplate=request.motor.nameplate,
            translate=translate,
            way_down=context.station.way_down,
            interrupts=interrupts,
            guard=guard,
            sharing=context.sharing,
            verified_channels=verified,
            stated_probes=StatedProbes(unstated_probes(context.station), probes),
            tape=Tape(journal, typing) if (typing := context.operator.typing) else None,
            hand_time=lambda: context.operator.hand_time,
            onlooker=context.operator.onlooker,
            check_modelled=context.simulation.check_modelled,
            earlier=earlier,
        )
        begin = beginning(
            request,
            plan,
            context,
            folder,
            options,
            previous=previous,
            interlocks=interlocks.about(),
            guardian=guard.about(),
            watchdogs=() if context.station.source == VIRTUAL else planned_watchdogs(context.station, used),
        )
        interlocks.watch(journal, interrupts)
        runner.run(
            plan,
            begin,
            after=options.after,
            repeat=request.repeat,
            warnings=options.warnings,
            unsafe_before=previous is not None and left_unsafe(previous.events),
        )
        unfelt = context.simulation.unfelt_faults() if request.faults else []
        return Finished(
            folder,
            view,
            conclude(folder, view, translate) if options.write_result else {},
            journal.last_hash,
            context.simulation.actual_state(),
            tuple(fault.source for fault in request.faults if fault.described.told() in unfelt),
            next(iter(runner.unwritten), journal.failure),
            tuple(runner.left_on),
        )


def _recorder(request: RunRequest, context: RunContext, leaving: ExitStack) -> TrafficRecorder | None:
    """Return what takes down the traffic of a run that is to be recorded; its file grows with it, and is whole when the run is left."""
    file = request.record
    if file is None:
        return None
    if file.exists():
        raise UsageError(text("--record {file}: the file already exists; choose another file", file=file))
    growing = GrowingFile(file, {role.value: entry.table for role, entry in context.station.entries.items()})
    recorder = TrafficRecorder(context.clock.now, growing.take)
    leaving.callback(lambda: growing.finish(recorder.recording(context.station)))
    return recorder


def _check_instruments(
    request: RunRequest, previous: JournalFile, plan: Sequence[Planned], context: RunContext, finished: Collection[str]
) -> None:
    """Open what is still needed, see that the same instruments answer as before, and close it; nothing is recorded of that."""
    folder = request.resume
    if folder is None:
        return
    needed = {role for planned in plan if planned.name not in finished for role in planned.procedure.roles}
    needed |= context.operator.roles if needed else set()
    nowhere = Unrecorded()
    instruments = StationInstruments(
        context.station,
        request.motor.nameplate,
        context.clock,
        nowhere,
        nowhere,
        context.visa,
        context.operator.prompts,
        in_process=context.simulation.in_process,
        owner=context.owner,
    )
    try:
        if left_unsafe(previous.events):
            _secure(instruments, previous, context)
        for role in sorted(needed, key=lambda role: role.value):
            instruments.open(role)
        check_identities(folder, previous.events, instruments.opened())
    finally:
        instruments.close()


def _secure(instruments: StationInstruments, previous: JournalFile, context: RunContext) -> None:
    """Switch off what an earlier session left on before anything is asked of it: whatever keeps the run from going on, it is off."""
    way_down = context.station.way_down
    # What a person switches is asked for once the run goes on.
    used = {Role(name) for name in identities(previous.events)}
    sources = {role for role in used - way_down.by_hand if role in OFF_BY and role in context.station.entries}

    def walk() -> list[str]:
        return failures(shut_down(way_down, instruments.opened(), Unrecorded(), context.clock))

    if unsafe := secure(instruments, sources, walk):
        raise InstrumentError(
            "the bench", "; ".join(unsafe), remedy=text("Switch it off by hand, then go on with --resume")
        )
