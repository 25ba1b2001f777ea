"""One-line summary of a run from its first and last event, so that thousands of runs can be listed without reading them."""

from dataclasses import dataclass

from bench.i18n.errors import InputError
from bench.journal.events.run import RunFinished, RunStarted
from bench.journal.journal_file import last_whole_line, read_lines
from bench.journal.run_folder import RunFolder


@dataclass(frozen=True)
class Overview:
    """`status` is `interrupted` for a run without an end, `unreadable` for what is none."""

    name: str
    began: str = ""
    motor: str = ""
    status: str = "unreadable"
    procedures: tuple[str, ...] = ()


def overview(folder: RunFolder) -> Overview:
    """Return what a run's first and last events tell of it."""
    try:
        line = next(read_lines(folder.journal), None)
        last = last_whole_line(folder.journal)
    except (InputError, OSError):
        return Overview(folder.path.name)
    if line is None or line.event is None or not isinstance(line.event.event, RunStarted):
        return Overview(folder.path.name)
    begun = line.event.event
    ended = last.event.event if last is not None and last.event is not None else None
    return Overview(
        name=folder.path.name,
        began=line.event.wall,
        motor=begun.motor.name,
        status=ended.status if isinstance(ended, RunFinished) else "interrupted",
        procedures=tuple(begun.procedures),
    )
