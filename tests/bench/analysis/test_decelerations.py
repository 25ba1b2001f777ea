"""`analyze coast-down` gives decelerations at named speeds, also where no law of friction explains the record."""

import json

import numpy as np
import pytest

from bench.analysis.coast_down import analyze_coast_down
from bench.analysis.statements import read_statements
from bench.captures import CaptureError
from tests.studies.coast_pairs import Bearing

RPM = np.pi / 30.0


def law(speed):
    """Return a deceleration (rad/s²) over speed (rad/s) that no friction of the model explains."""
    return 2.0 * np.sqrt(speed) + 6.0 / (1.0 + ((speed - 150.0) / 25.0) ** 2)


@pytest.fixture
def path(tmp_path):
    """Return a record of such a shaft."""
    step, speeds = 0.01, [300.0]
    while speeds[-1] > 15.0:
        speeds.append(speeds[-1] - step * law(speeds[-1] - 0.5 * step * law(speeds[-1])))
    seen = np.array(speeds[::4])
    seen = seen + np.random.default_rng(3).normal(0.0, 0.02, seen.size)
    path = tmp_path / "coast.csv"
    table = np.column_stack((4.0 * step * np.arange(seen.size), seen / RPM))
    np.savetxt(path, table, fmt="%.6g", delimiter=",", header="time (s),speed (rpm)", comments="")
    return path


def test_what_no_law_explains_has_decelerations_and_torques(path, call):
    code, out, _ = call(
        "analyze", "coast-down", str(path), "--inertia", "2e-4", "--at-speed", "2200", "--at-speed", "600", "--json"
    )
    found = json.loads(out)
    assert code == 1
    assert set(found["withheld"]) >= {"coulomb_friction", "viscous_friction"}
    rows = found["details"]["decelerations"]
    assert [row["speed_rpm"] for row in rows] == pytest.approx([2200.0, 600.0])
    for row in rows:
        true = law(row["speed_rpm"] * RPM)
        for key, factor in (("deceleration", 1.0), ("friction_torque", 2e-4)):
            low, high = row[key]["coverage_interval"]
            assert low <= factor * true <= high
            assert high - low < 0.25 * factor * true
    _, out, _ = call("analyze", "coast-down", str(path), "--inertia", "2e-4")
    assert "without a law of friction" in out
    assert "Friction torque, mN·m" in out


def test_a_stated_accuracy_is_in_the_interval(path):
    def widths(*stated):
        made = analyze_coast_down(path, at_speed=[600.0], accuracy=read_statements(stated, None, ()))
        [row] = made["details"]["decelerations"]
        return row["deceleration"]["standard_uncertainty"] / row["deceleration"]["value"]

    # A clock that is off changes the slope by as much.
    assert widths("time=10%") == pytest.approx(np.hypot(widths(), 0.1 / np.sqrt(3.0)), rel=0.05)


def test_a_speed_that_is_not_passed_is_refused_with_those_that_are(path):
    with pytest.raises(CaptureError, match=r"5000 rpm is not passed; allowed are .* and 27\d\d"):
        analyze_coast_down(path, at_speed=[5000.0])


def test_no_unit_of_time_no_deceleration(path):
    time = np.loadtxt(path, delimiter=",", skiprows=1)
    time[:, 0] *= 10.0
    np.savetxt(path, time, fmt="%.7g", delimiter=",", header="time,speed (rpm)", comments="")
    assert "decelerations" not in analyze_coast_down(path)["details"]


def test_a_second_coast_down_takes_the_doubt_of_drifting_friction_away(tmp_path):
    random, bearing, begun = np.random.default_rng(4), Bearing(60.0, 0.15, 0.0), 0.0
    files = []
    for name in ("cold", "warm"):
        ramp = bearing.coast(begun, 400.0, random)
        files.append(tmp_path / f"{name}.csv")
        rows = (f"{t:.6f},{w:.4f}\n" for t, w in zip(ramp.time, ramp.speed, strict=True))
        files[-1].write_text("time (s),speed (rad/s)\n" + "".join(rows), encoding="utf-8")
    alone, both = analyze_coast_down(files[0]), analyze_coast_down(files)
    assert "friction-drift-unseen" in {said["id"] for said in alone["warnings"]}
    assert "friction-drift-unseen" not in {said["id"] for said in both["warnings"]}
    for name, truth in (("coulomb_deceleration", 60.0), ("viscous_rate", 0.15)):
        low, high = both["parameters"][name]["coverage_interval"]
        assert low <= truth <= high
    with pytest.raises(CaptureError, match="decelerations are given of a single coast-down"):
        analyze_coast_down(files, at_speed=[1000.0])
