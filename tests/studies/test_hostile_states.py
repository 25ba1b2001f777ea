"""Hostile states in small: refused by name, right once the keys are pressed, given back, and nothing left on."""

import pytest

from tests.studies import hostile_checks
from tests.studies.coverage import measure_some
from tests.studies.hostile_states import FOUND, PRESSED, Became, from_state, lines

CHEAP = ("pole-pairs-static", "stator-resistance", "stator-resistance-dc", "pole-pairs-inverter")


def test_figures_are_right_or_refused_with_the_key() -> None:
    became = from_state(1, CHEAP, 2)
    assert {outcome for _, _, outcome in +became.counts} <= {"held", "key named"}
    assert became.counts["stator-resistance-dc", FOUND, "key named"]
    assert [became.counts[name, PRESSED, "held"] for name in CHEAP] == [1] * len(CHEAP)
    assert (became.left_on, became.not_given_back, became.words) == (0, {}, {})


def test_checks_are_right_too_or_refused_with_the_key() -> None:
    procedures = ("insulation-resistance", "no-load-current", "no-load-current-six-step", "phase-order")
    became = hostile_checks.from_state(11, procedures, 3)
    assert {outcome for _, _, outcome in +became.counts} <= {"held", "key named"}
    for beginning in (hostile_checks.CLEAN, PRESSED):
        assert [became.counts[name, beginning, "held"] for name in procedures] == [1] * len(procedures)
    assert (became.left_on, became.not_given_back, became.words) == (0, {}, {})


@pytest.mark.slow
def test_a_motor_is_not_held_at_a_speed_limit_that_was_left_in_torque_control() -> None:
    became = hostile_checks.from_state(5, ("equivalent-resistance",), 1)
    assert became.counts["equivalent-resistance", PRESSED, "other reason"] == 0
    assert became.counts["equivalent-resistance", PRESSED, "held"] == 7


def test_a_coverage_study_may_begin_with_what_was_left() -> None:
    [measured] = measure_some(1, [2], ("stator-resistance",), hostile=True)
    assert [one.low <= one.truth <= one.high for one in measured.figures] == [True]


def test_the_table_names_every_procedure_in_both_beginnings() -> None:
    became = Became(states=1)
    became.counts["inertia", FOUND, "far off"] = 2
    became.words["a reason"] = 1
    told = list(lines(became))
    assert told[2:4] == [
        "| inertia | as found | 0 | 0 | 2 | 0 | 0 | 0 |",
        "| inertia | keys pressed | 0 | 0 | 0 | 0 | 0 | 0 |",
    ]
    assert told[-1] == "- 1 × a reason"
