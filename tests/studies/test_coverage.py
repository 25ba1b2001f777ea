"""The coverage study in small: no failures, sane errors, and the same result however it is spread."""

import math
from collections.abc import Iterable

import numpy as np
import pytest

from tests.studies.coverage import by_cluster, by_workers, measure_some, study
from tests.studies.tally import COUNTS, Row, Tally, lines
from tests.studies.worlds.measured_motor import Figure, Measured, measure, study_plan

pytestmark = pytest.mark.slow

MOTORS = 4


@pytest.fixture(scope="module")
def tally() -> Tally:
    return study(measure_some(11, range(MOTORS)))


def test_no_failures_and_all_parameters(tally: Tally) -> None:
    assert not tally.failed
    # All wires are where they should be: no check of the wiring may say otherwise.
    assert not [reason for _, reason in tally.refused if "wiring" in reason]
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


#: Cheap ones that use every kind of connection of the virtual bench: SCPI, Modbus, serial.
QUICK = ("stator-resistance", "dq-inductance-extremes", "pole-pairs-back-emf")


@pytest.fixture(scope="module")
def alone() -> list[Measured]:
    return measure_some(5, range(4), QUICK)


def test_one_seed_gives_the_same_figures_with_any_number_of_workers(alone: list[Measured]) -> None:
    assert [one.index for one in alone] == list(range(4))
    assert sum(len(one.figures) for one in alone) > 12
    shared = list(by_workers(5, 4, 2, QUICK))
    assert shared == alone
    assert lines_of(shared) == lines_of(alone)


def test_a_cluster_gives_the_same_figures(alone: list[Measured]) -> None:
    assert list(by_cluster(5, 4, "local", QUICK)) == alone


def lines_of(measured: Iterable[Measured]) -> list[str]:
    return list(lines(study(measured)))


def rows_of(z: np.ndarray, half_width: float) -> Row:
    row = Row()
    for index, error in enumerate(z.tolist()):
        value = 100.0 + error
        row.add(Figure("way", "name", value, 100.0, 1.0, value - half_width, value + half_width), index)
    return row


@pytest.mark.parametrize(
    ("errors", "half_width"),
    [
        (np.random.default_rng(1).normal(0.0, 1.0, 20_000), 1.96),
        (np.random.default_rng(2).uniform(-math.sqrt(3.0), math.sqrt(3.0), 20_000), 0.95 * math.sqrt(3.0)),
    ],
    ids=["normal", "rectangular"],
)
def test_intervals_as_wide_as_they_must_be_have_the_ideal_width(errors: np.ndarray, half_width: float) -> None:
    row = rows_of(errors, half_width)
    assert row.coverage == pytest.approx(0.95, abs=0.005)
    assert row.width == pytest.approx(1.0, abs=0.02)
    assert rows_of(errors, 1.5 * half_width).width == pytest.approx(1.5, abs=0.03)


def test_outliers_do_not_make_wide_intervals_look_ideal() -> None:
    errors = np.random.default_rng(3).normal(0.0, 1.0, 1000)
    errors[:5] = 500.0
    assert rows_of(errors, 3.0).width > 1.4


def test_table_names_every_row(tally: Tally) -> None:
    table = "\n".join(lines(tally))
    assert all(f"| {name} | {procedure} |" in table for name, procedure in tally.rows)
