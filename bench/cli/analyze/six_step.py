"""`motorbench analyze six-step`: speed and current of a measured six-step drive at another load and voltage."""

import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.cli.options import Json, Language, Runs
from bench.cli.output import print_json
from bench.i18n.errors import UsageError, at
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import Text, Translate, text, word

if TYPE_CHECKING:
    from bench.analysis.six_step_prediction import Friction, Prediction
    from procedures.core.result import Parameter

_RPM = math.pi / 30.0
#: V, N·m or N·m·s/rad, V: beyond these a number was meant in another unit.
_LARGEST_VOLTAGE, _LARGEST_TORQUE, _LARGEST_DIODE_DROP = 1e4, 1e6, 5.0


def six_step(
    run: str,
    *,
    voltage: Sequence[float] = (),
    load: Sequence[float],
    motor: str | None = None,
    coulomb_friction: float | None = None,
    viscous_friction: float | None = None,
    diode_drop: float = 0.7,
    language: Language = "auto",
    json: Json = False,
    runs: Runs = Path("runs"),
) -> None:
    """Predict speed and current at other loads and voltages, from a run of equivalent-resistance.

    Parameters
    ----------
    run
        The run's folder, or its name under `--runs`.
    voltage
        No-load voltages of the source, V. Default: that of the run.
    load
        Loads, N·m. They are loads at the motor's shaft if its own friction is known, otherwise loads that the run's dynamometer
        shows.
    motor
        Motor file with `[virtual.drive]`, or the name of a shipped motor. Its exact steady state is shown for comparison.
    coulomb_friction
        The motor's Coulomb friction, N·m. Default: the result of the run's inertia procedure.
    viscous_friction
        The motor's viscous friction, N·m·s/rad; likewise.
    diode_drop
        Forward voltage of a freewheeling diode, V. No reading shows it.

    """
    from bench.analysis.six_step_prediction import MeasuredDrive, exact, findings_of, predictions
    from bench.journal.finished_run import read_run
    from bench.motor.six_step_file import load_drive
    from procedures.core.misfit_text import told_again

    translate = translator(language_of(language))
    if not load:
        raise UsageError(text("give the shaft loads: --load NM…"))
    _check("--voltage", voltage, _LARGEST_VOLTAGE, zero=False)
    _check("--load", load, _LARGEST_TORQUE)
    _check("--coulomb-friction", [coulomb_friction or 0.0], _LARGEST_TORQUE)
    _check("--viscous-friction", [viscous_friction or 0.0], _LARGEST_TORQUE)
    _check("--diode-drop", [diode_drop], _LARGEST_DIODE_DROP)
    read = read_run(run, runs)
    friction = _friction(read.view.parameters().parameters, coulomb_friction, viscous_friction)
    findings = findings_of(read.view.finished, run)
    measured = MeasuredDrive(findings, read.nameplate.connection.value, diode_drop, friction)
    found = predictions(measured, list(voltage) or [measured.source_voltage], load)
    truth = None if motor is None else load_drive(motor)
    rows = [_row(each, None if truth is None else exact(truth, each.voltage, each.load)) for each in found]
    made = {
        "run": read.name,
        "source": {"voltage": measured.source_voltage, "resistance": measured.source_resistance},
        "lost_torque": measured.lost_torque,
        "friction": None if friction is None else {"coulomb": friction.coulomb, "viscous": friction.viscous},
        "diode_drop": diode_drop,
        "points": rows,
        "misfit": [told_again(row, translate) for row in findings.get("misfit", ())],
    }
    if json:
        print_json(made)
    else:
        _print(made, rows, translate)


def _check(option: str, values: Sequence[float], most: float, *, zero: bool = True) -> None:
    for value in values:
        if not (value >= 0.0 if zero else value > 0.0) or value > most:
            range_ = (
                text("allowed is a number from 0 to {most:g}", most=most)
                if zero
                else text("allowed is a number above 0 and up to {most:g}", most=most)
            )
            raise UsageError(at(f"{option} {value:g}", range_))


def _friction(known: Mapping[str, "Parameter"], coulomb: float | None, viscous: float | None) -> "Friction | None":
    """Return the motor's own friction: as stated, else as the run measured it, None where nothing is known of it."""
    from bench.analysis.six_step_prediction import Friction

    if coulomb is not None or viscous is not None:
        return Friction(coulomb or 0.0, viscous or 0.0)
    if not {"coulomb_friction", "viscous_friction"} <= set(known):
        return None
    c, v = known["coulomb_friction"], known["viscous_friction"]
    return Friction(max(c.value, 0.0), max(v.value, 0.0), c.standard_uncertainty, v.standard_uncertainty)


def _row(each: "Prediction", truth: tuple[float, float] | None) -> dict[str, Any]:
    rpm = {key: value / _RPM for key, value in each.speed.as_dict().items()}
    row: dict[str, Any] = {
        "voltage": each.voltage,
        "load_torque": each.load,
        "in_sample": each.measured,
        "speed_rpm": rpm,
        "supply_current": each.current.as_dict(),
        "by_line": {"speed_rpm": each.line_speed / _RPM, "supply_current": each.line_current},
    }
    if truth is not None:
        speed, current = truth
        row["exact"] = {"speed_rpm": speed / _RPM, "supply_current": current}
        row["deviation_percent"] = {
            "speed": 100.0 * (each.speed.value / speed - 1.0),
            "supply_current": 100.0 * (each.current.value / current - 1.0),
            "speed_by_line": 100.0 * (each.line_speed / speed - 1.0),
            "supply_current_by_line": 100.0 * (each.line_current / current - 1.0),
        }
    return row


def _print(made: dict[str, Any], rows: Sequence[dict[str, Any]], translate: Translate) -> None:
    from rich import box
    from rich.table import Table

    from bench.run.console import console_on

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    compared = "exact" in rows[0]
    heads: list[Text | str] = ["V", "N·m", text("run"), "rpm", "U", "A", "U", text("line rpm"), "A"]
    if compared:
        heads += [text("off: rpm %"), "A %", text("line rpm %"), "A %"]
    for head in heads:
        table.add_column(word(head).render(translate), justify="right", no_wrap=True)
    for row in rows:
        speed, current, line = row["speed_rpm"], row["supply_current"], row["by_line"]
        cells = [
            f"{row['voltage']:.4g}",
            f"{row['load_torque']:.4g}",
            text("in").render(translate) if row["in_sample"] else "",
            f"{speed['value']:.1f}",
            f"{speed['U']:.1f}",
            f"{current['value']:.3f}",
            f"{current['U']:.3f}",
            f"{line['speed_rpm']:.1f}",
            f"{line['supply_current']:.3f}",
        ]
        if compared:
            cells += [f"{value:+.2f}" for value in row["deviation_percent"].values()]
        table.add_row(*cells)
    console = console_on(sys.stdout)
    console.print(table)
    source, friction = made["source"], made["friction"]
    sentences = [
        text(
            "Source: {voltage:.4g} V behind {resistance:.3g} Ω, by the run's readings; diodes {diode:g} V, as stated",
            voltage=source["voltage"],
            resistance=source["resistance"],
            diode=made["diode_drop"],
        ),
        text(
            "Loads are those that the run's dynamometer shows: {lost:.3g} N·m are lost before it, the same at "
            "every speed",
            lost=made["lost_torque"],
        )
        if friction is None
        else text(
            "Loads are those at the motor's shaft: its own friction is {coulomb:.3g} N·m and {viscous:.3g} N·m·s/rad",
            coulomb=friction["coulomb"],
            viscous=friction["viscous"],
        ),
        text("in: the run measured there; line: by the straight line R_c(ω) alone"),
    ]
    for sentence in (*(each.render(translate) for each in sentences), *(row["message"] for row in made["misfit"])):
        console.print(sentence, markup=False, soft_wrap=True)
