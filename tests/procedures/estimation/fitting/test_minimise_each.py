import numpy as np
import pytest

from procedures.estimation.fitting.nonlinear import IntArray, minimise, minimise_each

TIME = np.linspace(0.0, 1.0, 60)
RATES = np.array([0.5, 3.0, 20.0])
READ = 2.0 * np.exp(-RATES[:, None] * TIME) + np.random.default_rng(1).normal(0.0, 0.01, (3, TIME.size))


def evaluate(p: np.ndarray, places: IntArray) -> tuple[np.ndarray, np.ndarray]:
    """Residuals of decays, and what they change by with height and rate."""
    decays = np.exp(-p[:, 1:] * TIME)
    slopes = np.stack((decays, -p[:, :1] * TIME * decays), axis=1)
    return (p[:, :1] * decays - READ[places]) / 0.01, slopes / 0.01


def test_fits_side_by_side_end_where_each_does_alone() -> None:
    starts, scale = np.tile([1.0, 2.0], (3, 1)), np.ones(2)
    together = minimise_each(evaluate, starts, scale, least=1e-9, floor=1.0, rounds=50)
    for place, found in enumerate(together):

        def alone(p: np.ndarray, place: int = place) -> tuple[np.ndarray, np.ndarray]:
            residuals, slopes = evaluate(p[None], np.array([place]))
            return residuals[0], slopes[0]

        expected = minimise(alone, starts[place], scale, least=1e-9, floor=1.0, rounds=50)
        assert found.settled
        assert expected.settled
        assert found.values == pytest.approx(expected.values, rel=1e-9)
        assert found.cost == pytest.approx(expected.cost, rel=1e-9)
        assert found.residuals == pytest.approx(alone(found.values)[0], abs=1e-6)


def test_a_fit_that_has_not_come_there_says_so_beside_others_that_have() -> None:
    starts = np.array([[2.0, 0.5], [50.0, 40.0], [2.0, 20.0]])
    found = minimise_each(evaluate, starts, np.ones(2), least=1e-9, floor=1.0, rounds=5)
    assert [each.settled for each in found] == [True, False, True]
