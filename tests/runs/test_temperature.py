"""One thermometer: read once as long as nothing warms the winding, and one error behind all that it says."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from procedures.core.actions import Action, EnterReading
from procedures.core.bench import Operator
from sim_instruments.bench import VirtualBench
from tests.runs.on_bench import measure
from tests.studies.worlds.random_motors import draw_motor


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


class TypesAPlaceOff:
    """Hands that type the winding's temperature with its decimal point a place off, every time they are asked."""

    def __init__(self, operator: Operator, factor: float) -> None:
        self._operator, self._factor = operator, factor

    def __getattr__(self, name: str) -> Any:
        return getattr(self._operator, name)

    def perform(self, action: Action) -> Any:
        done = self._operator.perform(action)
        of_temperature = isinstance(action, EnterReading) and action.key == "winding_temperature"
        return self._factor * done if of_temperature else done


@pytest.mark.parametrize("factor", [0.1, 1.0, 10.0])
def test_a_point_that_is_a_place_off_each_time_is_in_the_interval(factor: float) -> None:
    motor, plate = draw_motor(np.random.default_rng(4))
    with VirtualBench(motor, seed=3, sockets=False) as bench:
        found = measure(
            bench, plate, "stator-resistance-dc", hands=lambda _, operator: TypesAPlaceOff(operator, factor)
        )
    (resistance,) = (p for p in found.parameters if p.name == "stator_resistance")
    low, high = resistance.coverage_interval
    assert low <= motor.stator_resistance_y <= high
    assert ("decimal-point" in {notice.identifier for notice in found.warnings}) is (factor != 1.0)
