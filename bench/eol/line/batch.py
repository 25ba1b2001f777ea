"""One batch, from its request to its counts."""

from collections.abc import Sequence
from contextlib import closing, nullcontext
from functools import partial
from pathlib import Path
from typing import IO

from bench.eol.line.admission.admission_desk import AdmissionDesk
from bench.eol.line.admission.golden_gate import GoldenGate
from bench.eol.line.admission.next_motor import Admission
from bench.eol.line.admission.serial_numbers import QueuedSerials, ScannedSerials, SerialNumbers, open_serials
from bench.eol.line.batch_listener import BatchListener
from bench.eol.line.batch_log import BatchLog, BatchMotor
from bench.eol.line.calibration_watch import CalibrationWatch
from bench.eol.line.coordinator import Coordinator
from bench.eol.line.counts import CountingListener, Counts
from bench.eol.line.motor_record import left_on_by_guardian
from bench.eol.line.panel_channel import PanelChannel
from bench.eol.line.preparation.decidable_limits import DecidableLimits
from bench.eol.line.preparation.line_file import ProductionLine, digest
from bench.eol.line.preparation.prepare import (
    BatchRequest,
    Prepared,
    calibrations_of,
    check_operator,
    prepare,
)
from bench.eol.line.preparation.procedure_order import by_time_over_failures
from bench.eol.line.preparation.stored_names import check_batch_name, check_person
from bench.eol.line.record_writer import RecordWriter, open_record_writer
from bench.eol.line.warm_up import WarmUp
from bench.eol.line.workers.messages import Batch
from bench.eol.line.workers.worker_process import ForkServer
from bench.eol.plan import Plan, PlannedCheck
from bench.eol.plan_file import ANY_SERIAL
from bench.eol.plans_beside import check_serial
from bench.eol.store.batch_plans import BatchPlan
from bench.eol.store.faults import StoreError
from bench.eol.store.records import BatchResult
from bench.eol.verdict import Verdict
from bench.i18n.errors import UsageError
from bench.plugins.records import RecordOutputs
from bench.safety.ownership.owner import Owner
from bench.safety.ownership.stations import owning_stations
from drivers.interfaces.text import text

#: So many serial numbers that were scanned and not tested are named.
_NAMED = 20


def run_batch(
    request: BatchRequest, listener: BatchListener, stream: IO[str], fork_server: ForkServer | None = None
) -> tuple[Counts, str]:
    """Measure a batch; return what became of it and why it was stopped, empty where it came to its end.

    `stream` is where serial numbers are typed or scanned, `fork_server` where workers come from, one of its own unless given.
    Raises InputError before anything is touched, or where no socket can work; UsageError where not one serial number came;
    StoreError where records can no longer be kept.
    """
    prepared = prepare(request.plan, request.station, request.sockets, request.operator)
    for words in prepared.notes:
        listener.trouble(words)
    return run_prepared(prepared, request, listener, stream, fork_server)


def run_prepared(
    prepared: Prepared,
    request: BatchRequest,
    listener: BatchListener,
    stream: IO[str],
    fork_server: ForkServer | None = None,
) -> tuple[Counts, str]:
    """Measure a batch whose plan, motor and line were read already; otherwise as `run_batch`."""
    line = prepared.line
    name = request.batch or prepared.plan.name
    check_batch_name(request.batch, prepared.plan)
    check_operator(request, line)
    person = request.person.strip()
    check_person(request.person)
    for flag, given in (("--again", request.again), ("--warm", request.warm)):
        if given and not person:
            raise UsageError(
                text(
                    "{flag}: a person must take the responsibility, and the records keep the name: add --person NAME",
                    flag=flag,
                )
            )
    for words in calibrations_of(line, prepared.roles):
        listener.trouble(words)
    stations = [socket.station for socket in line.sockets if socket.station is not None]
    counts = Counts()
    with owning_stations(stations, f"motorbench eol run, batch {name}") as owner:
        folder = request.runs / name
        if owner is not None:
            owner.work_in(folder)
        writer = open_record_writer(request.records, request.runs)
        try:
            stopped = _run(prepared, request, folder, writer, counts, listener, stream, fork_server, owner)
        finally:
            writer.close()
            counts.waits = writer.left
    return counts, stopped


def _run(
    prepared: Prepared,
    request: BatchRequest,
    folder: Path,
    writer: RecordWriter,
    counts: Counts,
    listener: BatchListener,
    stream: IO[str],
    fork_server: ForkServer | None,
    owner: Owner | None,
) -> str:
    plan, line, name = prepared.plan, prepared.line, folder.name
    for words in writer.register.check_plan(plan.name, plan.sha256, prepared.motor.nameplate.name):
        listener.trouble(words)
    uncertainties = writer.uncertainties(plan.name, line.name)
    identity = {
        "name": name,
        "plan": plan.sha256,
        "motor": prepared.motor.sha256,
        "line": digest(line),
        "seed": request.seed,
    }
    with (
        closing(open_serials(request, plan, line, stream)) as serials,
        closing(BatchLog(folder, identity)) as log,
    ):
        batch = Batch(
            name=name,
            uid=log.uid,
            plan=plan,
            limits=prepared.limits,
            motor=prepared.motor,
            line=line.name,
            folder=str(folder),
            request=request,
        )
        checks = _ordered(plan, writer)
        with (
            closing(_panel_channel(serials, batch, line)) as panel,
            nullcontext(fork_server) if fork_server else closing(ForkServer()) as workers,
            closing(_outputs(plan, line, folder, BatchListener(listener, panel))) as outputs,
        ):
            heard = BatchListener(CountingListener(counts, outputs, plan.again), listener, panel)
            limits = DecidableLimits(prepared, heard.noted)
            listeners = BatchListener(heard, limits)
            limits.before(uncertainties)
            writer.listen(listeners.waits)
            _keep_plan(batch, writer, listeners)
            desk = AdmissionDesk(
                writer.register,
                partial(check_serial, plan),
                log.identifier,
                listeners.trouble,
                batch=name,
                station=line.name,
                model=prepared.motor.nameplate.name,
                rule=plan.again,
                person=request.person.strip() if request.again else "",
                spelling_stated=plan.serial_pattern != ANY_SERIAL,
            )
            admission = _admission(prepared, request, serials, log, writer, desk, listeners)
            coordinator = Coordinator(line, batch, checks, admission, writer, log, listeners, workers, owner)
            panel.open(folder, coordinator.stop, desk.permit)
            stopped = coordinator.run()
            if isinstance(serials, QueuedSerials) and (not isinstance(serials, ScannedSerials) or stream.isatty()):
                _tell_untested(list(dict.fromkeys(serials.left())), listeners)
            counts.held_up = admission.held_up
            counts.undecidable = limits.notes
            braked = any(not brake.socket for brake in counts.brakes) or not admission.ended
            counts.unfinished = not stopped and (braked or admission.held_up is not None)
            tested = counts.motors or counts.golden or counts.unfinished or stopped
            if isinstance(serials, ScannedSerials) and not serials.any and not tested:
                raise UsageError(
                    text(
                        "no serial number came before the end of the input, and no motor was tested; scan or type one a line, "
                        "or give --serials FILE"
                    )
                )
            return stopped


def _tell_untested(serials: Sequence[str], listener: BatchListener) -> None:
    """Say which serial numbers a person has scanned for a batch that ended before a socket took them."""
    if serials:
        listener.trouble(
            text(
                "scanned and not tested, because the batch ended before: {serials}. Scan them again when it goes on",
                serials=[*serials[:_NAMED], *(["…"] if len(serials) > _NAMED else [])],
            )
        )


def _admission(
    prepared: Prepared,
    request: BatchRequest,
    serials: SerialNumbers,
    log: BatchLog,
    writer: RecordWriter,
    desk: AdmissionDesk,
    listener: BatchListener,
) -> Admission:
    plan, line = prepared.plan, prepared.line
    warm_up = WarmUp(line, None if request.warm else writer.last_test_ended(line.name))
    if warm_up.waits and not request.warm:
        listener.trouble(warm_up.words)
    if not line.is_virtual and (other := writer.namesake(line.name)) is not None:
        listener.trouble(
            text(
                "another station has the name {station}: the server has a test of {serial} under it, begun {time}, with its run in {run}, "
                "that this station's records do not have. Golden motors' limits and the statistics mix both. Give each its own name "
                "(station.name in the station file), or run both from one folder (--runs)",
                station=line.name,
                serial=other.serial_number,
                time=other.started.astimezone().strftime("%Y-%m-%d %H:%M"),
                run=other.run or "–",
            )
        )
    # Another batch of this name may have its records in the same file.
    own = [each for each in writer.results(log.name) if log.owns(each.number, each.identifier)] if log.resumed else []
    verdicts = {each.serial_number: each.verdict for each in own}
    cut_off, last = _begun_before(log, own)
    for motor in cut_off:
        _tell_left_on(motor, left_on_by_guardian(log.path.parent, motor), listener)
    return Admission(
        serials,
        cut_off,
        desk,
        GoldenGate(
            plan, prepared.limits, [socket.name for socket in line.sockets], writer.golden_tests(plan.name, line.name)
        ),
        last=last,
        finished=[serial for serial, verdict in verdicts.items() if verdict in (Verdict.PASS, Verdict.FAIL)],
        golden_by_itself=line.is_virtual and serials.listed,
        waiting=lambda: warm_up.waits and not request.warm,
        refused=CalibrationWatch(line, prepared.roles, listener.noted, listener.trouble).refused,
    )


def _tell_left_on(motor: BatchMotor, what: Sequence[str], listener: BatchListener) -> None:
    """Say what the guardian of a run could not switch off whose batch was killed: nobody was there who could hear it."""
    if what:
        listener.trouble(
            text(
                "when this batch was cut off at {serial}, {what}. It may still be on: check it before anybody touches the motor",
                serial=motor.serial_number,
                what="; ".join(what),
            )
        )


def _panel_channel(serials: SerialNumbers, batch: Batch, line: ProductionLine) -> PanelChannel:
    """Return the channel to panels, which scan where serial numbers come from them, and watch elsewhere."""
    scanned = serials if isinstance(serials, QueuedSerials) and not isinstance(serials, ScannedSerials) else None
    return PanelChannel(batch.name, batch.plan.name, [socket.name for socket in line.sockets], scanned)


def _outputs(plan: Plan, line: ProductionLine, folder: Path, listener: BatchListener) -> RecordOutputs:
    """Return what records are handed to, as plan and station name it."""
    known = plan.catalogues(line.catalogues).records
    names = dict.fromkeys((*plan.plugins.records, *line.outputs))
    return RecordOutputs([known[name] for name in names], folder, listener.trouble)


def _keep_plan(batch: Batch, writer: RecordWriter, listener: BatchListener) -> None:
    """Keep the text of the plan and of the motor file; where that cannot be, the line says so and goes on."""
    plan, motor = batch.plan, batch.motor
    try:
        writer.keep_plan(BatchPlan(batch.name, plan.sha256, motor.sha256, plan.content, motor.content))
    except StoreError as error:
        listener.trouble(text("the plan's text is not kept with the batch: {error}", error=error))


def _ordered(plan: Plan, writer: RecordWriter) -> Sequence[PlannedCheck]:
    if plan.order == "listed":
        return plan.checks
    return by_time_over_failures(plan.checks, writer.experience(plan.name))


def _begun_before(log: BatchLog, own: Sequence[BatchResult]) -> tuple[list[BatchMotor], int]:
    """Return the motors that were begun and have no record, each once, and the highest number that a motor has.

    A power cut may take the log's last lines and leave the records of their motors.
    """
    kept = {result.number for result in own}
    cut_off = {motor.number: motor for motor in log.begun() if motor.number not in kept}
    return list(cut_off.values()), max(log.last, *kept) if kept else log.last
