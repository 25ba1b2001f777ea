"""Marks that do not go round the turn are refused: no wrong count is ever reported."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.core.bench import Bench, ProcedureError
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.result import ProcedureResult
from procedures.estimation.fitting.fit import EstimationError
from procedures.note.pole_pairs_static import PolePairsStatic, PolePairsStaticSettings
from sim_instruments.clock.virtual_clock import VirtualClock
from tests.studies.worlds.measured_motor import NoRecord, measure, study_plan


class NoHands:
    def perform(self, action: object) -> object:
        raise AssertionError(f"{action} is not asked for")


def counted(degrees: list[float], turns: int = 1) -> ProcedureResult:
    plate = Nameplate(name="x", connection=WindingConnection.WYE, rated_current=1.0, maximum_current=2.0)
    procedure = PolePairsStatic(
        Bench({}, NoHands(), VirtualClock(), NoRecord()), plate, PolePairsStaticSettings(turns=turns), {}
    )
    procedure.measure = lambda: procedure.count([math.radians(mark) for mark in degrees])  # type: ignore[method-assign]
    return procedure.run()


@pytest.mark.parametrize(
    ("marks", "turns", "pairs"),
    [
        ([0, 180], 1, 2),
        ([0, 181, 360], 1, 2),
        ([5, 364], 1, 1),
        ([5, 366], 2, 1),
        ([10, 101, 189, 281], 1, 4),
        ([10, 101, 189, 281, 9], 1, 4),
        ([10, 101, 281], 1, 4),
        ([0, 90, 180, 270, 360, 450, 540, 630, 720], 2, 4),
    ],
)
def test_marks_round_the_turn_count(marks: list[float], turns: int, pairs: int) -> None:
    assert counted(marks, turns).parameter("pole_pairs").value == pairs


@pytest.mark.parametrize(
    ("marks", "said"),
    [
        ([58.0], "marks \\(1\\) lie within 0°"),
        ([90.4, 89.3, 90.3, 90.1, 89.4], "marks \\(5\\) lie within 1°"),
        ([0, 17, 34, 51, 69], "within 69°.*more current"),
        ([0, 17, 360], "not exactly one mark for each stable position"),
        ([0, 17, 34, 180, 197, 214], "occupy 2 of 2 evenly spaced positions, 4 of them more than once"),
        ([15 * k for k in range(20)], "occupy 20 of 24 evenly spaced positions.*leave a gap of 75°"),
        ([17 * k for k in range(11)], "not evenly spaced.*widest gap is 190°"),
    ],
)
def test_marks_that_do_not_are_refused(marks: list[float], said: str) -> None:
    with pytest.raises((ProcedureError, EstimationError), match=said):
        counted(marks)


@given(st.integers(2, 24), st.floats(0.0, 0.8), st.floats(0, 360), st.integers(0, 2**32 - 1))
def test_a_part_of_the_turn_never_gives_a_wrong_count(p: int, share: float, start: float, seed: int) -> None:
    marks = start + 360.0 / p * np.arange(max(1, math.floor(share * p)))
    marks += np.random.default_rng(seed).uniform(-1.0, 1.0, marks.size)
    try:
        found = counted(marks.tolist()).parameter("pole_pairs").value
    except (ProcedureError, EstimationError):
        return
    assert found == p


def test_the_hand_goes_round_a_motor_that_brakes_itself() -> None:
    # 21 pole pairs, 0.3 Ω: B and C joined brake the turning rotor with ten times the torque that holds it.
    plan = [planned for planned in study_plan() if planned.name == "pole-pairs-static"]
    (figure,) = measure(1, 149, plan).figures
    assert figure.value == figure.truth == 21
