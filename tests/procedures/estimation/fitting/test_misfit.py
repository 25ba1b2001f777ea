import numpy as np
import pytest

from procedures.estimation.fitting.misfit import ALARM, Answer, Cause, Finding, Misfit, score_test


def line(rng: np.random.Generator, curvature: float, points: int = 400) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Residuals of a straight line fitted to noise of 1 and so much curvature; the line's slopes and the curvature's direction."""
    x = np.linspace(-1.0, 1.0, points)
    slopes = np.array((np.ones(points), x))
    values = rng.normal(size=points) + curvature * x**2
    fitted = np.linalg.lstsq(slopes.T, values, rcond=None)[0]
    return values - fitted @ slopes, slopes, x[None] ** 2


def test_a_term_that_is_not_there_is_seen_as_chance_has_it() -> None:
    rng = np.random.default_rng(1)
    z = np.array([score_test(*line(rng, 0.0)).z[0] for _ in range(2000)])
    assert np.std(z) == pytest.approx(1.0, abs=0.05)
    assert abs(np.mean(z)) < 0.1
    assert np.mean(np.abs(z) > ALARM) < 0.005


def test_a_term_that_is_there_is_seen_with_its_sign() -> None:
    rng = np.random.default_rng(2)
    for curvature in (-2.0, 2.0):
        score = score_test(*line(rng, curvature))
        assert score.alarms[0]
        assert np.sign(score.z[0]) == np.sign(curvature)


def test_the_bias_of_an_estimate_is_what_an_unseen_term_does_to_it() -> None:
    slopes = np.array((np.ones(400), np.linspace(-1.0, 1.0, 400)))
    direction = np.linspace(-1.0, 1.0, 400)[None] ** 2
    curvature = 0.4
    shifted = np.linalg.lstsq(slopes.T, curvature * direction[0], rcond=None)[0]
    residuals = curvature * direction[0] - shifted @ slopes
    score = score_test(residuals, slopes, direction)
    uncertainty = np.sqrt(np.diag(np.linalg.inv(slopes @ slopes.T)))
    assert np.abs(score.z[0]) * score.bias[0] == pytest.approx(np.abs(shifted) / uncertainty, abs=1e-9)


def test_a_direction_that_the_estimates_make_up_for_is_no_alarm_and_no_promise() -> None:
    slopes = np.array((np.ones(50), np.linspace(0.0, 1.0, 50)))
    score = score_test(np.random.default_rng(3).normal(size=50), slopes, slopes[1:] * 2.0)
    assert score.z[0] == 0.0
    assert np.all(np.isinf(score.bias))


def test_growth_is_by_the_worst_direction_that_is_not_in_the_model() -> None:
    score = score_test(*line(np.random.default_rng(4), 2.0))
    assert score.growth()[0] > 1.0
    assert score.growth(modelled=[0]) == pytest.approx([1.0, 1.0])


def finding(cause: Cause, answer: Answer, *estimates: str, score: float = 0.0) -> Finding:
    return Finding(cause, answer, estimates, score)


def test_findings_of_several_records_are_told_once_the_gravest_first() -> None:
    hum = finding(Cause.HUM, Answer.MODELLED, score=4.0)
    stronger = finding(Cause.HUM, Answer.MODELLED, score=-9.0)
    clipped = finding(Cause.CLIPPED, Answer.WITHHELD, "inductance")
    together = Misfit.together([Misfit((hum,)), Misfit((stronger, clipped))])
    assert together.findings == (clipped, stronger)
    assert together.withholding("inductance") is clipped
    assert together.withholding("resistance") is None
    assert together.of("inductance", "d_axis_inductance").withholding("d_axis_inductance") is not None
    assert [f.cause for f in together.of("resistance").findings] == [Cause.HUM]
