"""A coast-down that ends early says what it cannot show."""

import numpy as np
import pytest

from bench.analysis.coast_down import analyze_coast_down
from tests.studies.worlds.shaft_records import fit_coast_down


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


def test_a_reading_that_is_none_is_no_end_of_the_coast_down(tmp_path):
    time = np.arange(0.0, 10.0, 0.01)
    speed = 310.0 * np.exp(-0.1 * time) + np.random.default_rng(3).normal(0.0, 0.05, time.size)
    speed[500] = 0.0
    path = tmp_path / "coast.csv"
    np.savetxt(path, np.column_stack((time, speed)), delimiter=",", header="time (s),speed (rad/s)", comments="")
    assert {"dropouts", "coast-lower"} <= {warning["id"] for warning in analyze_coast_down(path)["warnings"]}


@pytest.mark.parametrize("share", [0.0, 0.1])
def test_friction_that_grows_below_what_was_recorded_is_in_the_intervals(share):
    coulomb, viscous, top, step = 20.0, 0.1, 300.0, 0.001
    speeds = [top]
    while speeds[-1] > 60.0:
        grown = coulomb * (1.0 + share * np.exp(-speeds[-1] / 75.0))
        speeds.append(speeds[-1] - step * (grown + viscous * speeds[-1]))
    seen = np.array(speeds[::10])
    seen += np.random.default_rng(3).normal(0.0, 1.0, seen.size)
    fit = fit_coast_down(np.arange(seen.size) * 10 * step, seen)
    for name, truth in (("coulomb_deceleration", coulomb), ("viscous_rate", viscous)):
        assert abs(fit.value(name) - truth) < 2.0 * fit.uncertainty(name)
        # What the record says of it keeps the intervals from growing to all that bearings may hold.
        assert 2.0 * fit.uncertainty(name) < (0.4 if name == "coulomb_deceleration" else 0.7) * truth
