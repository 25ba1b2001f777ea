"""What `analyze short-circuit` takes for the instruments' limits, and three phases in one table."""

import json
from pathlib import Path

import numpy as np
import pytest

from bench.analysis.short_circuit import LimitsOfTable, analyze_short_circuit, limits_of
from bench.cli.analyze.maps import short_circuit
from bench.i18n.errors import UsageError

R, L_D, L_Q, FLUX, PAIRS = 0.5, 10e-3, 18e-3, 0.3, 4
SPEED = R / np.sqrt(L_D * L_Q) * np.geomspace(0.1, 15.0, 12)
CURRENT = FLUX * SPEED * np.hypot(R, SPEED * L_Q) / (R**2 + SPEED**2 * L_D * L_Q)
TORQUE = 1.5 * PAIRS * R * CURRENT**2 / SPEED
EXACT = LimitsOfTable(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def written(path: Path, heading: str, *columns: np.ndarray) -> Path:
    random = np.random.default_rng(1)
    noisy = [each * (1.0 + 1e-3 * random.standard_normal(each.size)) for each in columns]
    rows = np.column_stack((SPEED / PAIRS, *noisy))
    np.savetxt(path, rows, delimiter=",", fmt="%.6g", header=f"speed (rad/s),{heading}", comments="")
    return path


def half(figure: dict) -> float:
    low, high = figure["coverage_interval"]
    return 0.5 * (high - low) / figure["value"]


def test_what_nobody_states_is_taken_as_usual_and_said(tmp_path: Path) -> None:
    path = written(tmp_path / "t.csv", "current (A),torque (Nm)", CURRENT, TORQUE)
    usual = analyze_short_circuit(path, pole_pairs=PAIRS, flux_linkage=FLUX)
    exact = analyze_short_circuit(path, pole_pairs=PAIRS, flux_linkage=FLUX, u_flux_linkage=0.0, stated=EXACT)
    said = " ".join(usual["assumptions"])
    for option in (
        "current-gain",
        "unbalance",
        "speed-gain",
        "torque-gain",
        "torque-zero",
        "u-flux-linkage",
        "saturation",
    ):
        assert f"no --{option} is stated" in said
        assert f"--{option}" not in " ".join(exact["assumptions"])
    for name, truth in (("d_axis_inductance", L_D), ("q_axis_inductance", L_Q), ("stator_resistance", R)):
        low, high = exact["parameters"][name]["coverage_interval"]
        assert low <= truth <= high
        assert half(exact["parameters"][name]) < 0.5 * half(usual["parameters"][name])
    assert half(usual["parameters"]["d_axis_inductance"]) < 0.06


def test_the_budget_has_a_row_for_each_limit(tmp_path: Path) -> None:
    path = written(tmp_path / "t.csv", "current (A)", CURRENT)
    stated = LimitsOfTable(current=0.02, unbalance=0.0, speed=0.01, saturation=0.0)
    made = analyze_short_circuit(path, pole_pairs=PAIRS, flux_linkage=FLUX, u_flux_linkage=0.005 * FLUX, stated=stated)
    figure = made["parameters"]["stator_resistance"]
    rows = {row["source"]: row for row in figure["budget"]}
    assert set(rows) == {"the fit", "gain of the currents", "flux linkage as stated", "gain of the speeds"}
    parts = {name: row["contribution"] for name, row in rows.items()}
    assert abs(parts["gain of the currents"]) == pytest.approx(0.02 / np.sqrt(3.0) * R, rel=0.02)
    assert abs(parts["flux linkage as stated"]) == pytest.approx(0.005 * R, rel=0.02)
    assert "gain of the speeds" not in {row["source"] for row in made["parameters"]["d_axis_inductance"]["budget"]}


def test_three_phases_give_their_mean_and_tell_how_they_differ(tmp_path: Path) -> None:
    shares = (1.06, 0.98, 0.96)
    path = written(tmp_path / "t.csv", "Ia (A),Ib (A),Ic (A)", *(share * CURRENT for share in shares))
    made = analyze_short_circuit(
        path, pole_pairs=PAIRS, flux_linkage=FLUX, u_flux_linkage=0.0, stated=LimitsOfTable(0.0)
    )
    low, high = made["parameters"]["d_axis_inductance"]["coverage_interval"]
    assert low <= L_D <= high
    assert half(made["parameters"]["d_axis_inductance"]) < 0.02
    assert made["details"]["limits"]["unequal"] == 0.0
    assert "--unbalance" not in " ".join(made["assumptions"])
    (warning,) = (each for each in made["warnings"] if each["id"] == "unequal-phases")
    assert "+6.0%" in warning["text"] or "+6.1%" in warning["text"]
    one = written(tmp_path / "one.csv", "Ia (A)", shares[0] * CURRENT)
    made = analyze_short_circuit(
        one, pole_pairs=PAIRS, flux_linkage=FLUX, u_flux_linkage=0.0, stated=LimitsOfTable(0.0)
    )
    assert made["details"]["limits"]["unequal"] == 0.03


def test_two_phases_leave_half_of_the_third_s_deviation() -> None:
    assert limits_of(phases=2).unequal == pytest.approx(0.015)
    assert limits_of(LimitsOfTable(unbalance=0.01), phases=2).unequal == pytest.approx(0.005)
    assert limits_of(largest_torque=20.0).torque_zero == pytest.approx(0.1)


def test_limits_are_typed_in_per_cent_and_refused_beyond_all_sense(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path / "t.csv", "current (A)", CURRENT)
    assert short_circuit(path, pole_pairs=4.0, flux_linkage=FLUX, current_gain=0.5, unbalance=1.0, json=True) == 0
    limits = json.loads(capsys.readouterr().out)["details"]["limits"]
    assert limits["current"] == pytest.approx(0.005)
    assert limits["unequal"] == pytest.approx(0.01)
    with pytest.raises(UsageError, match="--current-gain -1: a limit from 0 to 50 % is allowed"):
        short_circuit(path, pole_pairs=4.0, flux_linkage=FLUX, current_gain=-1.0)
    with pytest.raises(UsageError, match="--torque-zero"):
        short_circuit(path, pole_pairs=4.0, flux_linkage=FLUX, torque_zero=-1.0)
