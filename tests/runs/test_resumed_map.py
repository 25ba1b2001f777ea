"""A flux map whose run was left and is gone on with: colder, another zero of the angle, and what was read before counts."""

import numpy as np
import pytest

from bench.analysis.load_tables import analyze_run_map
from bench.journal.run_folder import RunFolder
from bench.journal.verification import Integrity
from bench.journal.verify import verify
from drivers.mjbots.inverter import MjbotsMoteus
from tests.runs.test_aborted_maps import ROTATION, motor, off_by, run_of, strikes

__all__ = ["motor"]


def gone_on_with(motorbench, tmp_path, folder, inverter="", *more):
    """Go on with a run on a bench whose inverter has other errors by now; the virtual motor is cold again."""
    given = ()
    if inverter:
        (tmp_path / "now.toml").write_text(f"[inverter]\n{inverter}\n")
        given = ("--disturbances", str(tmp_path / "now.toml"))
    return motorbench("run", "--resume", str(folder), "--operator", "virtual", *given, *more)


def left_at(motorbench, motor, tmp_path, monkeypatch, at, *settings):
    with monkeypatch.context() as patched:
        strikes(patched, MjbotsMoteus, "measure_dq", at, KeyboardInterrupt())
        status, _, folder = run_of(motorbench, motor, tmp_path, "flux-map", *(settings or ROTATION))
    assert status == 1
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(("at", "sessions"), [(10, 1), (22, 2), (34, 2)])
def test_what_was_read_before_counts(motorbench, motor, tmp_path, monkeypatch, at, sessions):
    folder = left_at(motorbench, motor, tmp_path, monkeypatch, at)
    calls = strikes(monkeypatch, MjbotsMoteus, "measure_dq", 0, KeyboardInterrupt())
    status, result = gone_on_with(motorbench, tmp_path, folder, "angle_error = 0.03")
    assert status == 0, result
    made = result["procedures"]["flux-map"]
    assert made["status"] == "completed"
    assert not [warning for warning in made["warnings"] if warning["id"] == "sessions-contradict"]
    assert len(made["findings"].get("sessions", [0])) == sessions
    if sessions > 1:
        # What is tied anew costs less than what was read before saves.
        assert len(calls) < made["findings"]["readings"] - 0.5 * at
        first, second = made["findings"]["sessions"]
        turned = second["angle"]["value"] - first["angle"]["value"]
        assert abs(turned) == pytest.approx(0.03, abs=3e-3)
        rows = result["parameters"]["mtpa_torque"]["budget"]
        assert any("run's sessions" in row["source"] for row in rows)
    off, uncertainty, scale = off_by(folder, motor)
    assert len(off) >= made["findings"]["locations"]
    assert np.all(np.abs(off) <= 3.0 * uncertainty + 1e-12)
    assert np.abs(off).max() < 0.01 * scale
    assert verify(RunFolder(folder)).verdict is Integrity.UNTOUCHED
    # What the journal gives is what the run has given.
    _, table = analyze_run_map(folder, pole_pairs=4)
    assert table["psi_d_Vs"] == pytest.approx(made["findings"]["tables"]["flux_map.csv"]["psi_d_Vs"], rel=1e-6)


@pytest.mark.slow
def test_a_session_that_contradicts_is_said_and_all_is_read_anew(motorbench, motor, tmp_path, monkeypatch):
    folder = left_at(motorbench, motor, tmp_path, monkeypatch, 30)
    # Beyond any stated limit: a drive that shows 6 % too much current is another drive.
    status, result = gone_on_with(motorbench, tmp_path, folder, "current_gain = 0.06")
    made = result["procedures"]["flux-map"]
    assert status == 0, result
    (said,) = (warning for warning in made["warnings"] if warning["id"] == "sessions-contradict")
    assert "was read again" in said["message"]
    assert "sessions" not in made["findings"]
    points = len(made["findings"]["tables"]["flux_map.csv"]["id_A"])
    assert points >= made["findings"]["locations"]


@pytest.mark.slow
def test_three_sessions_and_one_that_ties_nothing(motorbench, motor, tmp_path, monkeypatch):
    folder = left_at(motorbench, motor, tmp_path, monkeypatch, 20)
    with monkeypatch.context() as patched:
        strikes(patched, MjbotsMoteus, "measure_dq", 4, KeyboardInterrupt())
        status, result = gone_on_with(motorbench, tmp_path, folder, "angle_error = 0.02")
        assert status == 1
        assert "sessions" not in result["procedures"]["flux-map"]["findings"]
    status, result = gone_on_with(motorbench, tmp_path, folder, "angle_error = -0.02")
    assert status == 0, result
    assert len(result["procedures"]["flux-map"]["findings"]["sessions"]) == 2
    off, uncertainty, _ = off_by(folder, motor)
    assert np.all(np.abs(off) <= 3.0 * uncertainty + 1e-12)


@pytest.mark.slow
def test_it_is_read_anew_where_that_is_asked_for(motorbench, motor, tmp_path, monkeypatch):
    folder = left_at(motorbench, motor, tmp_path, monkeypatch, 30)
    status, result = gone_on_with(motorbench, tmp_path, folder, "", "--repeat", "flux-map")
    assert status == 0
    assert "sessions" not in result["procedures"]["flux-map"]["findings"]


@pytest.mark.slow
def test_what_the_shafts_torque_contradicts_is_said_of_the_journal_too(motorbench, motor, tmp_path):
    (tmp_path / "gain.toml").write_text("[inverter]\ncurrent_gain = 0.1\n")
    _, result = motorbench(
        "run", "flux-map", "--station", "virtual", "--operator", "virtual", "--motor", str(motor),
        "--set", "flux-map.locations=20", "--disturbances", str(tmp_path / "gain.toml"),
    )  # fmt: skip
    (folder,) = (tmp_path / "runs").iterdir()
    made = result["procedures"]["flux-map"]
    (told,) = (warning for warning in made["warnings"] if warning["id"] == "torque-differs")
    again, table = analyze_run_map(folder)
    assert [warning["text"] for warning in again["warnings"] if warning["id"] == "torque-differs"] == [told["message"]]
    assert table["u_psi_d_Vs"] == pytest.approx(made["findings"]["tables"]["flux_map.csv"]["u_psi_d_Vs"], rel=1e-6)
    # Other pole pairs contradict more, and widen more.
    _, wider = analyze_run_map(folder, pole_pairs=8)
    assert np.median(wider["u_psi_d_Vs"]) > 2.0 * np.median(table["u_psi_d_Vs"])
