"""The balance of the windings on the virtual bench: a winding's defect is found, and the bridge's own errors are not."""

import pytest

from bench.motor.shipped_motors import motor_content

RUN = ("--station", "virtual", "--seed", "4")


@pytest.fixture
def altered(tmp_path):
    """Return a shipped motor's file with one text replaced by another."""

    def make(name: str, old: str, new: str) -> str:
        _, content, _ = motor_content(name)
        assert old in content.decode()
        path = tmp_path / f"{name}.toml"
        path.write_text(content.decode().replace(old, new), encoding="utf-8")
        return str(path)

    return make


def within(parameter, truth, multiple=3.0):
    return abs(parameter["value"] - truth) <= multiple * parameter["standard_uncertainty"]


@pytest.mark.parametrize("motor", ["lg-400w", "outrunner-delta", "gimbal"])
def test_it_holds_the_truth(motorbench, motor):
    status, given = motorbench("run", "winding-balance", "--motor", motor, *RUN)
    assert status == 0, given
    found = given["parameters"]["resistance_unbalance"]
    assert found["unit"] == "%"
    assert within(found, found["truth"])


@pytest.mark.parametrize(("contact", "given"), [(0.02, True), (0.3, False)])
def test_contacts_that_differ_are_no_unbalance(motorbench, tmp_path, contact, given):
    file = tmp_path / "contacts.toml"
    file.write_text(f"[contacts]\nresistance = {contact}\n", encoding="utf-8")
    _, found = motorbench("run", "winding-balance", "--motor", "gimbal", "--disturbances", str(file), *RUN)
    assert "contact" in {warning["id"] for warning in found["warnings"]}
    assert ("resistance_unbalance" in found["parameters"]) is given
    if given:
        assert within(found["parameters"]["resistance_unbalance"], found["parameters"]["resistance_unbalance"]["truth"])


def test_a_contact_in_the_line_that_differs_most_is_seen_where_the_first_line_came_out_alike(motorbench, tmp_path):
    file = tmp_path / "contacts.toml"
    file.write_text("[contacts]\nresistance = 0.005\n", encoding="utf-8")
    arguments = ("--motor", "ipmsm", "--disturbances", str(file), *RUN[:2], "--seed", "5")
    status, found = motorbench("run", "winding-balance", *arguments)
    changes = found["procedures"]["winding-balance"]["findings"]["read_again"]
    assert abs(changes["AB"]["change"]) < 0.002 < abs(changes["CA"]["change"])
    assert (status, "resistance_unbalance" in found["withheld"]) == (1, True)


def test_a_phase_of_more_resistance_is_found_and_named(motorbench, altered):
    motor = altered("lg-400w", "[0.0163, 0.0159, 0.0158]", "[0.0160, 0.0180, 0.0160]")
    _, given = motorbench("run", "winding-balance", "--motor", motor, *RUN[:2], "--seed", "3")
    found, findings = given["parameters"]["resistance_unbalance"], given["procedures"]["winding-balance"]["findings"]
    assert found["truth"] == pytest.approx(4.0)
    assert within(found, 4.0)
    # The bridge at 20 Hz knows this resistance to 10 %, and its differences to a hundredth of that.
    assert found["standard_uncertainty"] < 0.3
    assert findings["resistance_unbalance_line"] == "CA"
    phases = findings["phase_resistances"]
    assert max(phases, key=phases.get) == "B"


def test_the_rotor_s_saliency_is_no_defect(motorbench, altered):
    motor = altered(
        "lg-400w", "[virtual]", "[expected]\nd_axis_inductance = 73e-6\nq_axis_inductance = 76.5e-6\n\n[virtual]"
    )
    _, given = motorbench("run", "winding-balance", "--motor", motor, *RUN)
    found = given["parameters"]["inductance_unbalance"]
    assert within(found, 0.0)
    assert found["value"] <= 2.35
    assert "the rotor's saliency" in {row["source"] for row in found["budget"]}
    assert given["warnings"] == []


def test_without_anything_known_of_the_saliency_it_says_so(motorbench):
    _, given = motorbench("run", "winding-balance", "--motor", "ipmsm", *RUN)
    assert "saliency" in {warning["id"] for warning in given["warnings"]}
