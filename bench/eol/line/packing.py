"""Runs of motors compressed when they have ended."""

from pathlib import Path

from bench.eol.record import MotorRecord
from bench.journal.events.run import RunFinished
from bench.journal.journal_file import last_whole_line
from bench.journal.packed import pack
from bench.journal.run_folder import RunFolder


def pack_run(record: MotorRecord) -> None:
    """Pack the journal of a motor's run, which has ended. Raises OSError, FileError where that cannot be done."""
    if record.run and (journal := RunFolder(Path(record.run)).journal).is_file():
        pack(journal)


def pack_batch(folder: Path) -> int:
    """Pack the journals of a batch's runs that have ended, and are not packed; return how many. Raises OSError, FileError."""
    packed = 0
    for journal in sorted(folder.glob("*/*/journal.jsonl")):
        last = last_whole_line(journal)
        # One without an end may still be written.
        if last is not None and last.event is not None and isinstance(last.event.event, RunFinished):
            pack(journal)
            packed += 1
    return packed
