"""The step response where the supply, the probe or the screen is at its limit."""

from pathlib import Path

import pytest

LG = (Path(__file__).parents[2] / "bench" / "motors" / "lg-400w.toml").read_text(encoding="utf-8")


def motor_file(folder, rated_current, **virtual):
    """Write the shipped motor with another rated current and other virtual values, and return the path."""
    lines = []
    for line in LG.splitlines():
        name = line.split(" ")[0]
        if name == "rated_current":
            lines.append(f"rated_current = {rated_current}")
        elif name == "maximum_current":
            lines.append(f"maximum_current = {2 * rated_current}")
        elif name not in virtual:
            lines.append(line)
    path = folder / "motor.toml"
    path.write_text("\n".join([*lines, *(f"{name} = {value}" for name, value in virtual.items())]), encoding="utf-8")
    return path


#: Rated current (A), virtual values, and the largest relative standard uncertainty. Two channels of 2 % of full scale each
#: leave 1.8 % where the step fills its screens, and more where the smallest range (8 mV) is too wide for it.
CASES = {
    # 20 mA: the probe's noise is a tenth of the step, and what the eye calls 63 % is a spike of it.
    "small current": (
        0.215,
        {"phase_resistance": [12.2] * 3, "d_axis_inductance": 32.3e-3, "q_axis_inductance": 56.3e-3},
        0.04,
    ),
    # 2.6 mV: less than the supply's zero may be off.
    "small voltage": (
        1.46,
        {"phase_resistance": [0.012] * 3, "d_axis_inductance": 20.8e-6, "q_axis_inductance": 23.6e-6},
        0.06,
    ),
    # The current follows within a five-hundredth of the first guess of the record.
    "quick": (
        0.15,
        {"phase_resistance": [17.5] * 3, "d_axis_inductance": 1.49e-3, "q_axis_inductance": 3.48e-3},
        0.045,
    ),
    # The rated current is more than the supply gives.
    "large current": (19.5, {"phase_resistance": [0.0354] * 3}, 0.02),
}


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=pytest.mark.slow if "current" in case else ()) for case in CASES]
)
def test_both_axes_hold_the_truth(motorbench, tmp_path, case):
    rated, virtual, largest = CASES[case]
    motor = motor_file(tmp_path, rated, coulomb_friction=1e-4 * rated, cogging_torque=0.0, **virtual)
    status, given = motorbench("run", "dq-inductance-time-constant", "--station", "virtual", "--motor", str(motor))
    assert status == 0, given.get("cause")
    for name in ("d_axis_inductance", "q_axis_inductance"):
        parameter = given["parameters"][name]
        low, high = parameter["coverage_interval"]
        assert low <= parameter["truth"] <= high, (name, parameter["value"], parameter["truth"])
        assert parameter["standard_uncertainty"] < largest * parameter["value"]
    assert ("raised-step" in {w["id"] for w in given["warnings"]}) == (case == "small voltage")


def test_the_bridges_resistance_is_told_once_for_both_axes(motorbench):
    _, given = motorbench(
        "run", "stator-resistance", "dq-inductance-time-constant", "--station", "virtual", "--motor", "lg-400w"
    )
    (said,) = [w["message"] for w in given["warnings"] if w["id"] == "E10"]
    assert "Ld and Lq" in said


#: At the rated current two phases in a row take twice what the supply's output can give.
_TOO_FEW_VOLTS = (0.6, {"phase_resistance": [8.0] * 3, "d_axis_inductance": 2e-3, "q_axis_inductance": 3e-3})


@pytest.mark.parametrize("method", ["dq-inductance-aligned", "dq-inductance-time-constant", "stator-resistance-dc"])
def test_a_supply_of_too_few_volts_for_the_rated_current(motorbench, tmp_path, method):
    rated, virtual = _TOO_FEW_VOLTS
    motor = motor_file(tmp_path, rated, coulomb_friction=1e-4 * rated, cogging_torque=0.0, **virtual)
    share = ("--set", "stator-resistance-dc.current_share=1.0") if method == "stator-resistance-dc" else ()
    status, given = motorbench(
        "run", "stator-resistance", method, *share, "--station", "virtual", "--motor", str(motor)
    )
    assert status == 0, given.get("cause")
    assert "supply-voltage" in {w["id"] for w in given["warnings"]}
    for parameter in given["parameters"].values():
        low, high = parameter["coverage_interval"]
        assert low <= parameter["truth"] <= high, (method, parameter["value"], parameter["truth"])


def test_too_few_volts_for_an_unknown_winding_are_named(motorbench, tmp_path):
    rated, virtual = _TOO_FEW_VOLTS
    motor = motor_file(tmp_path, rated, cogging_torque=0.0, **virtual)
    status, given = motorbench("run", "dq-inductance-aligned", "--station", "virtual", "--motor", str(motor))
    assert status != 0
    assert "its highest voltage: the loop has 12 Ω" in given["cause"]


@pytest.mark.slow
def test_hum_of_a_third_of_a_small_step_is_no_missing_baseline(motorbench, tmp_path):
    disturbances = tmp_path / "disturbances.toml"
    disturbances.write_text("[channels.1]\nhum = 0.02\nhum_frequency = 50\n", encoding="utf-8")
    status, given = motorbench(
        "run", "dq-inductance-time-constant", "--station", "virtual", "--motor", "lg-400w", "--disturbances",
        str(disturbances),
    )  # fmt: skip
    assert status == 0, given.get("cause")
    assert "hum" in {w["id"] for w in given["warnings"]}
    for name in ("d_axis_inductance", "q_axis_inductance"):
        parameter = given["parameters"][name]
        low, high = parameter["coverage_interval"]
        assert low <= parameter["truth"] <= high
