"""A coast-down that ends early says what it cannot show."""

import numpy as np
import pytest

from bench.analysis.coast_down import analyze_coast_down


@pytest.mark.parametrize(("end", "told"), [(20.0, False), (60.0, True)])
def test_one_that_ends_above_a_tenth_of_its_top_speed(tmp_path, end, told):
    coulomb, viscous, top = 20.0, 0.1, 300.0
    time = np.arange(0.0, 20.0, 0.01)
    speed = (top + coulomb / viscous) * np.exp(-viscous * time) - coulomb / viscous
    kept = speed > end
    noisy = speed[kept] + np.random.default_rng(3).normal(0.0, 0.05, int(kept.sum()))
    path = tmp_path / "coast.csv"
    np.savetxt(path, np.column_stack((time[kept], noisy)), delimiter=",", header="time (s),speed (rad/s)", comments="")
    found = analyze_coast_down(path)
    low, high = found["parameters"]["coulomb_deceleration"]["coverage_interval"]
    assert low <= coulomb <= high
    assert ("coast-lower" in {warning["id"] for warning in found["warnings"]}) == told
