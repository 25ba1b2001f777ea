"""Motor files made at the panel."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tomli_w import dumps as toml_text

from bench.files.toml_file import validate
from bench.i18n.errors import InputError
from bench.journal.disk import write_file
from bench.motor.motor_sections import NameplateSection
from drivers.interfaces.text import text


def save_motor(folder: Path, nameplate: Mapping[str, Any]) -> Path:
    """Write a motor file of this nameplate and return its path.

    Raises InputError where the nameplate is not right, a motor of this name is there already, or it cannot be written.
    """
    validate(NameplateSection, dict(nameplate), "nameplate")
    name = re.sub(r"[^\w.-]+", "-", str(nameplate["name"])).strip("-.").lower() or "motor"
    path = folder / f"{name}.toml"
    if path.exists():
        raise InputError(
            text("{path}: there is a motor of this name already; choose another name, or edit the file", path=path)
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_file(path, toml_text({"nameplate": dict(nameplate)}).encode())
    except OSError as error:
        raise InputError(text("{path}: the motor file was not written: {error}", path=path, error=error)) from error
    return path
