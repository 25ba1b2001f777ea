"""The first event of a run's session: with what, by whom, and what is measured."""

from collections.abc import Sequence

from bench.journal.events.run import (
    SCHEMA,
    CalibrationReference,
    InstrumentEntry,
    MotorReference,
    RunResumed,
    RunStarted,
    StationReference,
)
from bench.journal.events.safety import GuardianStart, InterlocksStart
from bench.journal.journal_file import JournalFile
from bench.journal.run_folder import RunFolder
from bench.run.context import RunContext
from bench.run.plan import Planned, measured_at, parameters_of
from bench.run.request import RunOptions, RunRequest
from bench.safety.watchdogs import RoleWatchdog
from bench.station.calibration import Calibration
from bench.station.station_file import VIRTUAL


def beginning(
    request: RunRequest,
    plan: Sequence[Planned],
    context: RunContext,
    folder: RunFolder,
    options: RunOptions,
    *,
    previous: JournalFile | None,
    interlocks: InterlocksStart,
    guardian: GuardianStart | None,
    watchdogs: Sequence[RoleWatchdog],
) -> RunStarted | RunResumed:
    """Return the first event of a session."""
    station, motor, unit = context.station, request.motor, options.unit
    entries = {
        role.value: InstrumentEntry(entry.driver.name, entry.address, _calibration(entry.calibration))
        for role, entry in station.entries.items()
    }
    begun: type[RunStarted | RunResumed] = RunResumed if previous else RunStarted
    return begun(
        schema=SCHEMA,
        run=str(folder.path),
        motor=MotorReference(motor.nameplate.name, motor.nameplate.serial_number, motor.source, motor.sha256),
        station=StationReference(station.name, station.source, station.sha256, entries),
        operator=request.operator,
        person=request.person,
        procedures=[planned.name for planned in plan],
        settings=list(request.assignments),
        seed=request.seed,
        faults=[fault.described.told() for fault in request.faults],
        disturbances=request.disturbances.read_text(encoding="utf-8") if request.disturbances else "",
        probe_verification=request.probe_verification,
        probes=list(request.probes),
        language=request.language,
        software=dict(options.versions),
        truth=context.simulation.true_values(parameters_of(plan), measured_at(plan, motor.nameplate, station)),
        motor_file=motor.content,
        station_file=station.content,
        batch=unit.batch if unit else None,
        number=unit.number if unit else None,
        socket=unit.socket if unit else None,
        torn_bytes=previous.torn_bytes if previous else None,
        interlocks=interlocks,
        guardian=guardian,
        watchdogs=None if station.source == VIRTUAL else [one.as_dict() for one in watchdogs],
    )


def _calibration(calibration: Calibration | None) -> CalibrationReference | None:
    return None if calibration is None else CalibrationReference(**calibration.as_dict())
