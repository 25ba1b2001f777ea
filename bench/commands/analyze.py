"""`motorbench analyze`: stored captures, evaluated by the estimators that a run uses."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from bench.commands.output import console_on, print_json
from bench.errors import UsageError


def back_emf(
    *files: Path,
    connection: Literal["line", "phase"] = "line",
    pole_pairs: int | None = None,
    speed_rpm: float | None = None,
    speed_uncertainty_rpm: float | None = None,
    harmonics: Sequence[int] = (1, 3, 5, 7),
    scale: Sequence[str] = (),
    json: bool = False,
) -> None:
    """Fundamental, harmonics, drift and flux linkage of captured back-EMF voltages (§3.4).

    Parameters
    ----------
    files
        Captures of one record: R&S RTB or Tektronix TDS CSV, columns of time and volts, or HDF5.
    connection
        Where the probes were: between two lines, or phase to star point.
    pole_pairs
        Pole pairs, for the mechanical constants.
    speed_rpm
        Mechanical speed, rpm, to find the pole pairs by.
    speed_uncertainty_rpm
        Its standard uncertainty, rpm.
    harmonics
        Orders to fit.
    scale
        Factor for a channel, NAME=FACTOR, where a probe's setting was wrong.
    json
        Print one JSON object and nothing else.

    """
    from bench.analysis import analyze_back_emf

    made = analyze_back_emf(
        _some(files),
        connection=connection,
        pole_pairs=pole_pairs,
        scale=_factors(scale),
        speed_rpm=speed_rpm,
        speed_uncertainty_rpm=speed_uncertainty_rpm,
        harmonics=harmonics,
    )
    _print(made, json=json)


def step_response(
    *files: Path,
    connection: Literal["wye", "delta"] = "wye",
    reading: Literal["line", "series-parallel", "phase"] = "series-parallel",
    axis: Literal["d", "q"] | None = None,
    voltage: str | None = None,
    current: str | None = None,
    scale: Sequence[str] = (),
    json: bool = False,
) -> None:
    """Resistance and inductance from a recorded voltage step and its current (§3.3.1).

    Parameters
    ----------
    files
        The capture, or one file for each channel.
    connection
        How the windings are joined.
    reading
        How the step was applied: between two lines, A against B and C together, or phase to star point.
    axis
        Axis in which the rotor was locked.
    voltage
        Name of the voltage's channel, where its unit does not tell.
    current
        Name of the current's channel.
    scale
        Factor for a channel, NAME=FACTOR.
    json
        Print one JSON object and nothing else.

    """
    from bench.analysis import analyze_step_response

    made = analyze_step_response(
        list(_some(files)),
        connection=connection,
        reading=reading,
        axis=axis,
        voltage=voltage,
        current=current,
        scale=_factors(scale),
    )
    _print(made, json=json)


def coast_down(
    *files: Path,
    inertia: float | None = None,
    inertia_uncertainty: float = 0.0,
    torque: float | None = None,
    speed: str | None = None,
    speed_in_rpm: bool = False,
    json: bool = False,
) -> None:
    """Friction from a coast-down, and inertia where a driven ramp is there too (§3.5).

    Parameters
    ----------
    files
        Captures of time and speed, and torque where it was recorded.
    inertia
        Inertia, kg·m², where it is known.
    inertia_uncertainty
        Its standard uncertainty, kg·m².
    torque
        Torque of the driven ramp, N·m, where no column has it.
    speed
        Name of the speed's column.
    speed_in_rpm
        A speed without unit is in rpm.
    json
        Print one JSON object and nothing else.

    """
    from bench.analysis import analyze_coast_down

    made = analyze_coast_down(
        _some(files),
        inertia=inertia,
        inertia_uncertainty=inertia_uncertainty,
        torque=torque,
        speed=speed,
        speed_in_rpm=speed_in_rpm,
    )
    _print(made, json=json)


def rotor_sweep(
    file: Path,
    *,
    connection: Literal["wye", "delta"] = "wye",
    pole_pairs: int | None = None,
    electrical: bool = False,
    threshold: float = 0.10,
    scale: Sequence[str] = (),
    json: bool = False,
) -> None:
    """Ld and Lq from line-to-line inductance over the rotor's angle, or over time (§3.3.2).

    Parameters
    ----------
    file
        Columns of angle (or time) and inductance.
    connection
        How the windings are joined.
    pole_pairs
        Pole pairs; searched where not given.
    electrical
        The angle is electrical, not mechanical.
    threshold
        Difference of smallest and largest below which the note speaks of a surface-magnet machine.
    scale
        Factor for a channel, NAME=FACTOR.
    json
        Print one JSON object and nothing else.

    """
    from bench.analysis import analyze_rotor_sweep

    made = analyze_rotor_sweep(
        file,
        connection=connection,
        pole_pairs=pole_pairs,
        electrical=electrical,
        threshold=threshold,
        scale=_factors(scale),
    )
    _print(made, json=json)


def _some(files: Sequence[Path]) -> Sequence[Path]:
    if not files:
        raise UsageError("name at least one file")
    return files


def _factors(given: Sequence[str]) -> dict[str, float]:
    factors = {}
    for word in given:
        name, _, factor = word.rpartition("=")
        try:
            factors[name] = float(factor)
        except ValueError:
            name = ""
        if not name:
            raise UsageError(f"--scale {word}: give NAME=FACTOR, as in CHAN3=10")
    return factors


def _print(made: Mapping[str, Any], *, json: bool) -> None:
    if json:
        print_json(made)
        return
    from rich import box
    from rich.table import Table

    from reports.figures import decimals_for, figure, percent, scale_of
    from reports.names import parameter_name

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name, justify in (
        ("Parameter", "left"),
        ("Value", "right"),
        ("Unit", "left"),
        ("u", "right"),
        ("u, %", "right"),
    ):
        table.add_column(name, justify="right" if justify == "right" else "left", no_wrap=True)
    table.add_column("§", no_wrap=True)
    for name, entry in made["parameters"].items():
        scale = scale_of(entry["value"], entry["unit"])
        value, spread = entry["value"] / scale.factor, entry["standard_uncertainty"] / scale.factor
        decimals = decimals_for(spread, value)
        table.add_row(
            parameter_name(name).render(),
            figure(value, decimals),
            scale.unit,
            figure(spread, decimals),
            percent(abs(spread / value)) if value else "–",
            entry["section"],
        )
    console = console_on(sys.stdout)
    console.print(table)
    for title, lines in (
        ("Assumed", made["assumptions"]),
        ("Warnings", [f"{w['id']}: {w['text']}" if w["id"] else w["text"] for w in made["warnings"]]),
    ):
        if lines:
            console.print(title, style="bold")
            for line in lines:
                console.print(f"  {line}", markup=False)
