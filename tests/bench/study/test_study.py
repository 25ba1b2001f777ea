"""What a station will know of a type: one seed, one answer, whoever measures."""

from pathlib import Path

import pytest

from bench.distribution.workforce import Workforce
from bench.i18n.errors import UsageError
from bench.study.ask import StudyRequest, study
from bench.study.motors import StudiedFigure, StudiedMotor
from bench.study.worth import worth_of
from tests.command_line import Call

ASKED = ("insulation-resistance", "pole-pairs-back-emf")


def asked(workforce: Workforce, motors: int = 3, **more: object) -> StudyRequest:
    return StudyRequest(ASKED[1:], "lg-400w", "virtual", motors, 5, workforce, **more)  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_one_seed_gives_the_same_figures_on_one_process_on_several_and_on_a_cluster() -> None:
    by_one, by_two, by_cluster = (
        study(asked(workforce)).worth.as_dict() for workforce in (Workforce(1), Workforce(2), Workforce(2, "local"))
    )
    assert by_one == by_two == by_cluster
    assert [row["held"]["hits"] for row in by_one["figures"]] == [3]


def figure(value: float, half: float, truth: float) -> StudiedFigure:
    return StudiedFigure("p", "stator_resistance", value, value - half, value + half, truth)


def test_worth_counts_what_holds_what_is_withheld_and_what_is_refused() -> None:
    nan = float("nan")
    motors = [
        StudiedMotor(2, (figure(1.1, 0.05, 1.0),), (("q", "no"),)),
        StudiedMotor(1, (figure(2.02, 0.04, 2.0),), ()),
        StudiedMotor(3, (StudiedFigure("p", "stator_resistance", nan, nan, nan, 1.0),), ()),
    ]
    worth = worth_of(motors, 4)
    (row,) = worth.figures
    assert (worth.motors, worth.complete, worth.refused) == (3, False, (("q", "no", 1),))
    assert (row.held.hits, row.held.count, row.withheld) == (1, 2, 1)
    assert row.expanded == pytest.approx(0.035)
    assert row.bias == pytest.approx(0.055)
    assert row.farthest == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("spread", "said"),
    [("resistence=1", "did you mean resistance"), ("flux=x", "allowed are 0 to 20"), ("flux", "like")],
)
def test_a_spread_that_is_none_is_refused(spread: str, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        study(asked(Workforce(1), spread=(spread,)))


@pytest.mark.slow
def test_the_command_prints_what_is_known(call: Call, tmp_path: Path) -> None:
    status, out, _ = call(
        "study", "pole-pairs-back-emf", "--motor", "lg-400w", "--motors", "2", "--jobs", "1", "--language", "en"
    )
    assert status == 0
    assert "2 motors of the type" in out
    assert "2/2" in out
