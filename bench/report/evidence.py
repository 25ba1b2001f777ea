"""From a run's folder to what its report is made from."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from bench.journal.codec import RecordedEvent
from bench.journal.corrected import corrected
from bench.journal.events.instruments import InstrumentOpened, WaveformsTaken
from bench.journal.events.run import InstrumentEntry
from bench.journal.finished_run import FinishedRun
from bench.journal.procedure_events import ProcedurePassage, StepPassage, passages
from bench.journal.signatures import MEANINGS, Signature, signatures
from bench.journal.step_readings import readings_of
from bench.journal.waveforms import StoredWaveform, read_waveform
from bench.plugins.files import catalogues_of_run
from bench.report.connections import measured_connections
from bench.report.photos import photos_of
from drivers.interfaces import Identity
from drivers.interfaces.text import Text, word
from procedures.core.procedure import Procedure
from procedures.core.steps import Step
from reports.document.record import (
    CalibrationRecord,
    ConnectionRecord,
    InstrumentRecord,
    JournalEnd,
    ProcedureRecord,
    ProcedureStepRecord,
    RunRecord,
    SignOff,
)

#: What of a run's software the page leaves to the journal, and how long a SHA-256 is.
_BENEATH, _SHA256 = frozenset({"numpy", "scipy", "GTC", "code"}), 64


def record_of(run: FinishedRun) -> RunRecord:
    """Return a run as the report takes it; a run that was cut off has what its journal holds.

    Raises InputError where its signatures cannot be read.
    """
    view, start = run.view, run.start
    motor, station = start.motor, start.station
    known = catalogues_of_run(start.software).procedures
    taken, drawn = passages(corrected(run.events)), measured_connections(run.events, run.nameplate)
    return RunRecord(
        name=run.name,
        status=view.status,
        cause=view.told if view.cause else "",
        started=_minute(run.events[0].wall),
        ended=_minute(run.events[-1].wall),
        nameplate=run.nameplate,
        motor_file=motor.source,
        motor_sha256=motor.sha256,
        station=station.name,
        station_file=station.source,
        station_sha256=station.sha256,
        operator=start.person,
        performed_by=start.operator or ("virtual" if station.source == "virtual" else ""),
        software=_printed(start.software),
        instruments=_instruments(station.instruments, run.events),
        parameters=view.parameters(),
        warnings=view.warnings(),
        truth=view.truth,
        procedures=[_procedure(run, made, known.get(name), drawn.get(name, ())) for name, made in taken.items()],
        journal=JournalEnd(len(run.events), run.last_hash, run.torn),
        bench_time=view.bench_time,
        photos=photos_of(run.folder),
        signed=[_signed(each) for each in signatures(run.folder)],
    )


def _printed(software: Mapping[str, str]) -> dict[str, str]:
    """Return the program, Python and what plug-ins took part; a file's SHA-256 by its first digits."""
    kept = {name: version for name, version in software.items() if name not in _BENEATH}
    return {name: version[:12] if len(version) == _SHA256 else version for name, version in kept.items()}


def _signed(each: Signature) -> SignOff:
    meaning = MEANINGS.get(each.meaning, Text("–"))
    return SignOff(each.person, each.role, _minute(each.time), each.words, each.holds, meaning)


def _minute(wall: str) -> str:
    """Return an ISO 8601 time to the second, as people write it."""
    return wall[:19].replace("T", " ") + " UTC"


def _instruments(entries: Mapping[str, InstrumentEntry], recorded: Sequence[RecordedEvent]) -> list[InstrumentRecord]:
    day = recorded[0].wall[:10]
    events = [each.event for each in recorded]
    opened = {event.instrument: event.identity for event in events if isinstance(event, InstrumentOpened)}
    return [_instrument(role, entry, opened.get(role), day) for role, entry in entries.items()]


def _instrument(role: str, entry: InstrumentEntry, identity: Identity | None, day: str) -> InstrumentRecord:
    calibration = entry.calibration
    parts = [identity.manufacturer, identity.model, identity.serial_number] if identity else []
    return InstrumentRecord(
        role=role,
        driver=entry.driver,
        address=entry.address,
        identity=" ".join(part for part in parts if part),
        calibration=CalibrationRecord(calibration.date, calibration.due, calibration.certificate, day > calibration.due)
        if calibration
        else None,
        used=identity is not None,
    )


def _procedure(
    run: FinishedRun,
    passage: ProcedurePassage,
    kind: type[Procedure[Any]] | None,
    connections: Sequence[ConnectionRecord],
) -> ProcedureRecord:
    view = run.view.procedures[passage.name]
    values = {**passage.settings, "rated_current": run.nameplate.rated_current}
    steps = {step.identifier: step for step in kind.steps()} if kind is not None else {}
    return ProcedureRecord(
        name=passage.name,
        title=Text(kind.title if kind is not None else passage.name),
        section=view.result.section if view.result is not None else (kind.section if kind is not None else ""),
        settings=passage.settings,
        steps=[_step(run, step, steps.get(step.identifier), values) for step in passage.steps],
        result=view.result,
        cause=view.told if view.cause else "",
        connections=connections,
        described=_described(kind),
    )


def _described(kind: type[Procedure[Any]] | None) -> dict[str, Text]:
    if kind is None:
        return {}
    fields = kind.settings_type().model_fields
    return {name: word(field.description) for name, field in fields.items() if field.description}


def _step(run: FinishedRun, passage: StepPassage, step: Step | None, values: dict[str, object]) -> ProcedureStepRecord:
    return ProcedureStepRecord(
        identifier=passage.identifier,
        words=_words(passage, step, values),
        by_hand=step.by_hand if step is not None else False,
        status=passage.status,
        started=passage.started,
        ended=passage.ended,
        error=passage.error,
        readings=readings_of(passage.events),
        traces=[partial(_traces, run.folder.path, e) for e in passage.events if isinstance(e, WaveformsTaken)],
    )


def _words(passage: StepPassage, step: Step | None, values: dict[str, object]) -> Text:
    """Return the step's sentence so that it can be said in any language; one that another version took, as it was said then."""
    if step is not None:
        words = step.words(values)
        try:
            if words.render() == passage.sentence:
                return words
        except (KeyError, ValueError, IndexError):
            # The settings that this version's sentence names are not those of the run.
            return _verbatim(passage.sentence)
    return _verbatim(passage.sentence)


def _verbatim(sentence: str) -> Text:
    return Text("{said}", {"said": sentence})


def _traces(folder: Path, taken: WaveformsTaken) -> list[StoredWaveform]:
    """Return the waveforms of one record, those that can still be read."""
    result = []
    for entry in taken.value.values():
        reference = entry["waveform"]
        try:
            result.append(read_waveform(folder / reference.rpartition("#")[0], reference))
        except (OSError, KeyError):
            # A run without its waveforms still has a report; `results verify` says what is missing.
            continue
    return result
