"""The plan passes what is good, fails what is bad, and blames the station for what the station did."""

from pathlib import Path

import pytest

PLAN = Path(__file__).parents[1] / "plan.toml"


@pytest.mark.parametrize("seed", [1, 2])
def test_a_good_motor_passes(eol_plan, assert_holds_truth, seed):
    judged = eol_plan(PLAN).measure(seed=seed)
    assert judged.verdict.value == "pass"
    assert judged.first_pass
    assert_holds_truth(judged, names=["stator_resistance", "flux_linkage"])


@pytest.mark.parametrize(
    ("defect", "parameter"),
    [
        ({"flux_linkage": 7.5e-3}, "flux_linkage"),
        ({"phase_resistances": (0.018, 0.018, 0.018)}, "stator_resistance"),
    ],
)
def test_a_bad_motor_fails_for_what_it_has(eol_plan, defect, parameter):
    judged = eol_plan(PLAN).measure(**defect)
    assert judged.verdict.value == "fail"
    assert judged.figures[parameter].verdict.value == "fail"


def test_a_silent_instrument_is_no_fault_of_the_motor(eol_plan):
    judged = eol_plan(PLAN).measure(faults=["voltmeter: silence at 0"])
    assert judged.verdict.value == "error"
    assert [attempt.verdict.value for attempt in judged.attempts[:2]] == ["error", "error"]
