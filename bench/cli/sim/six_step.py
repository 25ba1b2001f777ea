"""`motorbench sim six-step`: steady states of a BLDC drive."""

import json as json_format
import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unicodedata import east_asian_width

from bench.cli.options import Json, Language
from bench.i18n.errors import UsageError, at
from bench.i18n.language import language_of, translator
from bench.i18n.simulated import simulation_error
from drivers.interfaces.text import Text, Translate, english, text

if TYPE_CHECKING:
    from sim_instruments.six_step.drive import SixStepDrive
    from sim_instruments.six_step.state import Bridge
    from sim_instruments.six_step.steady_state import SteadyState

_RPM = math.pi / 30
_MOST_PLOTTED = 4


def six_step(
    motor: str,
    *,
    speed: list[float] | None = None,
    load: list[float] | None = None,
    voltage: float | None = None,
    json: Json = False,
    plot: Path | None = None,
    language: Language = "auto",
) -> None:
    """Solve the periodic steady state of a six-step BLDC drive at given speeds or shaft loads.

    Parameters
    ----------
    motor
        Motor file with `[virtual.drive]`, or the name of a shipped motor.
    speed
        Mechanical speeds in rpm.
    load
        Shaft loads in N·m; negative where the shaft is driven.
    voltage
        No-load voltage of the source, V; it replaces the one in the motor file.
    plot
        Write currents and voltage components over one commutation state to this SVG or PNG file.

    """
    from bench.motor.six_step_file import load_drive
    from sim_instruments.six_step.state import Bridge

    translate = translator(language_of(language))
    if bool(speed) == bool(load):
        raise UsageError(text("give either --speed RPM… or --load NM…, one of the two"))
    _check_plot(plot, len(speed or load or []))
    drive = load_drive(motor)
    bridge = Bridge(drive if voltage is None else _at_voltage(drive, motor, voltage))
    points = [_point(bridge, motor, speed=value) for value in speed or []]
    points += [_point(bridge, motor, load=value) for value in load or []]
    if plot is not None:
        from bench.cli.sim.six_step_plot import draw

        draw(points, plot)
    for point in points:
        if point.average_supply_current < 0:
            rpm = point.speed / _RPM
            back = text("{rpm:.6g} rpm: the EMF drives current back into the source (generating)", rpm=rpm)
            print(back.render(translate), file=sys.stderr)
    if json:
        print(json_format.dumps({"points": [as_json(point) for point in points]}, allow_nan=False))
    else:
        print("\n\n".join(as_text(point, translate) for point in points))


def _at_voltage(drive: "SixStepDrive", motor: str, voltage: float) -> "SixStepDrive":
    from sim_instruments.six_step.drive import SixStepError

    try:
        return replace(drive, source_voltage=voltage)
    except SixStepError as error:
        raise UsageError(at(f"{motor}, --voltage {voltage:g}", simulation_error(error))) from None


def _check_plot(plot: Path | None, points: int) -> None:
    if plot is None:
        return
    if plot.suffix.lower() not in (".svg", ".png"):
        raise UsageError(text("--plot {plot}: a name ending in .svg or .png is allowed", plot=plot))
    if points > _MOST_PLOTTED:
        raise UsageError(
            text(
                "--plot shows up to {most_plotted} points beside each other, not {points}; give fewer",
                most_plotted=_MOST_PLOTTED,
                points=points,
            )
        )


def _point(bridge: "Bridge", motor: str, *, speed: float = 0.0, load: float | None = None) -> "SteadyState":
    from sim_instruments.six_step.drive import SixStepError
    from sim_instruments.six_step.load import balance_load
    from sim_instruments.six_step.steady_state import steady_state

    if load is None and not (math.isfinite(speed) and speed > 0):
        raise UsageError(
            text("--speed {speed:g}: a finite speed above 0 rpm is allowed; a drive at rest has no period", speed=speed)
        )
    try:
        return steady_state(bridge, speed * _RPM) if load is None else balance_load(bridge, load)
    except SixStepError as error:
        raise UsageError(at(motor, simulation_error(error))) from None


def as_json(point: "SteadyState") -> dict[str, Any]:
    """Return a point of the command's JSON, SI units, over the state T1T2; a, b, c are windings, or phases of a wye."""
    from sim_instruments.six_step import balance
    from sim_instruments.six_step.circuit import Observables

    supply, losses = balance.supply_voltages(point), balance.losses(point)
    components: dict[str, Any] = {
        f"{name}_branch": {
            "emf": branch.emf,
            "resistance": branch.resistance,
            "self_inductance": branch.self_inductance,
            "mutual_inductance": list(branch.mutual_inductance),
            "terminal": branch.terminal,
        }
        for name, branch in balance.branches(point).items()
    }
    components["supply"] = {
        "switches_at_supply_current": supply.switches_at_supply_current,
        "switches": supply.switches,
        "source_resistance": supply.source_resistance,
        "source": supply.source,
    }
    return {
        "speed_rpm": point.speed / _RPM,
        "load_torque": point.load_torque,
        "electromagnetic_torque": point.electromagnetic_torque,
        "supply_current": point.average_supply_current,
        "bus_voltage": point.average_bus_voltage,
        "source_voltage": point.drive.source_voltage,
        "winding_current_average": _abc(point.averages[Observables.currents]),
        "winding_current_rms": _abc(balance.winding_rms(point)),
        "winding_current_start": _abc(point.start_currents),
        "winding_current_end": _abc(point.end_currents),
        "freewheel_time": point.freewheel_time,
        "state_time": point.state_time,
        "voltage_components": components,
        "losses": {
            "copper": losses.copper,
            "switches": losses.switches,
            "diode": losses.diode,
            "source": losses.source,
            "friction": losses.friction,
        },
        "power_residual": balance.power_residual(point),
    }


def _abc(values: Any) -> dict[str, float]:
    return dict(zip("abc", map(float, values), strict=True))


def as_text(point: "SteadyState", translate: Translate = english) -> str:
    """Return a point as lines for a person, with the document's two tables."""
    from sim_instruments.six_step import balance
    from sim_instruments.six_step.circuit import Observables

    averages, drive = point.averages, point.drive
    branches = balance.branches(point)
    rows: list[tuple[Text, list[float]]] = [
        (text("EMF"), [b.emf for b in branches.values()]),
        (text("R_11 drop"), [b.resistance for b in branches.values()]),
        (text("L11 drop"), [b.self_inductance for b in branches.values()]),
        (text("L12 drop, first term"), [b.mutual_inductance[0] for b in branches.values()]),
        (text("L12 drop, second term"), [b.mutual_inductance[1] for b in branches.values()]),
        (text("terminal voltage"), [b.terminal for b in branches.values()]),
    ]
    currents: list[tuple[Text, Any]] = [
        (text("average"), averages[Observables.currents]),
        (Text("I_eff"), balance.winding_rms(point)),
        (text("at the start"), point.start_currents),
        (text("at the end"), point.end_currents),
    ]
    names = [text("{name} branch", name=name).render(translate) for name in branches]
    heading = text("averages over the state / V").render(translate)
    lines = [
        *(one.render(translate) for one in _heading(point)),
        f"  {_filled(heading, 27)}" + "".join(" " + _filled(name, 13, right=True) for name in names),
        *(_row(words.render(translate), values) for words, values in rows),
        *(one.render(translate) for one in _of_supply(point)),
        f"  {_filled(_currents_of(point).render(translate), 18)}" + "".join(f"{name:>14}" for name in "abc"),
        *(_row(words.render(translate), values, 16) for words, values in currents),
        _losses(point).render(translate),
    ]
    if drive.connection == "delta" and averages[2] != 0:
        effective, inductive = balance.equivalent_resistance(point, 2)
        message = text(
            "  winding c: R_11r {effective:.5f} Ω (loss), R_11L {inductive:.5f} Ω (exchange of stored energy)",
            effective=effective,
            inductive=inductive,
        )
        lines.append(message.render(translate))
    return "\n".join(lines)


def _heading(point: "SteadyState") -> Iterator[Text]:
    yield text(
        "{rpm:.2f} rpm, {kind}: load {load:.5g} N·m, electromagnetic torque {torque:.5g} N·m",
        rpm=point.speed / _RPM,
        kind=text("generating") if point.average_supply_current < 0 else text("motoring"),
        load=point.load_torque,
        torque=point.electromagnetic_torque,
    )
    state = 1e3 * point.state_time
    if point.freewheel_time >= point.state_time:
        yield text("  state T1T2 of {state:.4f} ms, the freewheel does not end", state=state)
        return
    yield text(
        "  state T1T2 of {state:.4f} ms, freewheel {freewheel:.4f} ms ({share:.1f} %)",
        state=state,
        freewheel=1e3 * point.freewheel_time,
        share=100 * point.freewheel_time / point.state_time,
    )


def _of_supply(point: "SteadyState") -> Iterator[Text]:
    from sim_instruments.six_step import balance

    supply = balance.supply_voltages(point)
    yield text("  supply")
    yield text(
        "    I_s {current:.5f} A   I_s·2R_t {drop:.6f} V (both switches in truth {switches:.6f} V)",
        current=point.average_supply_current,
        drop=supply.switches_at_supply_current,
        switches=supply.switches,
    )
    yield text(
        "    I_s·R_source {drop:.6f} V   V_so {source:g} V   bus {bus:.5f} V",
        drop=supply.source_resistance,
        source=point.drive.source_voltage,
        bus=point.average_bus_voltage,
    )


def _currents_of(point: "SteadyState") -> Text:
    return text("winding currents / A") if point.drive.connection == "delta" else text("phase currents / A")


def _losses(point: "SteadyState") -> Text:
    from sim_instruments.six_step import balance

    losses = balance.losses(point)
    return text(
        "  losses / W: copper {copper:.4f}, switches {switches:.4f}, diode {diode:.4f}, source {source:.4f}, "
        "friction {friction:.4f}; power balance's residual {residual:.1e}",
        copper=losses.copper,
        switches=losses.switches,
        diode=losses.diode,
        source=losses.source,
        friction=losses.friction,
        residual=balance.power_residual(point),
    )


def _row(words: str, values: Any, width: int = 26) -> str:
    return f"    {_filled(words, width)}" + "".join(f"{float(value):14.5f}" for value in values)


def _filled(words: str, width: int, *, right: bool = False) -> str:
    """Return words filled up to a width on the screen, where a Chinese character takes two columns."""
    space = " " * max(0, width - sum(2 if east_asian_width(one) in "WF" else 1 for one in words))
    return space + words if right else words + space
