"""Drag over speed: its terms, and how well it is known at a speed."""

import numpy as np
import pytest

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.mechanics.drag import drag_at, fit_drag

SPEEDS = np.geomspace(10.0, 300.0, 6)


def course(speed):
    return 0.03 + 5e-5 * speed + 2e-7 * speed**2


def test_the_terms_come_back():
    fit = fit_drag(SPEEDS, course(SPEEDS), np.full(6, 1e-5))
    assert fit.names == ("constant", "linear", "quadratic")
    np.testing.assert_allclose(fit.values, (0.03, 5e-5, 2e-7), rtol=1e-6)
    value, uncertainty = drag_at(fit, [100.0, 300.0])
    np.testing.assert_allclose(value, course(np.array([100.0, 300.0])), rtol=1e-9)
    assert np.all((uncertainty > 0.0) & (uncertainty < 2e-5))


def test_errors_are_what_the_covariance_says():
    random, z = np.random.default_rng(5), []
    for _ in range(300):
        fit = fit_drag(SPEEDS, course(SPEEDS) + 1e-4 * random.standard_normal(6), np.full(6, 1e-4))
        value, uncertainty = drag_at(fit, 300.0)
        z.append((value[0] - course(300.0)) / uncertainty[0])
    # The scatter may only widen.
    assert 0.7 < np.std(z) < 1.05


def test_scatter_beyond_the_uncertainties_widens():
    rough = course(SPEEDS) * np.array([1.0, 1.05, 0.95, 1.05, 0.95, 1.0])
    narrow, wide = (fit_drag(SPEEDS, values, np.full(6, 1e-5)) for values in (course(SPEEDS), rough))
    assert drag_at(wide, 100.0)[1][0] > 20.0 * drag_at(narrow, 100.0)[1][0]


def test_fewer_speeds_give_fewer_terms():
    assert fit_drag([10.0], [0.03], [1e-4]).names == ("constant",)
    two = fit_drag([10.0, 100.0], [0.03, 0.04], [1e-4, 1e-4])
    assert two.names == ("constant", "linear")
    value, uncertainty = drag_at(two, 100.0)
    assert (value[0], uncertainty[0]) == pytest.approx((0.04, 1e-4))


def test_what_cannot_be_fitted_is_refused():
    with pytest.raises(EstimationError, match="at least 1"):
        fit_drag([], [], [])
    with pytest.raises(EstimationError, match="spread them more"):
        fit_drag([10.0, 10.0], [0.03, 0.03], [1e-4, 1e-4])
