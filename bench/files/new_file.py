"""A file that must not be there yet."""

import os
from pathlib import Path

from bench.i18n.errors import InputError
from drivers.interfaces.text import reason_of, text


def write_new(path: Path, content: str) -> None:
    """Write a new file, its folder too. Raises InputError where it is there already or cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666), "w", encoding="utf-8") as file:
            file.write(content)
    except FileExistsError:
        raise InputError(text("{path}: already exists; choose another name, or remove it", path=path)) from None
    except OSError as error:
        raise InputError(text("{path}: cannot be written: {reason}", path=path, reason=reason_of(error))) from None
