"""A torque transducer that shows what the shaft does not follow: shafts out of line, and the floor's vibration."""

import pytest


@pytest.mark.parametrize(("disturbed", "told"), [("torque_runout = 0.003", True), ("vibration = 0.003", False)])
def test_inertia_and_friction_are_held(motorbench, tmp_path, disturbed, told):
    disturbances = tmp_path / "disturbances.toml"
    disturbances.write_text(f"[dynamometer]\n{disturbed}\n", encoding="utf-8")
    status, given = motorbench(
        "run", "inertia", "--station", "virtual", "--motor", "lg-400w", "--seed", "4", "--disturbances", str(disturbances),
    )  # fmt: skip
    assert status == 0, given.get("cause")
    assert ("eccentricity" in {w["id"] for w in given["warnings"]}) is told
    for name in ("inertia", "coulomb_friction", "viscous_friction"):
        parameter = given["parameters"][name]
        low, high = parameter["coverage_interval"]
        assert low <= parameter["truth"] <= high, (name, parameter["value"], parameter["truth"])
        assert parameter["standard_uncertainty"] < 0.2 * parameter["value"]
