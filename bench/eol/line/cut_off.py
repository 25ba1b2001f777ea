"""The record of a motor whose worker died: what its journal still tells."""

from dataclasses import replace
from datetime import datetime
from pathlib import Path

from bench.eol.line.ended_record import ended_record
from bench.eol.line.messages import Batch, Task
from bench.eol.line.unit_names import run_folders
from bench.eol.record import MotorRecord
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError
from bench.i18n.language import translator
from bench.journal.journal_file import JournalFile, read_journal
from drivers.interfaces.text import Text, text


def cut_off_record(batch: Batch, socket: str, task: Task, began: datetime, how: Text, *, stopped: str) -> MotorRecord:
    """Return the record: an error, or aborted where the batch was `stopped`; `how` says what became of the worker."""
    folder, journal = _journal(Path(batch.folder), task)
    died = text("the process of socket {name} {how}", name=socket, how=how)
    cause = Text("{died}{where}", {"died": died, "where": _where(journal)})
    verdict = Verdict.ABORTED if stopped else Verdict.ERROR
    bench_time = journal.events[-1].time if journal and journal.events else 0.0
    return replace(
        ended_record(batch, socket, task, began, verdict, first_pass=False, bench_time=bench_time),
        cause=cause.render(translator(batch.language)),
        run=str(folder) if folder else "",
        journal_sha256=journal.last_hash if journal else "",
    )


def _journal(runs: Path, task: Task) -> tuple[Path | None, JournalFile | None]:
    folders = run_folders(runs, task)
    if not folders:
        return None, None
    try:
        return folders[-1], read_journal(folders[-1] / "journal.jsonl")
    except InputError:
        # Cut off before its first event was written.
        return folders[-1], None


def _where(journal: JournalFile | None) -> Text:
    """Return in which procedure and step it was."""
    procedure = step = ""
    for event in journal.events if journal else ():
        if event.kind == "procedure_started":
            procedure, step = str(event.data.get("procedure", "")), ""
        elif event.kind == "step_started":
            step = str(event.data.get("step", ""))
    if not procedure:
        return text(", before the first procedure")
    if not step:
        return text(", in {procedure}", procedure=procedure)
    return text(", in {procedure} at step {step}", procedure=procedure, step=step)
