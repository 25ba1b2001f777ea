"""Deviations of three like values from their mean."""

import math

import numpy as np
import pytest
from GTC import ureal
from hypothesis import given
from hypothesis import strategies as st
from scipy import special

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.winding.unbalance import all_at_once, largest_deviation, pooled, saliency_share

VALUES = st.tuples(*[st.floats(min_value=1e-6, max_value=1e6)] * 3)


def test_nema_s_own_example():
    # NEMA MG 1, voltage unbalance: 550, 520, 530 V have a mean of 533.3 V and a largest deviation of 16.7 V, 3.1 %.
    found = largest_deviation((550.0, 520.0, 530.0))
    assert found.place == 0
    assert found.share == pytest.approx(0.03125)


@given(VALUES, st.floats(min_value=1e-3, max_value=1e3))
def test_a_common_gain_does_not_matter_and_no_value_is_farther(values, gain):
    found = largest_deviation(values)
    mean = sum(values) / 3.0
    assert all(abs(value / mean - 1.0) <= found.share + 1e-12 for value in values)
    assert largest_deviation([gain * value for value in values]).share == pytest.approx(found.share, abs=1e-9)
    # A single one of three cannot be more than twice the mean above it, nor more than all of it below.
    assert 0.0 <= found.share < 2.0


def test_an_uncertain_deviation_keeps_what_is_common_out_of_its_budget():
    gain = ureal(1.0, 0.02)
    found = largest_deviation([gain * ureal(value, 1e-3) for value in (0.50, 0.52, 0.57)])
    assert (found.place, found.share.x) == (2, pytest.approx(0.57 / 0.53 - 1.0))
    assert found.share.u < 0.003
    assert largest_deviation([0.45, 0.52, 0.53]).share == pytest.approx(0.1)


@pytest.mark.parametrize("values", [(0.0, 0.0, 0.0), (-1.0, 0.0, 0.5), (math.nan, 1.0, 1.0)])
def test_what_has_no_mean_is_refused(values):
    with pytest.raises(EstimationError, match="not above zero"):
        largest_deviation(values)


def test_scatter_is_pooled_over_the_groups():
    random = np.random.default_rng(1)
    found = pooled([5.0 + 0.1 * random.standard_normal(4), 7.0 + 0.1 * random.standard_normal(4), [9.0]])
    assert found.degrees_of_freedom == 6.0
    assert found.deviation == pytest.approx(0.1, rel=0.5)
    assert found.means[2] == 9.0
    assert pooled([[1.0], [2.0]]).degrees_of_freedom == math.inf


@pytest.mark.parametrize("repeats", [2, 3, 10])
def test_the_largest_of_three_deviations_is_held_where_there_is_none(repeats):
    readings = np.random.default_rng(repeats).standard_normal((20_000, 3, repeats))
    freedom = 3 * (repeats - 1)
    scatter = np.sqrt(readings.var(axis=2, ddof=1).mean(axis=1))
    means = readings.mean(axis=2)
    largest = np.abs(means - means.mean(axis=1, keepdims=True)).max(axis=1)
    reach = special.stdtrit(freedom, 0.975) * scatter * math.sqrt(2.0 / 3.0 / repeats)
    assert np.mean(largest <= reach) < 0.91
    assert np.mean(largest <= all_at_once(3, freedom) * reach) == pytest.approx(0.96, abs=0.01)
    assert all_at_once(1, freedom) == 1.0
    assert all_at_once(3, math.inf) < all_at_once(3, freedom)


def test_the_largest_of_three_channels_own_gains_is_held_where_there_is_none():
    """Gains anywhere within their limits, as those of three channels are: 95 % of a single deviation hold 85 % of the largest."""
    gains = np.random.default_rng(1).uniform(-1.0, 1.0, (100_000, 3))
    off = np.abs(gains - gains.mean(axis=1, keepdims=True))
    reach = np.quantile(off[:, 0], 0.95)
    assert np.mean(off.max(axis=1) <= reach) < 0.87
    assert np.mean(off.max(axis=1) <= all_at_once(3, math.inf) * reach) > 0.95


def test_saliency_is_what_a_line_s_inductance_sways_by():
    d, q = 180e-6, 360e-6
    lines = [d + q + (d - q) * math.cos(2.0 * angle) for angle in np.linspace(0.0, math.pi, 181)]
    assert saliency_share(d, q) == pytest.approx(max(lines) / (d + q) - 1.0)
