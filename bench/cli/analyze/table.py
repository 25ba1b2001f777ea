"""`motorbench analyze table`: figures that others published, beside a run's or a motor file's."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.cli.options import Json, Language, Runs
from bench.cli.output import print_json
from bench.i18n.errors import InputError, UsageError, at
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import Translate, text, word

if TYPE_CHECKING:
    from bench.analysis.data_sheet import DataSheet


def table(
    file: Path,
    *,
    run: str | None = None,
    motor: str | None = None,
    vesc_scale: float = 0.9,
    language: Language = "auto",
    json: Json = False,
    runs: Runs = Path("runs"),
) -> None:
    """Compare published figures with those of a run, or of a motor file.

    Parameters
    ----------
    file
        JSON with Ld over current as moteus writes it, a VESC's configuration as XML, CSV with a heading as `id (A),Ld (H)`, or a data sheet
        as rows of name, value and unit (it needs neither `--run` nor `--motor`).
    run
        The run's folder, or its name under `--runs`.
    motor
        Motor file, or the name of a shipped motor, instead of a run.
    vesc_scale
        Factor by which a VESC's inductances are divided. VESC's detection stores 0.9 of the measured value; give 1 if the file
        contains the measured inductances themselves.

    """
    from bench.analysis.data_sheet import read_data_sheet
    from bench.analysis.published import compare, read_published, text_of_table
    from procedures.core.parameters import PARAMETERS

    translate = translator(language_of(language))

    sheet = read_data_sheet(file, text_of_table(file)) if file.is_file() else None
    if sheet is not None and run is None and motor is None:
        _print_sheet(file, sheet, translate, json=json)
        return
    if run is None and motor is None and file.is_file():
        raise UsageError(
            text(
                "{path}: give --run RUN or --motor FILE, what it is to be compared with. It is no data sheet, which needs neither: fewer "
                "than two of its rows are a known name, a number and a unit, as 'Torque constant;25.9;mNm/A' is",
                path=str(file),
            )
        )
    if (run is None) == (motor is None):
        raise UsageError(text("give either --run RUN or --motor FILE, one of the two"))
    if not 0.1 <= vesc_scale <= 10.0:
        raise UsageError(text("--vesc-scale {scale:g}: a factor from 0.1 to 10 is allowed", scale=vesc_scale))
    published = read_published(file, vesc_scale=vesc_scale) if sheet is None else sheet.figures
    compared = compare(published, _of_run(run, runs) if run is not None else _of_motor(motor or ""))
    if not compared:
        raise InputError(
            at(
                str(file),
                text(
                    "it has figures of {names}, and {ours} has none of these: nothing can be compared",
                    names=[PARAMETERS[name].label for name in sorted({each.parameter for each in published})],
                    ours=run or motor or "",
                ),
            )
        )
    rows = [each.as_dict() for each in compared]
    readings = ["" if each.published.reading is None else each.published.reading.render(translate) for each in compared]
    if json:
        rows = [row | ({"reading": said} if said else {}) for row, said in zip(rows, readings, strict=True)]
        said_of = {} if sheet is None else _said(sheet, translate)
        print_json({"source": str(file), "figures": len(published), "compared": rows, **said_of})
        return
    from rich import box
    from rich.table import Table

    from bench.run.console import console_on

    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    heads = (
        text("Parameter"), text("at A"), text("published"), text("ours"), text("Unit"), text("off, %"), text("in 95 %")
    )  # fmt: skip
    for place, head in enumerate(heads):
        shown.add_column(head.render(translate), justify="left" if place in (0, 4) else "right", no_wrap=True)
    if any(readings):
        shown.add_column(text("if the sheet means").render(translate))
    for row, reading in zip(rows, readings, strict=True):
        shown.add_row(
            PARAMETERS[row["parameter"]].label.render(translate),
            "" if row["current"] is None else f"{row['current']:.3g}",
            f"{row['published']:.5g}",
            f"{row['ours']:.5g}",
            row["unit"],
            f"{row['deviation_percent']:+.2f}",
            {None: word("–"), True: text("yes"), False: text("no")}[row["within_interval"]].render(translate),
            *([reading] if any(readings) else []),
        )
    console = console_on(sys.stdout)
    console.print(shown)
    console.print(
        text(
            "Ours are at small currents (inductances) and at 25 °C (resistance, flux linkage); what is published has its own uncertainty"
        ).render(translate),
        markup=False,
        soft_wrap=True,
    )
    if sheet is not None:
        _print_said(sheet, translate)


def _said(sheet: "DataSheet", translate: Translate) -> dict[str, list[str]]:
    return {
        "checks": [check.render(translate) for check in sheet.checks],
        "unread": [row.render(translate) for row in sheet.unread],
    }


def _print_said(sheet: "DataSheet", translate: Translate) -> None:
    from bench.run.console import console_on

    console, said = console_on(sys.stdout), _said(sheet, translate)
    for head, lines in ((text("The sheet against itself"), said["checks"]), (text("Not read"), said["unread"])):
        if lines:
            console.print(head.render(translate), markup=False)
        for line in lines:
            console.print(f"  {line}", markup=False, soft_wrap=True)


def _print_sheet(file: Path, sheet: "DataSheet", translate: Translate, *, json: bool) -> None:
    """Print the figures of a data sheet by every reading that it leaves open, and how they agree."""
    from procedures.core.parameters import PARAMETERS

    rows: list[dict[str, Any]] = [
        {
            "parameter": each.parameter,
            "value": each.value,
            "unit": PARAMETERS[each.parameter].unit,
            "reading": "" if each.reading is None else each.reading.render(translate),
        }
        for each in sheet.figures
    ]
    if json:
        print_json({"source": str(file), "figures": rows, **_said(sheet, translate)})
        return
    from rich import box
    from rich.table import Table

    from bench.run.console import console_on

    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for head in (text("Parameter"), text("Value"), text("Unit"), text("if the sheet means")):
        shown.add_column(head.render(translate))
    for row in rows:
        shown.add_row(
            PARAMETERS[row["parameter"]].label.render(translate), f"{row['value']:.4g}", row["unit"], row["reading"]
        )
    console_on(sys.stdout).print(shown)
    _print_said(sheet, translate)


def _of_run(run: str, runs: Path) -> dict[str, tuple[float, tuple[float, float] | None]]:
    from bench.journal.finished_run import read_run

    found = read_run(run, runs).view.parameters().parameters
    return {name: (each.value, each.coverage_interval) for name, each in found.items()}


def _of_motor(motor: str) -> dict[str, tuple[float, tuple[float, float] | None]]:
    from bench.motor.motor_file import load_motor
    from bench.virtual.true_values import true_values
    from procedures.core.parameters import PARAMETERS

    read = load_motor(motor)
    values = dict(read.nameplate.expected)
    if read.virtual is not None:
        values |= true_values(PARAMETERS, read.virtual, read.six_step)
    return {name: (value, None) for name, value in values.items()}
