"""What a page makes of the plots and set points that a run announces."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.operators.stored_plot import restore_plot, store_plot
from bench.panel.gauge import Place, gauge_of, shown_gauge
from bench.panel.live.live_plot import options_of, to_go, with_readings
from bench.panel.live.live_view import LiveView
from bench.panel.live.run_line import RunLine
from drivers.interfaces.text import text
from procedures.core.axes import Axes, CurveStyle, PlotCurve
from procedures.core.live_plot import ComingReadings, Gauge, LivePlot
from tests.journals import recorded

RPM = math.pi / 30.0
SWEEP = LivePlot(
    text("Inductance over the rotor's angle"),
    Axes(text("Rotor angle, if turned evenly"), "°", text("Line inductance"), "H", (), x_from_zero=True),
    coming=ComingReadings("lcr_meter", "inductance", since=10.0, rate=6.0, until_x=90.0),
)


def reading(view: LiveView, time: float, inductance: float) -> None:
    value = {"time": time, "inductance": inductance}
    view.take(recorded("reading", instrument="lcr_meter", call="measure", arguments=["inductance"], value=value))


def test_readings_since_the_announcement_are_points_at_the_angle_of_an_even_hand() -> None:
    view = LiveView()
    for time, inductance in ((9.0, 5e-3), (10.0, 1.0e-3), (12.5, 1.5e-3)):
        reading(view, time, inductance)
    whole = with_readings(SWEEP, view.readings)
    options = options_of(whole, str)
    assert options["series"][0]["data"] == [[0.0, 1.0], [15.0, 1.5]]
    assert options["yAxis"][0]["name"] == "Line inductance / mH"
    assert options["series"][0]["markLine"]["data"] == [{"xAxis": 90.0}]
    assert options["xAxis"][0]["max"] > 90.0
    assert str(to_go(whole)) == "Now at 15°: turn on to 90°"


def test_before_the_first_reading_the_goal_stands_there() -> None:
    whole = with_readings(SWEEP, {})
    assert options_of(whole, str)["series"][0]["data"] == []
    assert str(to_go(whole)) == "Now at 0°: turn on to 90°"


def test_a_fit_stands_over_what_it_leaves_told_apart_by_more_than_colour() -> None:
    x = np.linspace(0.0, 4e-3, 50)
    curves = [PlotCurve(text("without ω²"), x, x, CurveStyle.SECOND), PlotCurve(text("with ω²"), x, x, CurveStyle.FIT)]
    upper, lower = (Axes(text("Time"), "s", text(name), "A", curves) for name in ("Current", "residual"))
    options = options_of(LivePlot(text("Coast-down"), upper, lower), str)
    assert [axis["name"] for axis in options["xAxis"]] == ["", "Time / ms"]
    assert len({series["lineStyle"]["type"] for series in options["series"]}) == 2
    assert [entry["name"] for entry in options["legend"]["data"]] == ["without ω²", "with ω²"]


@given(st.integers(1, 5000), st.integers(0, 4999))
def test_a_record_goes_over_the_line_reduced_with_its_peak(count: int, place: int) -> None:
    y = np.zeros(count)
    y[place % count] = 7.5
    curve = PlotCurve(text("recorded"), np.arange(count, dtype=float), y, CurveStyle.RECORD)
    plot = LivePlot(text("Current"), Axes(text("Time"), "s", text("Current"), "A", (curve,)))
    back = restore_plot(store_plot(plot))
    assert back.upper.curves[0].y.max() == 7.5
    assert back.upper.curves[0].x.size < 420
    assert back.title == plot.title


def test_a_question_takes_the_place_of_the_plot_and_one_of_another_version_is_none(tmp_path) -> None:
    line = RunLine(tmp_path)
    assert line.take({"plot": store_plot(SWEEP)})
    assert line.plot_is_newest
    line.take({"question": {"id": 1, "kind": "action"}})
    line.take({"question": None})
    assert not line.plot_is_newest
    assert line.plot is not None
    assert line.take({"plot": {"title": 3}})
    assert line.plot is None


DRIVING = {"instrument": "dynamometer", "call": "driving_speed", "arguments": [3000.0 * RPM]}
SET = {"kind": "confirm", "instrument": "dynamometer"}
READ = {"kind": "number", "unit": "rpm"}
TACHOMETER = [{"role": "tachometer", "values": [[2700.0 * RPM, "rad/s"]]}]


def test_a_hand_that_sets_a_speed_sees_what_the_tachometer_reads() -> None:
    view = LiveView()
    assert gauge_of(view, SET, TACHOMETER) is None
    view.take(recorded("energising", **DRIVING))
    gauge = gauge_of(view, SET, TACHOMETER)
    assert gauge is not None
    assert (gauge.low, gauge.high, gauge.unit) == (pytest.approx(2850.0), pytest.approx(3150.0), "rpm")
    assert gauge.value == pytest.approx(2700.0)
    shown = shown_gauge(gauge)
    assert (shown.place, str(shown.verdict)) == (Place.LOW, "▲ too low: 150 rpm more")
    old = gauge_of(view, SET, TACHOMETER, old=True)
    assert old is not None
    assert shown_gauge(old).place is Place.UNREAD
    # Where nothing reads it, or another instrument is asked for, there is nothing to be shown.
    assert gauge_of(view, SET, []) is None
    assert gauge_of(view, {**SET, "instrument": "supply"}, TACHOMETER) is None


def test_what_is_typed_is_held_against_what_was_set_until_that_is_switched_off() -> None:
    view = LiveView()
    view.take(recorded("energising", **DRIVING))
    view.take(recorded("energised", **DRIVING))
    # The same instrument is asked to switch off: the speed is no goal any more.
    assert gauge_of(view, SET, TACHOMETER) is None
    typed = gauge_of(view, READ, TACHOMETER, typed=3010.0)
    assert typed is not None
    assert shown_gauge(typed).place is Place.INSIDE
    assert gauge_of(view, {**READ, "unit": "N·m"}, TACHOMETER) is None
    view.take(recorded("de_energised", **DRIVING))
    assert gauge_of(view, READ, TACHOMETER, typed=3010.0) is None


@pytest.mark.parametrize(("regulated", "unit"), [("current", "A"), ("voltage", "V")])
def test_of_a_supply_the_limit_is_no_goal(regulated: str, unit: str) -> None:
    view = LiveView()
    supply = {"instrument": "supply", "call": "energised", "arguments": [24.0, 5.0, regulated]}
    view.take(recorded("energising", **supply))
    view.take(recorded("energised", **supply))
    shown = {each: gauge_of(view, {"kind": "number", "unit": each}, []) for each in ("A", "V")}
    assert [each for each, gauge in shown.items() if gauge is not None] == [unit]


@given(st.floats(-1e4, 1e4), st.floats(0.1, 1e3), st.floats(-1e5, 1e5))
def test_a_gauge_says_where_it_points(low: float, width: float, value: float) -> None:
    shown = shown_gauge(Gauge(text("speed"), "rpm", low, low + width, value))
    assert 0.0 <= shown.at <= 100.0
    assert (shown.place is Place.INSIDE) == (low <= value <= low + width)
    if shown.place is Place.INSIDE:
        assert shown.low - 1e-6 <= shown.at <= shown.high + 1e-6
    else:
        assert (shown.at <= shown.low + 1e-6) == (shown.place is Place.LOW)
