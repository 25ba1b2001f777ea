"""How much wider a map becomes by what two figures differ that a wrong gain parts, and what strokes' resistance says of a current."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.flux.gain_ratio import GainRatio, KnownResistance

OWN = 0.004


@given(st.floats(-0.999, 0.999))
def test_what_chance_explains_widens_nothing(share: float) -> None:
    assert GainRatio(1.0 + share * OWN, OWN).excess == 0.0


@given(off=st.floats(1.01, 100.0).filter(lambda off: abs(off - 3.0) > 1e-6), way=st.sampled_from([-1.0, 1.0]))
def test_more_than_chance_is_in_the_limit_whether_it_is_told_or_not(off: float, way: float) -> None:
    found = GainRatio(1.0 + way * off * OWN, OWN)
    assert found.excess <= (off + 2.0) * OWN / 0.95 * (1.0 + 1e-9)
    # An interval of 95 % ends at 1.96/√3 of a limit: where the difference is told, it reaches beyond it.
    assert not found.contradicted or 1.96 / np.sqrt(3.0) * found.excess > off * OWN
    assert found.contradicted == (off > 3.0)


def test_a_little_more_difference_makes_it_no_narrower() -> None:
    widths = [GainRatio(1.0 + off, OWN).excess for off in np.linspace(0.0, 0.2, 400)]
    assert np.all(np.diff(widths) >= 0.0)
    assert widths[-1] == pytest.approx((0.2 + 2.0 * OWN) / 0.95)


def test_what_the_strokes_warm_is_no_gain() -> None:
    heat = np.linspace(0.0, 40.0, 20)
    found = KnownResistance(0.5, 0.001).beside(0.51 * (1.0 + 0.001 * heat), np.ones(20), heat, 0.003)
    assert found is not None
    assert found.ratio == pytest.approx(1.02)
    assert found.standard_uncertainty == pytest.approx(np.hypot(0.002, 0.003))


def test_too_few_trains_say_nothing() -> None:
    assert KnownResistance(0.5, 0.001).beside(np.full(2, 0.5), np.ones(2), np.ones(2)) is None
