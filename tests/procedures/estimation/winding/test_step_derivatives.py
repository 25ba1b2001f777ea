"""A term's derivatives by its figures that are written out are those of differences."""

import numpy as np
import pytest

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.winding.current_step.divider import Divider
from procedures.estimation.winding.current_step.term import StepScale
from procedures.estimation.winding.current_step.terms import TERMS

_STEP, _CHANGE = 1e-4, 1e-5
_SCALE = StepScale(time_constant=5e-3, current=2.0, begin=0.0, length=0.05)
_CURRENT = 2.0 * (1.0 - np.exp(-np.arange(500) * _STEP / 5e-3))
_EDDY = next(term for term in TERMS if term.family == "eddy" and not isinstance(term, Divider))


@pytest.mark.parametrize("figures", [(0.0, 0.0), (0.03, 0.4), (-0.02, -1.1)])
@pytest.mark.parametrize(("term", "method"), [(Divider(0.3), "channel"), (_EDDY, "flux")])
def test_written_out(term: Divider, method: str, figures: tuple[float, float]) -> None:
    at = np.array(figures)
    made = getattr(term, method)

    def difference(by: FloatArray) -> FloatArray:
        above, below = (made(_CURRENT, _STEP, _SCALE, at + way * by) for way in (1.0, -1.0))
        return np.asarray((above - below) / (2.0 * _CHANGE))

    written = getattr(term, f"{method}_by_figures")(_CURRENT, _STEP, _SCALE, at)
    expected = np.array([difference(by) for by in _CHANGE * np.eye(2)])
    assert written == pytest.approx(expected, abs=1e-6)


def test_a_divider_of_a_given_time_constant_has_one() -> None:
    term = Divider(0.3).at_start()
    written = term.channel_by_figures(_CURRENT, _STEP, _SCALE, np.array([0.1]))
    assert written is not None
    made = [term.channel(_CURRENT, _STEP, _SCALE, np.array([share])) for share in (1.0, 0.0)]
    assert written == pytest.approx(np.array([made[0] - made[1]]))
