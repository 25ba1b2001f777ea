"""Currents and voltage components of a six-step drive over one state, drawn as in the document's figures 4 and 8."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.i18n.errors import InputError
from drivers.interfaces.text import reason_of, text

if TYPE_CHECKING:
    from sim_instruments.six_step.steady_state import SteadyState

_SAMPLES = 721
_BLUE, _ORANGE, _GREEN, _RED, _PURPLE, _GREY = "#1f77b4", "#e07b00", "#2a9d4b", "#c8283c", "#7a4fb5", "#555555"
Curves = dict[str, tuple[NDArray[np.float64], str, str]]


def draw(points: Sequence["SteadyState"], path: Path) -> None:
    """Write the figure of some steady states, beside each other, as the format of the name's ending.

    Raises InputError when the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(1.9 + 5.6 * len(points), 8.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(
        3, len(points), squeeze=False, sharex="col", sharey="row", gridspec_kw={"height_ratios": [1.25, 1.0, 1.0]}
    )
    for column, point in enumerate(points):
        panels = [row[column] for row in axes]
        # Just inside the state: its end already belongs to the next.
        times = np.linspace(0.0, point.state_time * (1 - 1e-12), _SAMPLES)
        panels[0].set_title(
            f"{point.speed * 30 / math.pi:.0f} rpm, {point.load_torque:.3g} N·m, state T1T2", fontsize=11
        )
        for panel, curves in zip(panels, (_currents(point, times), *_voltages(point, times)), strict=True):
            _draw_curves(panel, times, curves, point, legend=column == len(points) - 1)
        if 0.0 < point.freewheel_time < point.state_time:
            panels[0].annotate(
                "freewheel ends",
                (1e3 * point.freewheel_time, 0.03),
                xycoords=("data", "axes fraction"),
                xytext=(5, 0),
                textcoords="offset points",
                fontsize=8.5,
            )
        panels[-1].set_xlabel("time in the state / ms")
        panels[-1].set_xlim(0.0, 1e3 * point.state_time)
    for row, label in zip(axes, ("current / A", "voltage / V", "drops in the winding / V"), strict=True):
        row[0].set_ylabel(label)
    figure.align_ylabels()
    try:
        figure.savefig(path, dpi=140)
    except OSError as error:
        raise InputError(
            text("{path}: the plot cannot be written: {strerror}", path=path, strerror=reason_of(error))
        ) from None


def _currents(point: "SteadyState", times: NDArray[np.float64]) -> Curves:
    a, b, c = point.winding_currents(times)
    supply = point.supply_current(times)
    return {
        r"$i_a$": (a, _BLUE, "-"),
        # i_a lies under it once the freewheel is over.
        r"$i_b$": (b, _ORANGE, "--"),
        r"$-i_c$": (-c, _GREEN, "-"),
        r"$I_s$": (supply, _GREY, "-"),
    }


def _voltages(point: "SteadyState", times: NDArray[np.float64]) -> tuple[Curves, Curves]:
    drive = point.drive
    current, emf = point.winding_currents(times), point.emfs(times)
    inductive = point.winding_voltages(times) - emf - drive.resistance * current
    slope = np.linalg.solve(point.bridge.inductance, inductive)
    legs = point.leg_voltages(times)
    wye = drive.connection == "wye"
    # From leg 1 to leg 3: winding c backwards in a delta, phase a and c backwards in a wye.
    ways = np.array([1.0, 0.0, -1.0]) if wye else np.array([0.0, 0.0, -1.0])
    others = ways.sum() * np.ones(3) - ways
    way = "ac" if wye else "c"
    outside: Curves = {
        "bus": (point.bus_voltage(times), _PURPLE, ":"),
        f"terminals 1–3\n({way} branch)": (legs[0] - legs[2], _GREY, "-"),
        "EMF": (ways @ emf, _BLUE, "-"),
    }
    inside: Curves = {
        r"$L_{11}\,\mathrm{d}i/\mathrm{d}t$": (drive.self_inductance * (ways @ slope), _GREEN, "-"),
        r"$R_{11}\,i$": (drive.resistance * (ways @ current), _ORANGE, "-"),
        r"$L_{12}\,\mathrm{d}i/\mathrm{d}t$, both terms": (drive.mutual_inductance * (others @ slope), _RED, "-"),
    }
    return outside, inside


def _draw_curves(axes: Any, times: NDArray[np.float64], curves: Curves, point: "SteadyState", *, legend: bool) -> None:
    for label, (values, colour, style) in curves.items():
        axes.plot(1e3 * times, values, style, color=colour, label=label, linewidth=1.7)
    low, high = axes.get_ylim()
    if low < 0.0 < high:
        axes.axhline(0.0, color="black", linewidth=0.7, zorder=1)
    if 0.0 < point.freewheel_time < point.state_time:
        axes.axvline(1e3 * point.freewheel_time, color="black", linewidth=0.8, linestyle=(0, (2, 3)))
    axes.grid(True, color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    if legend:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=9.5)
