"""What procedures show of their measurements while somebody watches."""

import math

import numpy as np
import pytest

from bench.motor.motor_file import load_motor
from bench.operators.stored_plot import restore_plot, store_plot
from procedures.core.axes import CurveStyle
from procedures.core.bench import Bench
from procedures.core.live_plot import LivePlot
from sim_instruments.bench import VirtualBench
from sim_instruments.clock.virtual_clock import VirtualClock
from tests.runs.flux_bench import flux_bench, map_of, motor_on
from tests.runs.on_bench import measure
from tests.runs.test_flux_map import PLATE as MADE_PLATE
from tests.sim_instruments.flux_maps import MADE
from tests.studies.worlds.measured_motor import NoRecord


class NoHands:
    def perform(self, action: object) -> object:
        raise AssertionError(f"{action} is not asked for")


class Watching:
    """Keeps what it is shown as it arrives over a run's line."""

    looks = True

    def __init__(self) -> None:
        self.plots: list[LivePlot] = []

    def show(self, plot: LivePlot) -> None:
        self.plots.append(restore_plot(store_plot(plot)))


def shown(name: str, *settings: str) -> list[LivePlot]:
    motor, watching = load_motor("ipmsm"), Watching()
    with VirtualBench(motor.virtual, seed=2, sockets=False) as bench:
        measure(bench, motor.nameplate, name, *settings, onlooker=watching)
    return watching.plots


def manners(plot: LivePlot) -> list[CurveStyle]:
    return [curve.manner for curve in plot.upper.curves]


def test_a_sweep_shows_its_goal_at_once_then_its_curve_then_what_the_fit_leaves() -> None:
    first, *later, last = shown("dq-inductance-extremes", "readings_per_period=12")
    assert first.coming is not None
    assert first.coming.until_x is not None
    assert manners(first) == []
    found = [plot for plot in later if manners(plot) == [CurveStyle.FIT]]
    assert found
    assert last.coming is None
    assert manners(last) == [CurveStyle.READING, CurveStyle.FIT]
    assert last.lower is not None
    readings, fit = last.upper.curves
    left = last.lower.curves[0].y
    assert np.allclose(readings.y - fit.y, left, atol=1e-3 * np.ptp(readings.y))


def test_each_step_shows_its_fit_before_the_next_is_taken() -> None:
    plots = shown("dq-inductance-time-constant", "repeats=1")
    assert len(plots) >= 6
    for plot in plots:
        assert plot.lower is not None
        recorded, fit = plot.upper.curves
        assert recorded.x.size < 420
        assert float(np.std(plot.lower.curves[0].y)) < 0.1 * float(np.ptp(fit.y))


def test_back_emf_shows_wave_and_harmonics_of_each_speed() -> None:
    plots = shown("back-emf-constant", "speed_shares=[0.5,1.0]")
    assert len(plots) == 2
    for plot in plots:
        assert manners(plot)[:3] == [CurveStyle.RECORD] * 3
        assert plot.lower is not None
        assert plot.lower.curves[0].manner is CurveStyle.BARS
        assert plot.lower.curves[0].x.tolist() == [3.0, 5.0, 7.0, 11.0]


def test_a_coast_shows_its_end_while_it_is_read_and_both_models_then() -> None:
    plots = shown("inertia", "tare=given", "sample_interval=0.02")
    coming = [plot for plot in plots if plot.coming is not None]
    assert [math.isfinite(plot.coming.until_y or math.nan) for plot in coming if plot.coming] == [True, True]
    both = plots[-1]
    assert manners(both) == [CurveStyle.RECORD, CurveStyle.SECOND, CurveStyle.FIT]
    assert both.lower is not None
    linear, quadratic = (float(np.std(curve.y)) for curve in both.lower.curves)
    assert quadratic <= linear


def extent(plot: LivePlot) -> float:
    """The area (A²) of the box round the lines of equal flux linkage; nothing without a line."""
    lines = [curve for curve in plot.upper.curves if curve.manner is CurveStyle.FIT]
    if not lines:
        return 0.0
    x, y = (np.concatenate([getattr(curve, axis) for curve in lines]) for axis in "xy")
    return float(np.ptp(x) * np.ptp(y))


@pytest.mark.slow
def test_a_flux_map_grows_over_the_plane_of_currents() -> None:
    watching = Watching()
    with flux_bench(motor_on(MADE.map(80.0), resistance=0.02, pole_pairs=4), MADE_PLATE, seed=3) as bench:
        found = map_of(bench, MADE_PLATE, "locations=20", onlooker=watching)
    planned = found.findings["readings"]
    assert len(watching.plots) == planned
    known = []
    for number, plot in enumerate(watching.plots, 1):
        by = {curve.manner: curve for curve in plot.upper.curves}
        assert by[CurveStyle.READING].x.size == number
        known.append(number + by[CurveStyle.TO_COME].x.size)
    # Those about the largest torque are chosen when the others have been read.
    assert known == sorted(known)
    once = planned - found.findings["read_again"]
    assert len(set(known[:once])) == 2
    assert (known[once - 1], known[-1]) == (once, planned)
    # Lines of equal flux linkage come as soon as the readings tell them, and reach as far as those do, by the levels that are drawn.
    assert extent(watching.plots[0]) == 0.0
    assert 0.0 < extent(watching.plots[planned // 4]) < 1.2 * extent(watching.plots[-1])
    # The first look is near to the map, and no larger than it: the polygon of the currents read lies within their circle.
    first_look = str(watching.plots[-1].said[-1])
    torque = float(first_look.rpartition(" to ")[2].removesuffix(" N·m"))
    assert 0.8 < torque / found.findings["mtpa"][-1]["torque"]["value"] < 1.02


def test_open_terminals_show_emf_and_drag_as_they_are_read() -> None:
    plots = shown("open-circuit", "speeds=5")
    first_pass = plots[-5:]
    assert [plot.upper.curves[0].x.size for plot in first_pass] == [1, 2, 3, 4, 5]
    assert all(plot.lower is not None and plot.lower.curves[0].x.size == n for n, plot in enumerate(first_pass, 1))


def test_nobody_is_shown_what_nobody_looks_at() -> None:
    def make() -> LivePlot:
        raise AssertionError("nobody looks")

    Bench({}, NoHands(), VirtualClock(), NoRecord()).show(make)
