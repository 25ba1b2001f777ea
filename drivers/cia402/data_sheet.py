"""A drive's electronic data sheet (EDS, or a DCF; CiA 306): which objects it has."""

import configparser
import re
from collections.abc import Iterable
from pathlib import Path

from drivers.interfaces.text import text

_OBJECT = re.compile(r"[0-9A-Fa-f]{4}")


def check_data_sheet(file: str, wanted: Iterable[int]) -> None:
    """Raise ValueError, beginning with the key `eds`, for a file that is none, or for a drive without an object that is needed."""
    parser = configparser.RawConfigParser(strict=False, inline_comment_prefixes=(";",), allow_no_value=True)
    try:
        parser.read_string(Path(file).read_text("latin-1"))
    except OSError as error:
        raise ValueError(text("eds = {file!r} cannot be read ({error})", file=file, error=error.strerror)) from error
    except (configparser.Error, ValueError) as error:
        raise ValueError(
            text("eds = {file!r} is no electronic data sheet ({error})", file=file, error=error)
        ) from error
    objects = {int(section, 16) for section in parser.sections() if _OBJECT.fullmatch(section)}
    if not objects:
        raise ValueError(
            text("eds = {file!r} is no electronic data sheet ({error})", file=file, error="no section of an object")
        )
    missing = sorted(set(wanted) - objects)
    if missing:
        names = ", ".join(f"0x{index:04X}" for index in missing)
        raise ValueError(
            text(
                "eds = {file!r}: the drive has no {missing}, without which this driver cannot use it; see what the manual offers "
                "in their place, or take another drive",
                file=file,
                missing=names,
            )
        )
