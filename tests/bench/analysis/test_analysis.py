import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.analysis import analyze_back_emf, analyze_coast_down, analyze_rotor_sweep, analyze_step_response
from bench.captures import CaptureError
from bench.i18n.errors import UsageError
from procedures.estimation.winding.connections import ReadingConnection
from tests.studies.worlds import simulated as sim


def table(folder: Path, heading: str, *columns: np.ndarray, name: str = "record.csv") -> Path:
    path = folder / name
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=heading, comments="", fmt="%.9g")
    return path


def within(parameter: dict[str, Any], truth: float, times: float = 4.0) -> bool:
    return abs(parameter["value"] - truth) <= times * parameter["standard_uncertainty"]


def test_results_have_the_shape_of_json(tmp_path: Path) -> None:
    time, v = sim.emf_record(np.random.default_rng(1))
    found = analyze_back_emf(table(tmp_path, "t (s),a (V),b (V),c (V)", time, *v), connection="phase", pole_pairs=4)
    assert set(found) == {"parameters", "withheld", "misfit", "assumptions", "warnings", "details"}
    assert json.loads(json.dumps(found)) == found
    for parameter in found["parameters"].values():
        assert {"value", "unit", "standard_uncertainty", "coverage_interval", "procedure", "section"} <= set(parameter)
        assert parameter["coverage_interval"][0] <= parameter["value"] <= parameter["coverage_interval"][1]


def test_back_emf_of_phase_and_of_line_voltages(tmp_path: Path) -> None:
    time, v = sim.emf_record(np.random.default_rng(1))
    phase = analyze_back_emf(table(tmp_path, "t (s),a (V),b (V),c (V)", time, *v), connection="phase", pole_pairs=4)
    assert within(phase["parameters"]["flux_linkage"], sim.FLUX)
    assert within(phase["parameters"]["back_emf_constant_mechanical"], 4 * sim.FLUX)
    assert within(phase["parameters"]["torque_constant"], 6 * sim.FLUX)
    assert phase["details"]["mechanical_speed_rpm"] == pytest.approx(60 * 53 / 4, rel=1e-3)
    assert [w["id"] for w in phase["warnings"]] == ["E4"]
    lines = v - np.roll(v, -1, axis=0)
    line = analyze_back_emf(table(tmp_path, "t (s),ab (V),bc (V),ca (V)", time, *lines))
    assert within(line["parameters"]["flux_linkage"], sim.FLUX, 5)
    assert any("√3" in note for note in line["assumptions"])
    assert any("pole pairs not given" in note for note in line["assumptions"])
    assert "torque_constant" not in line["parameters"]


def test_back_emf_finds_pole_pairs_from_the_speed(tmp_path: Path) -> None:
    time, v = sim.emf_record(np.random.default_rng(1))
    path = table(tmp_path, "t (s),a (V)", time, v[0])
    found = analyze_back_emf(path, connection="phase", speed_rpm=796.0)
    assert found["parameters"]["pole_pairs"]["value"] == 4
    assert "back_emf_constant_mechanical" in found["parameters"]
    unsure = analyze_back_emf(path, connection="phase", speed_rpm=708.0)
    assert set(unsure["withheld"]) == {"pole_pairs", "back_emf_constant_mechanical", "torque_constant"}
    assert "from 4 to 5" in unsure["withheld"]["pole_pairs"]["message"]
    assert "flux_linkage" in unsure["parameters"]
    assert "mechanical_speed_rpm" not in unsure["details"]
    doubtful = analyze_back_emf(path, connection="phase", speed_rpm=708.0, pole_pairs=4)
    assert any("4.4" in w["text"] or "4.5" in w["text"] for w in doubtful["warnings"])
    with pytest.raises(CaptureError, match="speed = 0 rpm"):
        analyze_back_emf(path, speed_rpm=0.0)


def test_back_emf_says_what_looks_wrong(tmp_path: Path) -> None:
    time, v = sim.emf_record(np.random.default_rng(1))
    v[2] *= -0.1
    texts = " ".join(
        w["text"]
        for w in analyze_back_emf(table(tmp_path, "t (s),a (V),b (V),c (V)", time, *v), connection="line")["warnings"]
    )
    assert "channel c shows 0.0999 times the value of the other channels" in texts
    assert "instead of ±120°" in texts
    with pytest.raises(CaptureError, match=r"record\.csv: the record holds no whole period"):
        analyze_back_emf(table(tmp_path, "t (s),a (V)", time[:200], v[0, :200]))
    with pytest.raises(CaptureError, match="is in A; a back-EMF needs voltages"):
        analyze_back_emf(table(tmp_path, "t (s),a (A)", time, v[0]))
    with pytest.raises(CaptureError, match="'star' is not known"):
        analyze_back_emf(tmp_path / "record.csv", connection="star")  # type: ignore[arg-type]


def test_channels_named_as_phases_are_not_taken_for_lines(tmp_path: Path) -> None:
    time, v = sim.emf_record(np.random.default_rng(1))
    path = table(tmp_path, "t (s),U (V),V (V),W (V)", time, *v)
    with pytest.raises(UsageError, match="channels are named U, V, W, like phases"):
        analyze_back_emf(path)
    line, phase = (
        analyze_back_emf(path, connection=each)["parameters"]["flux_linkage"]["value"] for each in ("line", "phase")
    )
    assert phase == pytest.approx(math.sqrt(3.0) * line)


def test_a_speed_that_is_not_the_records_is_told(tmp_path: Path) -> None:
    time, v = sim.emf_record(np.random.default_rng(1))
    path = table(tmp_path, "t (s),ab (V)", time, v[0])
    frequency = analyze_back_emf(path)["parameters"]["electrical_frequency"]["value"]
    for off, told in ((1.0, False), (1.03, True)):
        found = analyze_back_emf(path, pole_pairs=4, speed_rpm=off * 60.0 * frequency / 4)
        assert told == any("rpm was given" in warning["text"] for warning in found["warnings"])


def test_step_response_gives_loop_and_phase(tmp_path: Path) -> None:
    time, v, i, _, _ = sim.step_record(np.random.default_rng(1), 8)
    path = table(tmp_path, "t (s),u (V),i (A)", time, v, i)
    found = analyze_step_response(path, axis="d")
    parameters = found["parameters"]
    assert within(parameters["loop_inductance"], sim.L)
    assert within(parameters["loop_resistance"], sim.R)
    assert within(parameters["d_axis_inductance"], 2 / 3 * sim.L)
    assert "stator_resistance" not in parameters
    assert [w["id"] for w in found["warnings"]] == ["E10"]
    slow = analyze_step_response(table(tmp_path, "t (s),u (V),i (A)", 1e3 * time, v, i, name="slow.csv"))
    assert [w["id"] for w in slow["warnings"]] == ["E10", "long-time-constant"]
    assert found["details"]["note_time_constant_63"] == pytest.approx(sim.TAU, rel=0.1)
    delta = analyze_step_response(path, connection="delta", reading=ReadingConnection.LINE_TO_LINE)
    assert within(delta["parameters"]["inductance"], sim.L / 2)
    assert delta["parameters"]["inductance"]["winding"] == pytest.approx(1.5 * sim.L, rel=5e-3)


def test_step_response_says_what_it_cannot_tell(tmp_path: Path) -> None:
    time, v, i, _, _ = sim.step_record(np.random.default_rng(1), 8)
    unnamed = analyze_step_response(table(tmp_path, "t,x,y", time, v, i))
    assert any("voltage is 'x'" in note for note in unnamed["assumptions"])
    with pytest.raises(CaptureError, match="none of the columns could be the current"):
        analyze_step_response(table(tmp_path, "t (s),x (V),y (N·m)", time, v, i))
    with pytest.raises(CaptureError, match="several of the columns could be the voltage"):
        analyze_step_response(table(tmp_path, "t (s),x (V),y (V),z (A)", time, v, v, i))
    with pytest.raises(CaptureError, match=r"record\.csv: .* reverse the current probe"):
        analyze_step_response(table(tmp_path, "t (s),x (V),y (A)", time, v, -i))
    with pytest.raises(CaptureError, match="no star point"):
        analyze_step_response(tmp_path / "record.csv", connection="delta", reading="phase")
    with pytest.raises(CaptureError, match="connection 'delta' is not known; allowed are line"):
        analyze_step_response(tmp_path / "record.csv", reading="delta")


def test_coast_down_alone_with_inertia_and_with_a_driven_ramp(tmp_path: Path) -> None:
    up, down = sim.ramps(np.random.default_rng(1))
    coast = table(tmp_path, "t (s),speed (rpm)", down.time, down.speed * 30 / np.pi)
    alone = analyze_coast_down(coast)
    assert within(alone["parameters"]["coulomb_deceleration"], sim.COULOMB / sim.INERTIA)
    assert any("ratio of friction to inertia" in w["text"] for w in alone["warnings"])
    known = analyze_coast_down(coast, inertia=sim.INERTIA, inertia_uncertainty=1e-6)
    assert within(known["parameters"]["coulomb_friction"], sim.COULOMB)
    assert known["parameters"]["coulomb_friction"]["standard_uncertainty"] > 0.009 * sim.COULOMB
    driven = table(tmp_path, "t (s),speed (rad/s)", up.time, up.speed, name="up.csv")
    both = analyze_coast_down([driven, coast], torque=sim.TORQUE)
    assert within(both["parameters"]["inertia"], sim.INERTIA)
    assert within(both["parameters"]["viscous_friction"], sim.VISCOUS)
    with pytest.raises(CaptureError, match="not above zero"):
        analyze_coast_down(coast, inertia=-1.0)


def test_coast_down_record_with_a_torque_column_is_parted_where_the_drive_lets_go(tmp_path: Path) -> None:
    up, down = sim.ramps(np.random.default_rng(1))
    time = np.concatenate((up.time, up.time[-1] + 1e-3 + down.time))
    torque = np.where(np.arange(time.size) < up.time.size, sim.TORQUE, 0.0)
    path = table(tmp_path, "time (s),omega (rad/s),torque (N·m)", time, np.concatenate((up.speed, down.speed)), torque)
    found = analyze_coast_down(path)
    assert found["details"]["ramps"] == 2
    assert within(found["parameters"]["inertia"], sim.INERTIA)
    assert within(found["parameters"]["coulomb_friction"], sim.COULOMB)
    assert [w["id"] for w in found["warnings"]] == ["E6"]


def test_coast_down_refuses_a_rising_speed(tmp_path: Path) -> None:
    up, _ = sim.ramps(np.random.default_rng(1))
    with pytest.raises(CaptureError, match=r"record\.csv: the speed does not fall"):
        analyze_coast_down(table(tmp_path, "t (s),speed (rad/s)", up.time, up.speed))


def test_rotor_sweep_over_angle_and_over_time(tmp_path: Path) -> None:
    at, readings = sim.sweep_record(np.random.default_rng(1))
    by_angle = analyze_rotor_sweep(table(tmp_path, "angle (deg),L (uH)", 360 * at, readings * 1e6))
    assert within(by_angle["parameters"]["d_axis_inductance"], sim.LD)
    assert within(by_angle["parameters"]["q_axis_inductance"], sim.LQ)
    assert by_angle["details"]["motor_class"] == "IPMSM"
    joined = table(tmp_path, "angle (deg),L (uH)", 360 * at, 0.75 * readings * 1e6, name="joined.csv")
    between = analyze_rotor_sweep(joined, reading="series-parallel")
    assert within(between["parameters"]["d_axis_inductance"], sim.LD)
    assert "to the other two joined" in " ".join(between["assumptions"])
    with pytest.raises(CaptureError, match="'phase' is not known here"):
        analyze_rotor_sweep(joined, reading="phase")  # type: ignore[arg-type]
    at, readings = sim.sweep_record(np.random.default_rng(1), wobble=0.2, turns=4)
    by_time = analyze_rotor_sweep(table(tmp_path, "time (s),L (H)", 20 * at, readings), connection="delta")
    assert within(by_time["parameters"]["d_axis_inductance"], sim.LD)
    winding = by_time["parameters"]["d_axis_inductance"]["winding"]
    assert winding == pytest.approx(3 * by_time["parameters"]["d_axis_inductance"]["value"])


def test_rotor_sweep_reports_a_small_saliency_against_the_notes_rule(tmp_path: Path) -> None:
    at = np.linspace(0, 2 * np.pi, 100)
    readings = 149.5e-6 - 3.5e-6 * np.cos(8 * at) + np.random.default_rng(1).normal(0, 0.2e-6, 100)
    small = analyze_rotor_sweep(table(tmp_path, "angle (rad),L (H)", at, readings), pole_pairs=4)
    assert small["details"]["motor_class"] == "SPMSM"
    assert small["parameters"]["q_axis_inductance"]["value"] == pytest.approx(76.5e-6, rel=2e-3)
    assert [w["id"] for w in small["warnings"]] == ["E3"]
    flat = 149.5e-6 + np.random.default_rng(1).normal(0, 0.2e-6, 100)
    none = analyze_rotor_sweep(table(tmp_path, "angle (rad),L (H)", at, flat), pole_pairs=4)
    assert none["parameters"]["d_axis_inductance"]["value"] == none["parameters"]["q_axis_inductance"]["value"]
    with pytest.raises(CaptureError, match="is in V; inductances in H"):
        analyze_rotor_sweep(table(tmp_path, "angle (rad),L (V)", at, flat))
