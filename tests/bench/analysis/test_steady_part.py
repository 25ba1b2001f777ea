"""Back-EMF of a motor whose speed changes much along the record."""

from pathlib import Path

import numpy as np
import pytest

from bench.analysis.back_emf import analyze_back_emf
from bench.analysis.steady_part import steady_part
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.period import bent_course

FLUX, TIME = 0.02, np.arange(20000) / 2e4


def turned(speed: np.ndarray, noise: float = 0.02) -> np.ndarray:
    """Return three voltages (V) of a speed (rad/s, electrical) over TIME."""
    angle = np.cumsum(speed) * (TIME[1] - TIME[0]) - 2.0 * np.pi / 3.0 * np.arange(3)[:, None]
    random = np.random.default_rng(4)
    return np.asarray(
        FLUX * speed * (np.sin(angle) + 0.04 * np.sin(5.0 * angle)) + random.normal(0.0, noise, angle.shape)
    )


RUNNING_DOWN = 900.0 * np.exp(-1.2 * TIME)


def test_the_part_is_the_longest_in_which_the_speed_changes_little() -> None:
    part = steady_part(TIME, turned(RUNNING_DOWN))
    assert part is not None
    begin, end, times = part
    assert times == pytest.approx(np.exp(1.2), rel=0.2)
    inside = RUNNING_DOWN[(begin <= TIME) & (end >= TIME)]
    assert 1.1 < inside[0] / inside[-1] < 1.2
    # Most periods lie where it is fastest.
    assert begin < 0.02


@pytest.mark.parametrize(
    "speed",
    [
        pytest.param(np.full(TIME.size, 900.0), id="steady"),
        pytest.param(900.0 * (1.0 + 0.2 * TIME), id="a fifth"),
        pytest.param(np.full(TIME.size, 12.0), id="two periods"),
    ],
)
def test_the_whole_record_is_taken_where_the_speed_changes_little(speed: np.ndarray) -> None:
    assert steady_part(TIME, turned(speed)) is None


@pytest.mark.parametrize("share", [0.02, 0.2, 0.3])
def test_noise_at_the_crossings_is_no_change_of_speed(share: float) -> None:
    assert steady_part(TIME, turned(np.full(TIME.size, 900.0), share * FLUX * 900.0)) is None


def test_many_periods_at_a_drifting_speed_are_fitted_together() -> None:
    v = turned(900.0 * (1.0 - 0.15 * TIME))
    fit = fit_back_emf(TIME, v)
    assert fit.flux_linkage.value == pytest.approx(FLUX, rel=5e-4)
    assert fit.drift_significant


def test_a_course_is_bent_only_where_a_steady_one_is_too_far_off() -> None:
    assert bent_course(TIME, turned(np.full(TIME.size, 900.0))[0], 143.0) is None
    course = bent_course(TIME, turned(900.0 * (1.0 - 0.15 * TIME))[0], 132.0)
    assert course is not None
    assert course.size == 3
    # Single noise of this size crosses the middle as well.
    assert bent_course(TIME, np.random.default_rng(1).normal(0.0, 1.0, TIME.size), 143.0) is None


def test_a_motor_that_runs_down_gives_its_flux_linkage_and_says_which_part(tmp_path: Path) -> None:
    path = tmp_path / "emf.csv"
    table = np.column_stack((TIME, turned(RUNNING_DOWN).T))
    np.savetxt(path, table, delimiter=",", fmt="%.6g", header="time (s),U (V),V (V),W (V)", comments="")
    found = analyze_back_emf(path, connection="phase", coupling={"": "dc"})
    low, high = found["parameters"]["flux_linkage"]["coverage_interval"]
    assert low <= FLUX <= high
    assert high - low < 0.01 * FLUX
    said = " ".join(found["assumptions"])
    assert "times that at its slowest" in said
    assert "cut: " in said
