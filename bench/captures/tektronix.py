"""CSV of Tektronix TDS scopes: settings in the first columns of the first rows, time and value in columns 4 and 5."""

from pathlib import Path

from bench.captures.capture import Capture, CaptureChannel, CaptureError
from bench.captures.text import check_increasing, number, read_numbers
from bench.captures.units import si
from drivers.interfaces.text import text

#: The screen's height, of which full scale is meant.
_DIVISIONS = 8


def is_tektronix(lines: list[str]) -> bool:
    """Tell whether the first row begins with the maker's first setting; some files have a stray character before it."""
    cell = lines[0].split(",")[0].strip().strip('"')
    return cell == "Record Length" or cell[1:] == "Record Length"


def read_tektronix(path: Path, lines: list[str]) -> Capture:
    """Return the capture, checked against the record length it states. Raises CaptureError."""
    settings: dict[str, str] = {}
    for line in lines[:40]:
        cells = [cell.strip() for cell in line.split(",")]
        if len(cells) > 1 and cells[0]:
            name = "Record Length" if cells[0].endswith("Record Length") else cells[0]
            settings[name] = cells[1]
    table = read_numbers(path, lines, 0, (3, 4), ",")
    check_increasing(path, table[:, 0], 0)
    stated = number(settings.get("Record Length", ""))
    if stated is not None and int(stated) != len(lines):
        raise CaptureError(
            str(path),
            text(
                "holds {count} samples where its heading states {stated}; copy the file again",
                count=len(lines),
                stated=int(stated),
            ),
            len(lines),
        )
    unit = settings.get("Vertical Units", "")
    known, factor = si(unit) or (unit, 1.0)
    values = table[:, 1] * factor
    probe = settings.get("Probe Atten", "?")
    factor_set = number(probe)
    probe = probe if factor_set is None else f"{factor_set:g}"
    assumptions = [text("values taken as they stand, with the scope's probe setting ×{probe}", probe=probe)]
    if not unit:
        assumptions.append(text("unit of the values not stated"))
    model = settings.get("Model Number", "")
    # Some models write it, as "Coupling,DC" or "Vertical Coupling,AC".
    said = next((value for name, value in settings.items() if name.lower().endswith("coupling")), "").lower()
    coupling = next((each for each in ("ac", "dc") if said.startswith(each)), "")
    scale = number(settings.get("Vertical Scale", "")) or 0.0
    full_scale = _DIVISIONS * scale * factor if scale > 0.0 else 0.0
    name = settings.get("Source", path.stem)
    return Capture(
        (CaptureChannel.written(name, known, values, None, coupling, full_scale),),
        table[:, 0],
        str(path),
        f"Tektronix CSV{f' of a {model}' if model else ''}",
        tuple(assumptions),
        first_line=1,
    )
