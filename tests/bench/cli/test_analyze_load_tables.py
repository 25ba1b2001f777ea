"""`motorbench analyze short-circuit` and `efficiency`: tables of others, right and wrong ones."""

import json
from pathlib import Path

import numpy as np
import pytest

from bench.cli.analyze.maps import efficiency, short_circuit
from tests.bench.cli.map_tables import analyzed, written


def test_electrical_speeds_by_their_heading(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    w = np.geomspace(20.0, 2000.0, 15)
    i = 0.3 * w / np.hypot(0.5, w * 10e-3)
    path = written(tmp_path / "table.csv", np.column_stack((w, i)), "w_electrical (rad/s),current_A")
    made = analyzed(capsys, 0, short_circuit(path, pole_pairs=4.0, flux_linkage=0.3, json=True))
    assert made["parameters"]["d_axis_inductance"]["value"] == pytest.approx(10e-3, rel=0.01)


def test_without_a_flux_linkage_the_current_at_high_speed_is_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    w = np.geomspace(20.0, 2000.0, 20)
    i = 0.3 * w / np.hypot(0.5, w * 10e-3)
    path = written(tmp_path / "table.csv", np.column_stack((w, i)), "w_electrical (rad/s),current_A")
    made = analyzed(capsys, 0, short_circuit(path, pole_pairs=4.0, json=True))
    assert set(made["parameters"]) == {"short_circuit_current"}
    low, high = made["parameters"]["short_circuit_current"]["coverage_interval"]
    assert low < 30.0 < high < 1.1 * low


def test_a_short_circuit_whose_drop_contradicts_is_an_alarm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    speed = np.geomspace(10.0, 600.0, 20)
    flux, l_d, l_q, r = 0.3, 10e-3, 20e-3, 0.5
    current = flux * speed * np.sqrt(r**2 + (speed * l_q) ** 2) / (r**2 + speed**2 * l_d * l_q)
    torque = 1.5 * r * current**2 * 2.0 / speed
    heading = "speed_rad/s,current_A,torque_Nm"
    path = written(tmp_path / "right.csv", np.column_stack((speed / 2.0, current, torque)), heading)
    exact = {"u_flux_linkage": 0.0, "current_gain": 0.0, "unbalance": 0.0, "speed_gain": 0.0, "saturation": 0.0}
    made = analyzed(capsys, 0, short_circuit(path, pole_pairs=2.0, flux_linkage=flux, json=True, **exact))
    assert made["parameters"]["stator_resistance"]["value"] == pytest.approx(r, rel=0.005)
    assert made["parameters"]["d_axis_inductance"]["value"] == pytest.approx(l_d, rel=0.005)
    path = written(tmp_path / "wrong.csv", np.column_stack((speed / 2.0, current, 0.8 * torque)), heading)
    made = analyzed(capsys, 1, short_circuit(path, pole_pairs=2.0, flux_linkage=flux, json=True))
    assert made["withheld"]["stator_resistance"]["cause"] == "resistances-differ"
    assert set(made["parameters"]) & {"stator_resistance", "d_axis_inductance"} == {"d_axis_inductance"}


@pytest.mark.parametrize(("shown", "linked"), [(2.0**-0.5, 1.0), pytest.param(1.0, 1e3, marks=pytest.mark.slow)])
def test_a_short_circuit_whose_currents_may_be_rms_is_told_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], shown: float, linked: float
) -> None:
    speed = np.geomspace(10.0, 600.0, 20)
    flux, l_d, l_q, r = 0.3, 10e-3, 20e-3, 0.5
    current = flux * speed * np.sqrt(r**2 + (speed * l_q) ** 2) / (r**2 + speed**2 * l_d * l_q)
    torque = 1.5 * r * current**2 * 2.0 / speed
    rows = np.column_stack((speed / 2.0, shown * current, torque))
    path = written(tmp_path / "scaled.csv", rows, "speed_rad/s,current_A,torque_Nm")
    made = analyzed(capsys, 1, short_circuit(path, pole_pairs=2.0, flux_linkage=linked * flux, json=True))
    assert "near √2, the currents are rms" in json.dumps(made["withheld"]["d_axis_inductance"], ensure_ascii=False)


def test_efficiency_knows_what_the_rows_share(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(
        tmp_path / "load.csv", np.array([[10.0, 1500.0, 1700.0], [10.0, 1500.0, 1000.0]]), "torque_Nm,speed_rpm,power_W"
    )
    made = analyzed(capsys, 0, efficiency(path, torque_gain=0.2, power_gain=0.1, json=True))
    good, bad = made["details"]["load_points"]
    assert good["efficiency"]["value"] == pytest.approx(10.0 * 1500.0 * np.pi / 30.0 / 1700.0)
    half = 0.5 * np.ptp(good["loss"]["coverage_interval"])
    assert 1.7 * 0.5 < half < 1570.8 * 0.002 + 1.7
    assert "come out of" in bad["refused"]
    # What makes one row impossible is in the others too.
    assert [warning["id"] for warning in made["warnings"]] == ["", "above-one"]
