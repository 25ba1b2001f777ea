"""A shaft's sensor whose readings sometimes come as zeros."""

import pytest

from bench.motor.shipped_motors import motor_content


@pytest.mark.parametrize("seed", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_zeros_among_the_readings_end_no_procedure_and_are_told(motorbench, tmp_path, seed):
    disturbances = tmp_path / "disturbances.toml"
    disturbances.write_text("[dynamometer]\ndropouts = 0.02\n", encoding="utf-8")
    status, given = motorbench(
        "run", "inertia", "torque-constant", "--set", "torque-constant.winding_temperature=25", "--station", "virtual",
        "--motor", "lg-400w", "--seed", str(seed), "--disturbances", str(disturbances),
    )  # fmt: skip
    assert status == 0, given.get("cause")
    assert "dropouts" in {w["id"] for w in given["warnings"]}
    for name in ("inertia", "coulomb_friction", "torque_constant"):
        parameter = given["parameters"][name]
        low, high = parameter["coverage_interval"]
        assert low <= parameter["truth"] <= high, (name, parameter["value"], parameter["truth"])
    # What comes as zeros with the speed is in no torque: the friction is known as well as without.
    friction = given["parameters"]["coulomb_friction"]
    assert friction["standard_uncertainty"] < 0.01 * friction["value"]
    inertia = given["parameters"]["inertia"]
    assert inertia["note_value"] == pytest.approx(inertia["truth"], rel=0.15)


@pytest.mark.slow
def test_a_map_reads_the_shaft_again_where_nothing_but_zeros_came(motorbench, tmp_path):
    disturbances, motor = tmp_path / "disturbances.toml", tmp_path / "motor.toml"
    disturbances.write_text("[dynamometer]\ndropouts = 0.05\n", encoding="utf-8")
    _, content, _ = motor_content("lg-400w")
    motor.write_text(content.decode().replace("[nameplate]\n", "[nameplate]\npole_pairs = 4\n", 1), encoding="utf-8")
    status, given = motorbench(
        "run", "flux-map", "--set", "locations=12", "--station", "virtual", "--motor", str(motor), "--seed", "5",
        "--disturbances", str(disturbances),
    )  # fmt: skip
    assert status == 0, given.get("cause")
    assert "dynamometer-limit" not in {w["id"] for w in given["warnings"]}
