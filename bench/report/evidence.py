"""From a run's folder to what its report is made from."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from bench.journal.finished_run import FinishedRun
from bench.journal.journal_file import Event
from bench.journal.procedure_events import ProcedurePassage, StepPassage, passages
from bench.journal.signatures import signatures
from bench.journal.step_readings import readings_of
from bench.journal.waveforms import StoredWaveform, read_waveform
from drivers.interfaces.text import Text
from procedures.catalogue import catalogue
from procedures.core.procedure import Procedure
from procedures.core.steps import Step
from reports.document.record import (
    Calibration,
    InstrumentRecord,
    JournalEnd,
    ProcedureRecord,
    RunRecord,
    SignOff,
    StepRecord,
)


def record_of(run: FinishedRun) -> RunRecord:
    """Return a run as the report takes it; a run that was cut off has what its journal holds.

    Raises InputError where its signatures cannot be read.
    """
    view, start = run.view, run.view.start
    motor, station = start["motor"], start["station"]
    known = catalogue()
    taken = passages(run.events)
    return RunRecord(
        name=run.name,
        status=view.status,
        cause=view.cause,
        started=_minute(run.events[0].wall),
        ended=_minute(run.events[-1].wall),
        nameplate=run.nameplate,
        motor_file=str(motor.get("source", "")),
        motor_sha256=str(motor.get("sha256", "")),
        station=str(station.get("name", "")),
        station_file=str(station.get("source", "")),
        station_sha256=str(station.get("sha256", "")),
        operator=str(start.get("person", "")),
        performed_by=str(start.get("operator", "")) or ("virtual" if station.get("source") == "virtual" else ""),
        software={
            name: str(version)
            for name, version in start.get("software", {}).items()
            if name in ("motorbench", "python")
        },
        instruments=_instruments(station.get("instruments", {}), run.events),
        parameters=view.parameters(),
        warnings=view.warnings(),
        truth=view.truth,
        procedures=[_procedure(run, passage, known.get(name)) for name, passage in taken.items()],
        journal=JournalEnd(len(run.events), run.last_hash, run.torn),
        bench_time=view.bench_time,
        signed=[SignOff(s.person, s.role, _minute(s.time), s.words, s.holds) for s in signatures(run.folder)],
    )


def _minute(wall: str) -> str:
    """Return an ISO 8601 time to the second, as people write it."""
    return wall[:19].replace("T", " ") + " UTC"


def _instruments(entries: Mapping[str, Any], events: Sequence[Event]) -> list[InstrumentRecord]:
    day = events[0].wall[:10]
    opened = {e.data["instrument"]: e.data.get("identity", {}) for e in events if e.kind == "instrument_opened"}
    return [_instrument(role, entry, opened.get(role), day) for role, entry in entries.items()]


def _instrument(role: str, entry: Mapping[str, Any], identity: Mapping[str, Any] | None, day: str) -> InstrumentRecord:
    calibration = entry.get("calibration")
    parts = [str(identity.get(key) or "") for key in ("manufacturer", "model", "serial_number")] if identity else []
    return InstrumentRecord(
        role=role,
        driver=str(entry.get("driver", "")),
        address=str(entry.get("address", "")),
        identity=" ".join(part for part in parts if part),
        calibration=Calibration(
            calibration["date"], calibration["due"], calibration["certificate"], day > calibration["due"]
        )
        if calibration
        else None,
        used=identity is not None,
    )


def _procedure(run: FinishedRun, passage: ProcedurePassage, kind: type[Procedure[Any]] | None) -> ProcedureRecord:
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
        cause=view.cause,
    )


def _step(run: FinishedRun, passage: StepPassage, step: Step | None, values: dict[str, object]) -> StepRecord:
    return StepRecord(
        identifier=passage.identifier,
        words=_words(passage, step, values),
        by_hand=step.by_hand if step is not None else False,
        status=passage.status,
        started=passage.started,
        ended=passage.ended,
        error=passage.error,
        readings=readings_of(passage.events),
        traces=[partial(_traces, run.folder.path, e.data) for e in passage.events if e.kind == "waveforms"],
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


def _traces(folder: Path, data: Mapping[str, Any]) -> list[StoredWaveform]:
    """Return the waveforms of one record, those that can still be read."""
    found = []
    for entry in data.get("value", {}).values():
        reference = entry["waveform"]
        try:
            found.append(read_waveform(folder / reference.rpartition("#")[0], reference))
        except (OSError, KeyError):
            # A run without its waveforms still has a report; `results verify` says what is missing.
            continue
    return found
