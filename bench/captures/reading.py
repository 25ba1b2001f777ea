"""One door to all readers: the file's content decides which."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.captures.arrays import array_lines
from bench.captures.capture import Capture, CaptureError
from bench.captures.hantek import is_hantek, read_hantek
from bench.captures.hdf5 import read_hdf5
from bench.captures.interval import check_interval
from bench.captures.part import WHOLE, CapturePart
from bench.captures.plain import read_plain
from bench.captures.rigol import is_rigol, read_rigol
from bench.captures.rohde_schwarz import is_rohde_schwarz, read_rohde_schwarz
from bench.captures.siglent import is_siglent, read_siglent
from bench.captures.tektronix import is_tektronix, read_tektronix
from bench.captures.text import read_lines
from bench.captures.yokogawa import is_yokogawa, read_yokogawa
from drivers.interfaces.text import text

_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
#: Makers' formats: what tells them, and what reads them.
_SCOPES = (
    (is_rohde_schwarz, read_rohde_schwarz),
    (is_siglent, read_siglent),
    (is_rigol, read_rigol),
    (is_tektronix, read_tektronix),
    (is_yokogawa, read_yokogawa),
    (is_hantek, read_hantek),
)


def read_capture(path: Path | str, *, abscissa: str = "time", selection: CapturePart = WHOLE) -> Capture:
    """Return a stored capture: CSV of Rohde & Schwarz, Siglent, Rigol, Tektronix, Yokogawa or Hantek, a plain table, arrays
    in .mat, .npy or .npz, or motorbench HDF5 (`file.h5#name` for one record of several); text may be gzip'ed.

    `abscissa` ("time", "angle" or "current") says what the first column of a table without headings is, `selection` which part is wanted.
    Raises CaptureError with file and line.
    """
    return selection.cut(_read(path, abscissa, selection))


def _read(path: Path | str, abscissa: str, selection: CapturePart) -> Capture:
    where, _, selected = str(path).partition("#")
    file = Path(path) if os.path.exists(path) else Path(where)
    if not os.path.isfile(file):
        raise CaptureError(str(file), text("does not exist or is not a file; check the path"))
    with file.open("rb") as stream:
        if stream.read(8) == _HDF5_SIGNATURE:
            _refuse_column(file, selection)
            return read_hdf5(file, selected)
    lines = array_lines(file) or read_lines(file)
    for written_by, read in _SCOPES:
        if written_by(lines):
            _refuse_column(file, selection)
            capture = read(file, lines)
            break
    else:
        capture = read_plain(
            file, lines, abscissa=abscissa, time_column=selection.time_column, time_unit=selection.time_unit
        )
    check_interval(lines, capture)
    return capture


def _refuse_column(file: Path, selection: CapturePart) -> None:
    """Raise CaptureError where the format has its own column of time."""
    for option, given in (("--time-unit", selection.time_unit), ("--time-column", selection.time_column)):
        if given is not None:
            raise CaptureError(
                str(file),
                text(
                    "{option} {given}: this format states its time itself; the option is allowed for plain tables only",
                    option=option,
                    given=given,
                ),
            )


def read_captures(paths: Sequence[Path | str], *, selection: CapturePart = WHOLE) -> Capture:
    """Return several captures as one, channels side by side. Raises CaptureError where their times differ, naming files."""
    if not paths:
        raise CaptureError("capture", text("no file given"))
    if len({str(path) for path in paths}) < len(paths):
        raise CaptureError(
            ", ".join(str(path) for path in paths),
            text("the same file is given twice; give each file of the record once"),
        )
    captures = [read_capture(path, selection=selection) for path in paths]
    first = captures[0]
    if len(captures) == 1:
        return first
    time = first.times()
    tolerance = 0.25 * float(np.median(np.diff(time)))
    for other in captures[1:]:
        axis = other.times()
        if axis.size != time.size or float(np.max(np.abs(axis - time))) > tolerance:
            raise CaptureError(
                other.source,
                text(
                    "its time axis ({size} samples from {begin:g} s to {end:g} s) differs from that of {source} "
                    "({first_size} from {first_begin:g} s to {first_end:g} s); give files of the same record",
                    size=axis.size,
                    begin=axis[0],
                    end=axis[-1],
                    source=first.source,
                    first_size=time.size,
                    first_begin=time[0],
                    first_end=time[-1],
                ),
            )
    every = [channel.name for capture in captures for channel in capture.channels]
    channels = tuple(
        replace(channel, name=f"{Path(capture.source).stem}:{channel.name}")
        if every.count(channel.name) > 1
        else channel
        for capture in captures
        for channel in capture.channels
    )
    assumptions = tuple({str(note): note for capture in captures for note in capture.assumptions}.values())
    source = ", ".join(capture.source for capture in captures)
    description = ", ".join(dict.fromkeys(capture.description for capture in captures))
    unit_open = any(capture.time_unit_open for capture in captures)
    return Capture(channels, time, source, description, assumptions, first.first_line, unit_open)
