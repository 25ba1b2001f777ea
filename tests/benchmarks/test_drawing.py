"""How long a drawing takes: `uv run pytest tests/benchmarks/test_drawing.py --benchmark-enable -n 0`."""

import pytest

from bench.drawings.canvas import Form
from bench.drawings.connections import Scene, draw, standing_extents
from bench.drawings.layout import Layout
from bench.i18n.language import translator
from procedures.core.actions import ALL_OPEN, INVERTER, CurrentProbe, Terminal, phases_on
from tests.bench.drawings.scenes import WYE


@pytest.mark.parametrize("form", Form)
def test_a_drawing_with_much_on_it(benchmark, form):
    """An inverter comes on, four channels and the artificial neutral; the voltmeter goes."""
    before = Layout(ALL_OPEN.complete(), voltmeter=(Terminal.A, Terminal.B))
    after = Layout(INVERTER.complete(), (*phases_on((1, 2, 3)), CurrentProbe(4, Terminal.A)), dynamometer_coupled=True)
    translate = translator("zh")
    extents = standing_extents(WYE, translate, form)
    made = benchmark(lambda: draw(Scene(after, before), WYE, translate, form=form, extents=extents))
    assert made.svg.count("<path") > 60
