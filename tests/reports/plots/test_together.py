import os

import numpy as np
import pytest

from drivers.interfaces.text import Text
from reports.plots import together
from reports.plots.draw import svg
from reports.plots.model import Axes, Manner, Plot, PlotCurve


def plot(name: str, columns: int) -> Plot:
    x = np.linspace(0.0, 1.0, 20)
    axes = Axes(Text("Time"), "s", Text("Current"), "A", (PlotCurve(Text("fit"), x, x**2, Manner.FIT),))
    return Plot(name, Text(name), ((axes,) * columns,))


def say(words: object) -> list[str]:
    return [str(words)]


@pytest.fixture
def plots(monkeypatch: pytest.MonkeyPatch) -> list[Plot]:
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    return [plot("one", 1), plot("two", 2), plot("three", 1)]


def test_two_processes_draw_what_one_draws(plots: list[Plot]) -> None:
    assert together.drawn(plots, say) == {one.name: svg(one, say) for one in plots}


def test_what_a_lost_process_would_have_drawn_is_left_to_be_drawn(plots: list[Plot]) -> None:
    parent = os.getpid()

    def say_or_die(words: object) -> list[str]:
        if os.getpid() != parent:
            os._exit(1)
        return say(words)

    made = together.drawn(plots, say_or_die)
    assert 0 < len(made) < len(plots)
    assert all(made[name] == svg(one, say) for one in plots if (name := one.name) in made)


def test_an_error_in_drawing_leaves_no_process(plots: list[Plot]) -> None:
    def fails(_: object) -> list[str]:
        raise LookupError("no such word")

    with pytest.raises(LookupError):
        together.drawn(plots, fails)


def test_one_processor_draws_nothing_ahead(plots: list[Plot], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    assert together.drawn(plots, say) == {}
