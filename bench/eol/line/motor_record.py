"""A motor's record from what is known of its passage."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime

from bench.eol.line.ended_record import ended_record
from bench.eol.line.judging import MotorJudge, described
from bench.eol.line.kept_waveforms import KeptWaveforms
from bench.eol.line.messages import Batch, Task
from bench.eol.record import Measured, MotorRecord
from bench.eol.verdict import Verdict
from bench.journal.errors import RecordError
from bench.journal.run_folder import RunFolder
from bench.run.run import Finished


@dataclass
class Passage:
    """What is known of one motor's passage so far; `cause` is what kept its run from being made, or its end from being told."""

    task: Task
    judge: MotorJudge
    waveforms: KeptWaveforms
    started: datetime
    folder: RunFolder | None = None
    done: Finished | None = None
    cause: str = ""


def record_of(passage: Passage, batch: Batch, socket: str) -> MotorRecord:
    """Return the record of a passage that has ended, whatever became of it."""
    task, judge, done = passage.task, passage.judge, passage.done
    figures: tuple[Measured, ...] = ()
    bench_time, cause, aborted = 0.0, passage.cause, False
    if done is not None:
        figures = tuple(judge.measured(each) for each in done.view.parameters().parameters.values())
        bench_time, aborted = done.view.bench_time, done.view.status == "aborted"
        cause = cause or done.view.cause
    verdict = judge.verdict(figures, aborted=aborted, planned=len(task.checks))
    if verdict is Verdict.PASS and (done is None or done.view.status != "completed"):
        # Everything was measured, and the way down or the record of it was not as it should be.
        verdict = Verdict.ERROR
    try:
        waveforms = passage.waveforms.of(verdict)
    except RecordError as error:
        waveforms, cause = {}, f"{cause}; {error}" if cause else str(error)
        verdict = Verdict.ERROR if verdict is Verdict.PASS else verdict
    first_pass = judge.first_pass(verdict)
    return replace(
        ended_record(batch, socket, task, passage.started, verdict, first_pass=first_pass, bench_time=bench_time),
        measured=figures,
        checks=judge.attempts,
        cause="" if verdict is Verdict.PASS else _cause(judge, figures, cause),
        run=str(passage.folder.path) if passage.folder else "",
        journal_sha256=done.journal_sha256 if done else "",
        waveforms=waveforms,
    )


def _cause(judge: MotorJudge, figures: Sequence[Measured], cause: str) -> str:
    """Return why a motor did not pass: what its last attempts said, else its figures, else what ended the run."""
    last = {attempt.procedure: attempt.cause for attempt in judge.attempts}
    said = [f"{procedure}: {words}" for procedure, words in last.items() if words]
    if not said:
        said = [described(figure) for figure in figures if figure.verdict is not Verdict.PASS]
    return "; ".join(said) or cause
