"""Files that a command writes: whole or not at all, and never over another content unasked."""

import os
from pathlib import Path

from bench.i18n.errors import InputError, UsageError
from drivers.interfaces.text import reason_of, text


def refuse_existing(file: Path, *, force: bool) -> None:
    """Raise UsageError where a file is there already and may not be overwritten, or its folder is not."""
    if not file.parent.is_dir():
        raise UsageError(text("{file}: there is no folder {folder}", file=str(file), folder=str(file.parent)))
    if file.exists() and not force:
        raise _existing(file)


def write_new(file: Path, content: str | bytes, *, force: bool) -> None:
    """Write a file whole or not at all; one that is there with the same content stays.

    Raises UsageError where it is there with another and may not be overwritten, InputError where it cannot be written.
    """
    if file.is_dir():
        raise UsageError(text("{file} is a folder; give the name of a file", file=str(file)))
    data = content.encode() if isinstance(content, str) else content
    part = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        if file.exists():
            if file.is_file() and file.read_bytes() == data:
                return
            if not force:
                raise _existing(file)
        with part.open("wb") as draft:
            draft.write(data)
            draft.flush()
            os.fsync(draft.fileno())
        part.replace(file)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise InputError(
            text("{path}: the file cannot be written: {strerror}", path=file, strerror=reason_of(error))
        ) from None


def _existing(file: Path) -> UsageError:
    return UsageError(text("{file} already exists; choose another file, or overwrite it with --force", file=str(file)))
