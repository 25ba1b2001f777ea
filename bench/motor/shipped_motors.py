"""The place of a motor's file: one that comes with the program, or a path."""

import os
from importlib import resources
from pathlib import Path
from typing import Any

from bench.files.toml_file import nearest, parse, read
from bench.i18n.errors import FileError
from drivers.interfaces.text import text


def shipped_motors() -> tuple[str, ...]:
    """Return the names of the motors that come with the program."""
    folder = resources.files("bench") / "motors"
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")))


def motor_content(reference: str) -> tuple[str, bytes, dict[str, Any]]:
    """Return a motor file's name for messages, its bytes, and what they hold; `reference` is a path or a shipped name.

    Raises FileError for a file that cannot be read.
    """
    if reference in shipped_motors():
        content = (resources.files("bench") / "motors" / f"{reference}.toml").read_bytes()
        return reference, content, parse(content, reference)
    path = Path(reference)
    if not path.suffix and path.name == reference and not os.path.exists(path):
        raise FileError(
            text(
                "{reference!r} is neither a shipped motor nor an existing file: {hint}",
                reference=reference,
                hint=nearest(reference, shipped_motors()),
            )
        )
    content, data = read(path, text("motor file"))
    return str(path), content, data


def folder_of(reference: str) -> Path:
    """Return the folder in which a motor's file stands, by its path or shipped name."""
    if reference in shipped_motors():
        return Path(str(resources.files("bench") / "motors"))
    return Path(reference).parent
