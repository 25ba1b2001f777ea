"""Plots as SVG: where ticks stand, what is drawn and said."""

import re
from xml.etree import ElementTree as Xml

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interfaces.text import Text
from procedures.core.axes import Axes, CurveStyle, PlotCurve
from reports.plots.draw import svg
from reports.plots.model import Plot
from reports.plots.ticks import label_of, ticks


@given(low=st.floats(-1e4, 1e4), span=st.floats(1e-3, 1e4), most=st.integers(1, 6), whole=st.booleans())
def test_ticks_are_round_few_and_told_apart(low: float, span: float, most: int, whole: bool) -> None:
    places = ticks(low, low + span, most, whole=whole)
    assert len(places) <= most + 1
    assert all(low - 1e-6 * span <= place <= low + span * (1 + 1e-6) for place in places)
    if whole:
        assert all(place == round(place) for place in places)
    elif most > 2:
        assert len(places) >= 2
    if len(places) > 1:
        step = places[1] - places[0]
        labels = [label_of(place, step) for place in places]
        assert len(set(labels)) == len(labels)
        figures = [float(label.replace("\N{MINUS SIGN}", "-")) for label in labels]
        assert figures == pytest.approx(places, abs=1e-6 * max(step, abs(low)))


def plot(**more: bool) -> Plot:
    x = np.linspace(0.0, 0.02, 21)
    y = np.where(np.arange(21) == 10, np.nan, 3.0 * x)
    curves = (
        PlotCurve(Text("readings"), x[::5], 3.0 * x[::5], CurveStyle.READING),
        PlotCurve(Text("fit & <more>"), x, y, CurveStyle.FIT),
    )
    return Plot("one", Text("caption"), ((Axes(Text("Time"), "s", Text("Current"), "A", curves, **more),),))


def both(words: Text) -> list[str]:
    return [str(words), f"{words} zh"]


def test_a_plot_shows_its_curves_and_says_what_they_are() -> None:
    drawn = Xml.fromstring(svg(plot(), both))  # noqa: S314
    words = [each.text for each in drawn.iterfind(".//{*}text")]
    assert {"Time / Time zh, ms", "Current", "Current zh, mA"} <= set(words)
    assert {"readings / readings zh", "fit & <more> / fit & <more> zh"} <= set(words)
    # Five readings and the legend's; the line is broken where there is no value.
    assert len(list(drawn.iterfind(".//{*}circle"))) == 6
    assert len(list(drawn.iterfind(".//{*}polyline"))) == 2


def test_curves_stay_within_their_axes() -> None:
    drawn = Xml.fromstring(svg(plot(x_from_zero=True, y_from_zero=True), both))  # noqa: S314
    frame = next(each for each in drawn.iterfind(".//{*}rect") if each.get("stroke"))
    left, top, width, height = (float(frame.get(name, "nan")) for name in ("x", "y", "width", "height"))
    for line in drawn.iterfind(".//{*}polyline"):
        points = np.array([[float(v) for v in pair.split(",")] for pair in str(line.get("points")).split()])
        assert np.all((points[:, 0] >= left - 0.01) & (points[:, 0] <= left + width))
        assert np.all((points[:, 1] >= top) & (points[:, 1] <= top + height + 0.01))
    assert len(set(re.findall(r'id="([^"]+)"', svg(plot(), both)))) == 1


def test_a_curve_of_one_value_has_room_about_it() -> None:
    flat = PlotCurve(Text("flat"), np.array([1.0, 2.0]), np.array([5.0, 5.0]), CurveStyle.RECORD)
    drawn = svg(Plot("flat", Text("c"), ((Axes(Text("n"), "", Text("y"), "V", (flat,)),),)), both)
    assert "nan" not in drawn
    assert "<polyline" in drawn
