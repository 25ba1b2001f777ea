"""A run in a line, from its first and its last event; a folder of thousands is shown without reading all they hold."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.i18n.errors import InputError
from bench.journal.journal_file import Event, parse_line, read_lines
from bench.journal.run_folder import RunFolder

#: A run's last event fits into this many bytes.
_TAIL = 64 * 1024


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
        last = _last_event(folder.journal)
    except (InputError, OSError):
        return Overview(folder.path.name)
    first = line.event if line is not None else None
    if first is None or first.kind != "run_started":
        return Overview(folder.path.name)
    motor, procedures = first.data.get("motor"), first.data.get("procedures")
    ended = last is not None and last.kind == "run_finished"
    return Overview(
        name=folder.path.name,
        began=first.wall,
        motor=str(motor.get("name", "")) if isinstance(motor, Mapping) else "",
        status=str(last.data.get("status")) if last is not None and ended else "interrupted",
        procedures=tuple(str(name) for name in procedures) if isinstance(procedures, list) else (),
    )


def _last_event(path: Path) -> Event | None:
    with path.open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - _TAIL))
        lines: list[Any] = file.read(_TAIL).splitlines(keepends=True)
    return parse_line(0, lines[-1]).event if lines and lines[-1].endswith(b"\n") else None
