"""The shape of synthetic EMFs whose truth is known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from procedures.estimation.emf.emf_shape import emf_shape
from procedures.estimation.fitting.fit import EstimationError


def emf(harmonics=(), *, sizes=(1.0, 1.0, 1.0), shifts=(0.0, 0.0, 0.0), noise=0.0, periods=5.0, points=4000, drift=0.0,
        order=(0, 1, 2), seed=0):  # fmt: skip
    """Return time (s) and three voltages of a machine of 10 mV·s/rad at about 100 Hz."""
    t = np.linspace(0.0, periods / 100.0, points, endpoint=False)
    x = t / t[-1]
    angle = 2 * math.pi * 100.0 * t * (1.0 + 0.5 * drift * (x - 1.0)) + 0.3
    speed = np.gradient(angle, t)
    rows = []
    for k in order:
        own = angle - 2 * math.pi / 3 * k + shifts[k]
        wave = np.cos(own) + sum(a * np.cos(n * own + p) for n, a, p in harmonics)
        rows.append(10e-3 * sizes[k] * speed * wave)
    v = np.array(rows)
    return t, v + noise * 6.28 * np.random.default_rng(seed).standard_normal(v.shape)


def test_pure_sines_are_alike_and_undistorted():
    shape = emf_shape(*emf())
    assert shape.thd == pytest.approx(np.zeros(3), abs=1e-6)
    assert np.ptp(shape.flux) / np.mean(shape.flux) < 1e-9
    assert shape.flux == pytest.approx(np.full(3, 10e-3), rel=1e-4)
    assert shape.spacings == pytest.approx(np.full(3, 2 * math.pi / 3))
    assert shape.forwards


@pytest.mark.parametrize("drift", [0.0, 0.02])
@pytest.mark.parametrize("periods", [3.0, 4.37])
def test_distortion_is_the_root_of_the_squares(drift, periods):
    # The ideal 120° trapezium's first harmonics, beyond IEC 61000-4-7's definition nothing else.
    harmonics = ((5, 0.04, 0.4), (7, -0.02, 0.0), (11, 0.01, 1.0), (37, 0.005, 2.0))
    truth = math.sqrt(sum(a * a for _, a, _ in harmonics))
    shape = emf_shape(*emf(harmonics, noise=3e-3, periods=periods, drift=drift))
    assert np.all(np.abs(shape.thd - truth) < 4.0 * shape.thd_uncertainty)
    assert shape.thd_uncertainty < 0.02 * truth
    only = emf_shape(*emf(harmonics, noise=3e-3, periods=periods, drift=drift), harmonics=20)
    assert only.thd[0] < shape.thd[0]
    assert abs(shape.harmonics[1, 4]) == pytest.approx(0.04, rel=0.03)


@settings(max_examples=20, deadline=None)
@given(
    st.tuples(*[st.floats(min_value=0.9, max_value=1.1)] * 3),
    st.tuples(*[st.floats(min_value=-0.1, max_value=0.1)] * 3),
    st.integers(min_value=0, max_value=1000),
)
def test_unlike_phases_are_found_within_their_uncertainty(sizes, shifts, seed):
    shape = emf_shape(*emf(((5, 0.03, 0.0),), sizes=sizes, shifts=shifts, noise=5e-3, seed=seed))
    assert np.all(np.abs(shape.flux / 10e-3 / sizes - 1.0) < 6.0 * shape.flux_uncertainty + 1e-4)
    truth = [2 * math.pi / 3 + shifts[k] - shifts[(k + 1) % 3] for k in range(3)]
    assert np.all(np.abs(shape.spacings - truth) < 6.0 * shape.spacing_uncertainty)
    assert np.sum(shape.spacings) == pytest.approx(2 * math.pi)


def test_backwards_is_told_and_spaced_alike():
    shape = emf_shape(*emf(shifts=(0.05, 0.0, 0.0), order=(0, 2, 1)))
    assert not shape.forwards
    assert sorted(shape.spacings) == pytest.approx(
        sorted([2 * math.pi / 3 + 0.05, 2 * math.pi / 3 - 0.05, 2 * math.pi / 3])
    )


def test_scatter_of_the_distortion_is_as_stated():
    found = [emf_shape(*emf(((5, 0.01, 0.0),), noise=6e-3, seed=seed)) for seed in range(30)]
    off = np.array([shape.thd for shape in found]).ravel() - 0.01
    stated = np.mean([shape.thd_uncertainty for shape in found])
    assert 0.6 * stated < np.sqrt(np.mean(off**2)) < 1.4 * stated
    assert abs(np.mean(off)) < 0.5 * stated


def test_steps_of_a_converter_are_allowed_for():
    t, v = emf()
    step = 2 * 6.28 / 200
    shape = emf_shape(t, np.round(v / step) * step, resolution=(step,) * 3)
    assert np.all(shape.thd < 3.0 * shape.thd_uncertainty)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"periods": 0.5}, "period"),
        ({"points": 60, "periods": 20.0}, "sample"),
    ],
)
def test_too_little_is_refused(change, said):
    with pytest.raises(EstimationError, match=said):
        emf_shape(*emf(**change))
    with pytest.raises(EstimationError, match="three phases"):
        emf_shape(np.arange(100.0), np.zeros((2, 100)))
