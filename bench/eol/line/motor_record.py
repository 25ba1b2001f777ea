"""One motor's test and what is left of it: its run's folder, its waveforms, and its record, cut off or not."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import takewhile
from pathlib import Path

from bench.eol.diagnosis.diagnose import diagnose
from bench.eol.diagnosis.diagnosed import Diagnosis
from bench.eol.line.batch_log import BatchMotor, record_identifier
from bench.eol.line.judging import MotorJudge, described
from bench.eol.line.workers.messages import Batch, Task
from bench.eol.plan_file import KeepWaveforms
from bench.eol.record import MeasuredFigure, MotorRecord
from bench.eol.told_causes import told_causes
from bench.eol.verdict import Verdict
from bench.i18n.errors import NOTHING, InputError
from bench.i18n.language import translator
from bench.journal.codec import decode
from bench.journal.errors import NoRoomError, RecordError, briefly
from bench.journal.events.instruments import WaveformsTaken
from bench.journal.events.run import ProcedureStarted
from bench.journal.events.safety import GuardianShutdownDone
from bench.journal.guardian_record import FILE as GUARDIAN
from bench.journal.journal_file import JournalFile, read_journal
from bench.journal.recording import WaveformSink
from bench.journal.run_folder import RunFolder
from bench.journal.waveforms import LateWaveforms, NoWaveforms, WaveformFolder
from bench.run.request import Finished
from drivers.interfaces.text import Text, lines, text, word
from procedures.core.events import Event, StepStarted

_UNSAFE_IN_NAMES = re.compile(r"[^\w.-]+")
#: No folder gets more runs than this, however long the batch.
_RUNS_IN_FOLDER = 1000
_MAXIMUM_RUNS_OF_MOTOR = 1000


class KeptWaveforms:
    """The waveforms of one motor that stay, as its plan has it."""

    def __init__(self, keep: KeepWaveforms) -> None:
        self._keep = keep
        self._late: LateWaveforms | None = None
        self._files: dict[str, str] = {}

    def sink(self, folder: Path, *, durable: bool) -> WaveformSink:
        """Return where a run's samples go."""
        if self._keep == "all":
            return WaveformFolder(folder, durable=durable)
        if self._keep == "none":
            return NoWaveforms()
        self._late = LateWaveforms(folder, durable=durable)
        return self._late

    def on_event(self, event: Event) -> None:
        """Note a file that was written at once."""
        if isinstance(event, WaveformsTaken) and event.file.sha256:
            self._files[event.file.path] = event.file.sha256

    def files(self, verdict: Verdict) -> Mapping[str, str]:
        """Return each file's SHA-256 by path, those written that were held until this verdict. Raises RecordError."""
        if self._late is not None and verdict is not Verdict.PASS:
            self._files |= {stored.path: stored.sha256 for stored in self._late.write()}
        return self._files


@dataclass
class UnitTest:
    """The test of one motor so far; `cause` is what kept its run from beginning, or its end from being recorded.

    `unwritten` is what kept a record from the disk.
    """

    task: Task
    judge: MotorJudge
    waveforms: KeptWaveforms
    started: datetime
    folder: RunFolder | None = None
    finished: Finished | None = None
    cause: Text = NOTHING
    unwritten: RecordError | NoRoomError | None = None


def record_of(test: UnitTest, batch: Batch, socket: str) -> MotorRecord:
    """Return the record of a test that has ended, whatever became of it; what to do of a full disk is left to the line to say."""
    task, judge, finished = test.task, test.judge, test.finished
    figures: tuple[MeasuredFigure, ...] = ()
    bench_time, cause, aborted = 0.0, test.cause, False
    if finished is not None:
        figures = judge.figures(finished.view.parameters())
        bench_time, aborted = finished.view.bench_time, finished.view.status == "aborted"
        cause = cause if cause.render() else finished.view.told
        test.unwritten = test.unwritten or finished.unwritten
    verdict = judge.verdict(figures, aborted=aborted, planned=len(task.checks))
    if verdict is Verdict.PASS and (finished is None or finished.view.status != "completed"):
        # Everything was measured, and the shutdown or the record of it was not as it should be.
        verdict = Verdict.ERROR
    translate = translator(batch.request.language)
    try:
        waveforms = test.waveforms.files(verdict)
    except RecordError as error:
        waveforms, cause = {}, lines([cause, error.brief], "; ") if cause.render() else error.brief
        test.unwritten = test.unwritten or error
        verdict = Verdict.ERROR if verdict is Verdict.PASS else verdict
    cause = briefly(cause, test.unwritten)
    diagnoses: tuple[Diagnosis, ...] = ()
    if verdict is Verdict.FAIL and finished is not None:
        found = {name: result.findings for name, result in finished.view.finished.items()}
        diagnoses = diagnose(found, figures, judge.errors, batch.motor.nameplate.expected)
    why = NOTHING if verdict is Verdict.PASS else _cause(judge, figures, cause)
    faults = [each.words for each in diagnoses]
    return replace(
        _ended_now(batch, socket, task, test.started, verdict, bench_time),
        first_pass=judge.first_pass(verdict),
        measured=figures,
        checks=judge.attempts,
        cause=why.render(translate),
        run=str(test.folder.path) if test.folder else "",
        journal_sha256=finished.journal_sha256 if finished else "",
        diagnosis="; ".join(each.render(translate) for each in faults),
        rework=" ".join(dict.fromkeys(each.code for each in diagnoses)),
        waveforms=waveforms,
        told=told_causes(why, faults, judge.causes),
    )


def cut_off_record(batch: Batch, socket: str, task: Task, started: datetime, how: Text, *, stopped: str) -> MotorRecord:
    """Return the record of a motor whose worker died, from what its journal still holds.

    It is an error, or aborted where the batch was `stopped`; `how` says what became of the worker.
    """
    folders = run_folders(Path(batch.folder), task)
    journal = _journal(folders[-1]) if folders else None
    died = text("the process of socket {name} {how}", name=socket, how=how)
    cause = Text("{died}{where}", {"died": died, "where": _where(journal)})
    verdict = Verdict.ABORTED if stopped else Verdict.ERROR
    bench_time = journal.events[-1].time if journal and journal.events else 0.0
    return replace(
        _ended_now(batch, socket, task, started, verdict, bench_time),
        cause=cause.render(translator(batch.request.language)),
        told=told_causes(cause, (), {}),
        run=str(folders[-1]) if folders else "",
        journal_sha256=journal.last_hash if journal else "",
    )


def left_on_by_guardian(runs: Path, motor: Task | BatchMotor) -> Sequence[str]:
    """Return what the guardian of a motor's latest run could not switch off in its place, as its record in the run's folder says."""
    walked: Sequence[str] = ()
    try:
        lines_written = b"".join(
            (folder / GUARDIAN).read_bytes() for folder in run_folders(runs, motor)[-1:]
        ).splitlines()
    except OSError:
        # Without a guardian, or a disk: nothing is known of what it did.
        return walked
    for found in filter(None, map(decode, lines_written)):
        event = found[0].event
        walked = event.failed if isinstance(event, GuardianShutdownDone) else walked
    return walked


def new_folder(runs: Path, task: Task) -> RunFolder:
    """Make the folder of a motor's run, by its number and serial number; one that was cut off keeps its own. Raises OSError."""
    for path in _folder_names(runs, task):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            path.mkdir()
        except FileExistsError:
            continue
        return RunFolder(path)
    raise FileExistsError(f"{runs}: motor {task.number} was begun {_MAXIMUM_RUNS_OF_MOTOR} times")


def run_folders(runs: Path, task: Task | BatchMotor) -> list[Path]:
    """Return the folders of a motor's runs, in the order in which they were made."""
    return list(takewhile(Path.is_dir, _folder_names(runs, task)))


def _folder_names(runs: Path, task: Task | BatchMotor) -> Iterator[Path]:
    serial = _UNSAFE_IN_NAMES.sub("-", task.serial_number).strip("-.") or "motor"
    path = runs / f"{task.number // _RUNS_IN_FOLDER:03d}" / f"{task.number:06d}-{serial}"
    yield path
    for count in range(2, _MAXIMUM_RUNS_OF_MOTOR + 1):
        yield path.with_name(f"{path.name}-{count}")


def _ended_now(
    batch: Batch, socket: str, task: Task, started: datetime, verdict: Verdict, bench_time: float
) -> MotorRecord:
    """Return what the record of every motor has, without what was measured; `bench_time` in s."""
    return MotorRecord(
        identifier=record_identifier(batch.uid, task.number),
        batch=batch.name,
        number=task.number,
        plan=batch.plan.name,
        plan_sha256=batch.plan.sha256,
        station=batch.line,
        socket=socket,
        person=batch.request.person,
        model=batch.motor.nameplate.name,
        serial_number=task.serial_number,
        started=started,
        ended=datetime.now(UTC),
        verdict=verdict,
        first_pass=False,
        bench_time=bench_time,
        test_number=task.test_number,
        again_by=task.again_by,
        golden=task.golden_limits is not None,
    )


def _cause(judge: MotorJudge, figures: Sequence[MeasuredFigure], cause: Text) -> Text:
    """Return why a motor did not pass: the causes of its last attempts, else its figures, else what ended the run."""
    last = {attempt.procedure: judge.causes.get((attempt.procedure, attempt.attempt)) for attempt in judge.attempts}
    causes = [
        text("{what}: {cause}", what=word(procedure), cause=reason) for procedure, reason in last.items() if reason
    ] or [described(figure) for figure in figures if figure.verdict is not Verdict.PASS]
    return lines(causes, "; ") if causes else cause


def _journal(folder: Path) -> JournalFile | None:
    try:
        return read_journal(folder / "journal.jsonl")
    except InputError:
        # Cut off before its first event was written.
        return None


def _where(journal: JournalFile | None) -> Text:
    """Return in which procedure and step it was."""
    procedure = step = ""
    for recorded in journal.events if journal else ():
        if isinstance(recorded.event, ProcedureStarted):
            procedure, step = recorded.event.procedure, ""
        elif isinstance(recorded.event, StepStarted):
            step = recorded.event.step
    if not procedure:
        return text(", before the first procedure")
    if not step:
        return text(", in {procedure}", procedure=word(procedure))
    return text(", in {procedure} at step {step}", procedure=word(procedure), step=step)
