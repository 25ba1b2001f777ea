"""Figures of a motor that others measured: tables of Ld over current, a VESC's configuration; and how far they lie from ours."""

import csv
import io
import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.captures.decimal_marks import doubtful_number
from bench.captures.encoding import decoded
from bench.captures.signs import plain_signs, without_blanks
from bench.captures.units import si, split_heading
from bench.i18n.errors import InputError, at
from drivers.interfaces.text import Text, reason_of, text
from procedures.core.parameters import PARAMETERS

#: VESC's detection stores so much of the inductance that it measured (`mcpwm_foc.c`, `ind_scale_factor`).
VESC_SCALE = 0.9
_LARGEST = 10_000_000
_XML_FIELD = re.compile(r"<(foc_motor_\w+|si_motor_poles)>\s*([^<>\s]+)\s*</\1>")
_COLUMNS = {"ld": "d_axis_inductance", "lq": "q_axis_inductance", "r": "stator_resistance", "rs": "stator_resistance"}
_CURRENTS = ("id", "iq", "i", "current", "d_a", "q_a")


@dataclass(frozen=True)
class PublishedFigure:
    """One figure (SI) of a parameter, at a current (A) where the table says one; `reading` is the convention by which it is that figure."""

    parameter: str
    value: float
    current: float | None = None
    reading: Text | None = None


@dataclass(frozen=True)
class Comparison:
    """A published figure beside ours: its deviation (relative), and whether it lies in our 95 % interval, None without one."""

    published: PublishedFigure
    ours: float
    deviation: float
    within: bool | None

    def as_dict(self) -> dict[str, Any]:
        """Return it as `--json` prints it."""
        row = self.published
        return {
            "parameter": row.parameter,
            "current": row.current,
            "published": row.value,
            "unit": PARAMETERS[row.parameter].unit,
            "ours": self.ours,
            "deviation_percent": 100.0 * self.deviation,
            "within_interval": self.within,
        }


def text_of_table(path: Path) -> str:
    """Return a file's text. Raises InputError where it is none, or cannot be read."""
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(at(str(path), text("the file is larger than 10 MB; give a table of figures")))
        content = decoded(path.read_bytes())
    except OSError as error:
        raise InputError(at(str(path), text("cannot be read: {why}", why=reason_of(error)))) from None
    if content is None:
        raise InputError(at(str(path), text("is no text in UTF-8")))
    return content


def read_published(path: Path, *, vesc_scale: float = VESC_SCALE) -> list[PublishedFigure]:
    """Return what a file holds: JSON with `ld` (moteus), a VESC's XML, or CSV with columns as `id (A)` and `Ld (H)`.

    Inductances of a VESC's file are divided by `vesc_scale`. Raises InputError naming the file, what is wrong and what is allowed.
    """
    content = text_of_table(path)
    start = content.lstrip()[:1]
    if start == "{":
        result = list(_of_json(path, content))
    elif start == "<":
        result = list(_of_vesc(path, content, vesc_scale))
    else:
        result = list(_of_csv(path, content))
    if not result:
        raise _nothing(path)
    for figure in result:
        if not math.isfinite(figure.value) or not (figure.current is None or math.isfinite(figure.current)):
            raise InputError(at(str(path), text("{name} contains a value that is not a number", name=figure.parameter)))
    return result


def compare(
    published: list[PublishedFigure], ours: Mapping[str, tuple[float, tuple[float, float] | None]]
) -> list[Comparison]:
    """Return each published figure beside ours, by parameter: value and 95 % interval, None for a value without one."""
    result = []
    for figure in published:
        if figure.parameter not in ours or not ours[figure.parameter][0]:
            continue
        value, interval = ours[figure.parameter]
        within = None if interval is None else interval[0] <= figure.value <= interval[1]
        result.append(Comparison(figure, value, figure.value / value - 1.0, within))
    return result


def _of_json(path: Path, content: str) -> Iterator[PublishedFigure]:
    try:
        made = json.loads(content)
        for row in made["ld"]:
            yield PublishedFigure("d_axis_inductance", float(row["L_d_H"]), float(row["d_A"]))
        flux = made.get("fit", {}).get("lambda_m")
        if flux is not None:
            yield PublishedFigure("flux_linkage", float(flux))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise _nothing(path) from None


def _of_vesc(path: Path, content: str, scale: float) -> Iterator[PublishedFigure]:
    fields = {}
    for name, value in _XML_FIELD.findall(content):
        try:
            fields[name] = float(value)
        except ValueError:
            raise InputError(at(str(path), text("{name} contains a value that is not a number", name=name))) from None
    mean, half = fields.get("foc_motor_l"), 0.5 * fields.get("foc_motor_ld_lq_diff", 0.0)
    if mean is not None:
        yield PublishedFigure("d_axis_inductance", (mean - half) / scale)
        yield PublishedFigure("q_axis_inductance", (mean + half) / scale)
    for field, parameter, factor in (
        ("foc_motor_r", "stator_resistance", 1.0),
        ("foc_motor_flux_linkage", "flux_linkage", 1.0),
        ("si_motor_poles", "pole_pairs", 0.5),
    ):
        if field in fields:
            yield PublishedFigure(parameter, factor * fields[field])


def _of_csv(path: Path, content: str) -> Iterator[PublishedFigure]:
    content = plain_signs(content)
    mark = next((each for each in ("\t", ";") if each in content.lstrip().split("\n", 1)[0]), ",")
    rows = [row for row in csv.reader(io.StringIO(content), delimiter=mark) if row and not row[0].startswith("#")]
    if len(rows) < 2:
        raise _nothing(path)
    doubtful = doubtful_number((cell for row in rows[1:] for cell in row), comma_between=mark == ",")
    if doubtful is not None:
        raise InputError(at(str(path), doubtful[1]))
    columns: dict[int, tuple[str, float]] = {}
    at_current: tuple[int, float] | None = None
    for number, heading in enumerate(rows[0]):
        name, unit = split_heading(heading)
        if name.lower() in _CURRENTS and at_current is None:
            at_current = number, _factor(path, heading, unit, "A")
        elif name.lower() in _COLUMNS:
            parameter = _COLUMNS[name.lower()]
            columns[number] = parameter, _factor(path, heading, unit, PARAMETERS[parameter].unit)
    for line, row in enumerate(rows[1:], 2):
        try:
            current = None if at_current is None else _figure(row[at_current[0]], mark) * at_current[1]
            for number, (parameter, factor) in columns.items():
                yield PublishedFigure(parameter, _figure(row[number], mark) * factor, current)
        except (ValueError, IndexError):
            raise InputError(
                at(str(path), text("line {line}: every column of the heading needs a number", line=line))
            ) from None


def _figure(cell: str, mark: str) -> float:
    """Return a cell as a number, a comma in it being a decimal one where commas do not separate the columns. Raises ValueError."""
    bare = without_blanks(cell)
    return float(bare if mark == "," else bare.replace(",", "."))


def _factor(path: Path, heading: str, unit: str, wanted: str) -> float:
    """Return what a column's figures are multiplied by to be in SI. Raises InputError where its unit is not one of `wanted`."""
    known = si(unit) if unit else None
    if known is None or known[0] != wanted:
        raise InputError(
            at(
                str(path),
                text(
                    "line 1: column '{name}' has no unit of {unit} in its heading; write it in brackets, as in ({unit}) or (µ{unit})",
                    name=heading.strip(),
                    unit=wanted,
                ),
            )
        )
    return known[1]


def _nothing(path: Path) -> InputError:
    message: Text = text(
        "the file contains no figures in a known form. Known are JSON with ld = [{{d_A, L_d_H}}] as moteus "
        "writes it, a VESC's XML, CSV with a heading as id (A),Ld (H), and a data sheet's rows as Torque constant;25,9;mNm/A, two at least"
    )
    return InputError(at(str(path), message))
