"""What a motor's passage is called: its record's identifier, its run's folder."""

import re
import uuid
from pathlib import Path

from bench.eol.line.messages import Task
from bench.journal.run_folder import RunFolder

_UNSAFE_IN_NAMES = re.compile(r"[^\w.-]+")
#: No folder gets more runs than this, however long the batch.
_IN_A_FOLDER = 1000
_MOST = 1000


def identifier(batch: str, number: int) -> str:
    """Return a record's identifier: the same for the same motor of the same batch."""
    return str(uuid.uuid5(uuid.UUID(batch), str(number)))


def new_folder(runs: Path, task: Task) -> RunFolder:
    """Make the folder of a motor's run, by its number and serial number; one that was cut off keeps its own. Raises OSError."""
    parent = runs / f"{task.number // _IN_A_FOLDER:03d}"
    parent.mkdir(parents=True, exist_ok=True)
    for count in range(_MOST):
        path = parent / _name(task, count)
        try:
            path.mkdir()
        except FileExistsError:
            continue
        return RunFolder(path)
    raise FileExistsError(f"{parent}: motor {task.number} was begun {_MOST} times")


def run_folders(runs: Path, task: Task) -> list[Path]:
    """Return the folders of a motor's runs, in the order in which they were made."""
    parent = runs / f"{task.number // _IN_A_FOLDER:03d}"
    found = []
    for count in range(_MOST):
        path = parent / _name(task, count)
        if not path.is_dir():
            break
        found.append(path)
    return found


def _name(task: Task, count: int) -> str:
    serial = _UNSAFE_IN_NAMES.sub("-", task.serial_number).strip("-.") or "motor"
    return f"{task.number:06d}-{serial}" + (f"-{count + 1}" if count else "")
