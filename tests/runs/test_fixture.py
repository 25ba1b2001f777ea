"""A fixture in place of hands: the same procedures give the same figures, and what it cannot do is said."""

import json
from pathlib import Path

import pytest

PLAN = (
    "pole-pairs-static",
    "stator-resistance-dc",
    "dq-inductance-aligned",
    "dq-inductance-extremes",
    "back-emf-constant",
)
MEASURED = (
    "pole_pairs",
    "stator_resistance",
    "d_axis_inductance",
    "q_axis_inductance",
    "flux_linkage",
    "back_emf_constant_mechanical",
)


def by_fixture(motorbench, *plan, motor="lg-400w", more=()):
    return motorbench("run", *plan, "--station", "virtual", "--motor", motor, "--operator", "fixture", *more)


def events(given):
    lines = (Path(given["run"]) / "journal.jsonl").read_text(encoding="utf-8").splitlines()
    return [{"kind": read["kind"], **read["data"]} for read in map(json.loads, lines)]


@pytest.mark.slow
@pytest.mark.parametrize("motor", ["lg-400w", "outrunner-delta"])
def test_every_figure_holds_the_truth(motorbench, motor):
    status, given = by_fixture(motorbench, *PLAN, motor=motor)
    assert status == 0, given.get("cause")
    parameters = given["parameters"]
    for name in MEASURED:
        truth = parameters[name]["truth"]
        for figure in (parameters[name], *parameters[name]["alternatives"]):
            allowed = 3.0 * figure["standard_uncertainty"] + 1e-9 * abs(truth)
            assert abs(figure["value"] - truth) <= allowed, (name, figure["procedure"], figure["value"], truth)


@pytest.fixture(scope="module")
def told(motorbench_once):
    status, given = by_fixture(motorbench_once, "pole-pairs-static", "stator-resistance-dc")
    assert status == 0, given.get("cause")
    return events(given)


def test_the_journal_tells_what_the_fixture_did(told):
    asked = [event for event in told if event["kind"] == "action"]
    assert {event["action"] for event in asked} >= {"ChangeSetup", "MarkRestPositions"}
    changes = [each["kind"] for event in asked for each in event["details"].get("changes", ())]
    assert {*changes} >= {"clear", "put on", "take off", "lock", "free"}
    connected = [event for event in told if event.get("call") == "connect"]
    assert ["A:supply+", "B:supply-", "C:supply-"] in [event["arguments"][0] for event in connected]
    moved = [event["kind"] for event in told if event.get("call") == "move_by"]
    assert moved[:2] == ["commanding", "setting"]


def test_no_relay_moves_under_power_and_all_open_last(told):
    feeding = 0
    for event in told:
        if event.get("instrument") == "supply":
            feeding += {"energising": 1, "de_energised": -1}.get(event["kind"], 0)
        assert event.get("call") != "connect" or feeding == 0
    safe = [(event["instrument"], event["item"], event["outcome"]) for event in told if event["kind"] == "made_safe"]
    assert safe[-1] == ("switch_matrix", "open", "safe")
    assert ("supply", "current_zero", "safe") in safe


RELAY = """
[[faults]]
fault = "stuck_relay"
crosspoint = "B:supply-"
closed = false
"""


def test_a_contact_that_the_unit_says_is_closed_is_found_by_measuring(motorbench, tmp_path):
    (tmp_path / "faults.toml").write_text(RELAY, encoding="utf-8")
    status, given = by_fixture(motorbench, "stator-resistance-dc", more=("--faults", str(tmp_path / "faults.toml")))
    assert status != 0
    assert "one of these is open (wire off, or phase broken)" in given["cause"]
    assert [event for event in events(given) if event["kind"] == "made_safe"][-1]["item"] == "open"


def test_what_a_fixture_cannot_put_right_ends_the_run(motorbench):
    status, given = by_fixture(motorbench, "stator-resistance-dc", more=("--fault", "open_phase terminal=A"))
    assert status != 0
    assert "Correct it and start again" in given["cause"]
    done = {event["action"]: event["given"] for event in events(given) if event["kind"] == "action_done"}
    assert done["Mend"] is False
