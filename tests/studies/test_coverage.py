"""The coverage study in small: no failures, sane errors, and the same result however it is spread."""

import math

import pytest

from tests.studies.coverage import measure_some, study
from tests.studies.measured_motor import measure, study_plan
from tests.studies.tally import COUNTS, Tally, lines

MOTORS = 4


@pytest.fixture(scope="module")
def tally() -> Tally:
    return study(measure_some(11, range(MOTORS)))


def test_no_failures_and_all_parameters(tally: Tally) -> None:
    assert not tally.failed
    assert {name for name, _ in tally.rows} >= {
        "pole_pairs",
        "stator_resistance",
        "d_axis_inductance",
        "q_axis_inductance",
        "flux_linkage",
        "torque_constant",
        "inertia",
        "coulomb_friction",
        "viscous_friction",
    }


def test_errors_are_what_the_budgets_say(tally: Tally) -> None:
    rows = [row for (name, _), row in tally.rows.items() if name not in COUNTS]
    pooled = math.sqrt(sum(row.z_squared for row in rows) / sum(row.number for row in rows))
    assert 0.5 < pooled < 1.6
    assert max(row.largest for row in rows) < 5.0
    assert all(row.coverage == 1.0 for (name, _), row in tally.rows.items() if name in COUNTS)


def test_a_motor_depends_on_seed_and_index_only() -> None:
    plan = study_plan()[:2]
    alone = measure(11, 3, plan)
    measure(11, 2, plan)
    assert measure(11, 3, plan) == alone
    assert alone.figures


def test_table_names_every_row(tally: Tally) -> None:
    table = "\n".join(lines(tally))
    assert all(f"| {name} | {procedure} |" in table for name, procedure in tally.rows)
