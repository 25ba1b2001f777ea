"""A run says what its instruments cannot give before it energises anything."""

import json
from pathlib import Path

import pytest

from bench.motor.shipped_motors import motor_content


@pytest.fixture
def expecting(tmp_path):
    """Return the 400 W motor's file with type values."""

    def make(values: str) -> str:
        path = tmp_path / "motor.toml"
        _, content, _ = motor_content("lg-400w")
        path.write_text(content.decode() + f"\n[expected]\n{values}\n", encoding="utf-8")
        return str(path)

    return make


def test_the_bridge_at_32_milliohms(motorbench, expecting):
    motor = expecting("stator_resistance = 0.016\nd_axis_inductance = 73e-6\nq_axis_inductance = 76e-6")
    status, given = motorbench(
        "run",
        "pole-pairs-static",
        "stator-resistance",
        "stator-resistance-dc",
        "--station",
        "virtual",
        "--motor",
        motor,
    )
    assert status == 0
    first = given["warnings"][0]
    assert (first["id"], first["procedure"]) == ("cannot-support", "stator-resistance")
    for part in ("E4980A", "at 20 Hz on 32 mΩ", "can give 5.8 %", "1 % is asked for", "stator-resistance-dc"):
        assert part in first["message"]
    events = [json.loads(line) for line in (Path(given["run"]) / "journal.jsonl").read_bytes().splitlines()]
    kinds = [event["kind"] for event in events]
    # Asked for its accuracy, not set, and long before anything is switched on.
    assert kinds[: kinds.index("procedure_started")] == ["run_started", "instrument_opened", "known_before"]
    assert kinds.index("known_before") < kinds.index("energising")
    # What it foretold came true, and what it named does it.
    ways = {
        p["procedure"]: p
        for p in (given["parameters"]["stator_resistance"], *given["parameters"]["stator_resistance"]["alternatives"])
    }
    relative = {name: p["standard_uncertainty"] / p["value"] for name, p in ways.items()}
    assert relative["stator-resistance"] == pytest.approx(0.058, rel=0.02)
    assert relative["stator-resistance-dc"] < 0.01


def test_the_bridge_at_a_few_microhenries(motorbench, expecting):
    motor = expecting("stator_resistance = 0.016\nd_axis_inductance = 2e-6")
    names = ("dq-inductance-extremes", "dq-inductance-aligned")
    _, given = motorbench("run", *names, "--station", "virtual", "--motor", motor)
    foretold = {w["procedure"]: w["message"] for w in given["warnings"] if w["id"] == "cannot-support"}
    assert set(foretold) == set(names)
    assert "at 1000 Hz on 4 µH can give" in foretold["dq-inductance-extremes"]
    assert "at 1000 Hz on 3 µH can give" in foretold["dq-inductance-aligned"]
    assert "test at 2000 Hz instead" in foretold["dq-inductance-extremes"]
    assert "test at 5000 Hz instead" in foretold["dq-inductance-aligned"]


def test_a_bridge_that_can_is_not_warned_of(motorbench, expecting):
    motor = expecting("stator_resistance = 0.016")
    _, given = motorbench(
        "run", "stator-resistance", "--station", "virtual", "--motor", motor, "--set", "requested_uncertainty=0.1"
    )
    assert "cannot-support" not in {warning["id"] for warning in given["warnings"]}


def test_without_type_values_no_instrument_is_asked(motorbench):
    _, given = motorbench("run", "nameplate", "stator-resistance", "--station", "virtual", "--motor", "lg-400w")
    assert "cannot-support" not in {warning["id"] for warning in given["warnings"]}
    events = [json.loads(line)["kind"] for line in (Path(given["run"]) / "journal.jsonl").read_bytes().splitlines()]
    assert events[1] == "procedure_started"
