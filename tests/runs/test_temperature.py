"""One thermometer: read once as long as nothing warms the winding, and one error behind all that it says."""

import json
from pathlib import Path

import pytest


def asked(folder: Path) -> list[int]:
    """Return the places in the journal at which the temperature was asked for."""
    events = [json.loads(line) for line in (folder / "journal.jsonl").read_text(encoding="utf-8").splitlines()]
    return [k for k, event in enumerate(events) if event["kind"] == "action" and "winding's temp" in json.dumps(event)]


def temperature_rows(parameter):
    return [row for row in parameter["budget"] if row["source"] == "winding temperature"]


@pytest.fixture(scope="module")
def whole(motorbench_once):
    status, given = motorbench_once("demo", "--motor", "lg-400w", "--seed", "7")
    assert status == 0, given.get("cause")
    return given


def test_it_is_asked_for_once_and_again_after_a_current(whole):
    # Before the bridge's resistance, and after the alignments for the inductances: not by each of the four that use it.
    assert len(asked(Path(whole["run"]))) == 2
    first, second = (whole["procedures"][name]["findings"] for name in ("stator-resistance", "stator-resistance-dc"))
    assert first["winding_temperature"] == second["winding_temperature"]


def test_one_input_stands_behind_resistance_and_flux(whole):
    parameters = whole["parameters"]
    figures = [parameters["stator_resistance"], *parameters["stator_resistance"]["alternatives"]]
    figures += [parameters["flux_linkage"], parameters["torque_constant"]]
    rows = [row for figure in figures for row in temperature_rows(figure)]
    assert len(rows) == len(figures) == 4
    assert len({(row["value"], row["standard_uncertainty"]) for row in rows}) == 1
