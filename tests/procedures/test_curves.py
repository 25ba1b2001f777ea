import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from procedures.core.curves import curve
from procedures.estimation.mechanics.inertia import fit_ramps, fitted_speeds
from procedures.estimation.mechanics.turning import SpeedRamp


@given(size=st.integers(0, 2000), points=st.integers(2, 400))
def test_columns_are_thinned_alike_and_keep_their_ends(size: int, points: int) -> None:
    x = np.arange(size, dtype=np.float64)
    made = curve(points, x=x, y=2.0 * x)
    assert made["y"] == [2.0 * value for value in made["x"]]
    assert len(made["x"]) <= min(size, points)
    assert made["x"] == sorted(set(made["x"]))
    if size:
        assert (made["x"][0], made["x"][-1]) == (0.0, size - 1)


def test_fitted_speeds_belong_to_the_part_that_turns() -> None:
    time = np.linspace(0.0, 1.0, 101)
    driven = np.maximum(time - 0.2, 0.0) * 100.0
    coast = 80.0 - 20.0 * time
    ramps = [SpeedRamp(time, driven, 0.12), SpeedRamp(time, coast, 0.0)]
    fit = fit_ramps(ramps)
    (first, up), (second, down) = fitted_speeds(ramps, fit)
    assert 0.2 < first[0] < 0.25
    assert np.allclose(up, np.interp(first, time, driven), atol=1e-6)
    assert np.allclose(second, time)
    assert np.allclose(down, coast, atol=1e-6)
