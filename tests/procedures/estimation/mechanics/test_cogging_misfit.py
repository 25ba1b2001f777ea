"""Slow turns that are not as the model says: what is named, what is held, what is not given."""

import math

import numpy as np
import pytest

from procedures.estimation.fitting.misfit import Answer, Cause
from procedures.estimation.mechanics.cogging import Cogging, fit_cogging

SPEED = 2.0 * math.pi * 0.1
SIZE = 3e-3


def turned(order: int | None = None, *, seed: int = 0, actual: int = 42, lag: float = 0.0, **how) -> Cogging:
    """Turn twice, or through twelve periods of `order`, at a speed that is read 0.3 % wrong; `how` disturbs angle, torque or readings."""
    random = np.random.default_rng(seed)
    n, turns = (120, 12.0 / order) if order else (500, 2.0)
    time = (np.arange(n) + random.uniform(0.0, 0.8, n)) / n * (2.0 * math.pi * turns / SPEED)
    angle = how.get("angle", lambda angle: 1.003 * angle)(SPEED * time)
    passed = 1.0 / (1.0 + 1j * actual * SPEED * lag)
    torque = 0.01 + 2.0 * SIZE * np.sin(angle + 1.0) + SIZE * np.imag(passed * np.exp(1j * actual * angle))
    torque = how.get("torque", lambda _, torque: torque)(time, torque) + 1e-4 * random.standard_normal(n)
    torque = how.get("read", lambda torque: torque)(torque)
    return fit_cogging(SPEED * time, torque, time=time, order=order, resolution=1e-6, torque_filter=lag)


def struck(torque):
    torque = torque.copy()
    torque[::17] = 0.0
    return torque


def stopped(torque):
    torque = torque.copy()
    torque[40:60] = torque[40]
    return torque


def cut(torque):
    # Beneath the noise of a fit that follows the flat tops.
    return np.minimum(torque, np.max(torque) - 0.3 * SIZE)


DISTURBED = {
    "cut": ({"read": cut}, Cause.CLIPPED),
    "clipped": ({"read": lambda torque: np.minimum(torque, np.quantile(torque, 0.95))}, Cause.CLIPPED),
    "hum": ({"torque": lambda time, torque: torque + 0.5 * SIZE * np.sin(2 * math.pi * 50.0 * time)}, Cause.HUM),
    "drift": ({"torque": lambda time, torque: torque + 10.0 * SIZE * np.exp(-time / time[-1] * 4.0)}, Cause.SLOPE),
    "uneven": ({"angle": lambda angle: angle + 0.01 * (angle / angle[-1] * 4.0 - 2.0) ** 2}, Cause.UNEVEN_SPEED),
    "spikes": ({"read": struck}, Cause.DROPOUTS),
    "frozen": ({"read": stopped}, Cause.DROPOUTS),
}


@pytest.mark.parametrize(
    ("name", "order"),
    # Over a part of a turn a drift is run-out's polynomial.
    [(name, order) for name in sorted(DISTURBED) for order in (None, 42) if (name, order) != ("drift", 42)],
)
def test_it_is_named_and_the_truth_is_held(name: str, order: int | None) -> None:
    disturbed, cause = DISTURBED[name]
    found = turned(order, **disturbed)
    assert cause in {finding.cause for finding in found.misfit.findings}
    if found.misfit.withholding("cogging_torque") is None:
        assert abs(found.peak_to_peak - 2.0 * SIZE) < 3.0 * found.uncertainty + found.above + 0.002 * SIZE


@pytest.mark.slow
@pytest.mark.parametrize("order", [None, 42])
def test_an_even_turn_is_told_nothing_of(order: int | None) -> None:
    found = [turned(order, seed=seed) for seed in range(15)]
    assert not any(one.misfit for one in found)
    assert np.mean([one.peak_to_peak for one in found]) == pytest.approx(2.0 * SIZE, rel=0.01)


def test_an_order_that_is_not_the_motors_gives_no_figure() -> None:
    reason = turned(30, actual=42).misfit.withholding("cogging_torque")
    assert reason is not None
    assert reason.cause is Cause.WRONG_PERIOD
    assert reason.figures["order"] == pytest.approx(42.0, abs=0.7)


def test_a_stated_filter_is_undone_until_too_little_is_left() -> None:
    found = turned(42, lag=0.02)
    assert found.peak_to_peak == pytest.approx(2.0 * SIZE, rel=0.03)
    reason = turned(42, lag=0.2).misfit.withholding("cogging_torque")
    assert reason is not None
    assert reason.cause is Cause.TORQUE_FILTER


def test_a_knock_on_one_of_two_turns_is_not_cogging() -> None:
    found = turned(torque=lambda time, torque: torque + 20.0 * SIZE * np.exp(-(((time - 6.0) / 0.1) ** 2)))
    causes = {(finding.cause, finding.answer) for finding in found.misfit.findings}
    assert (Cause.UNEXPLAINED, Answer.WIDENED) in causes
    assert abs(found.peak_to_peak - 2.0 * SIZE) < 3.0 * found.uncertainty + 0.01 * SIZE


@pytest.mark.parametrize("order", [None, 42])
def test_readings_of_a_few_steps_show_the_sensor_and_not_an_end_of_its_range(order):
    step = 0.01
    random = np.random.default_rng(3)
    angle = np.linspace(0.0, 4.0 * math.pi if order is None else 2.0 * math.pi * 12.0 / 42.0, 500)
    torque = step * np.round(0.6 + 0.2 * random.standard_normal(angle.size))
    found = fit_cogging(angle, torque, time=angle / SPEED, order=order, resolution=step)
    assert [(one.cause, one.answer) for one in found.misfit.findings] == [(Cause.TOO_COARSE, Answer.WITHHELD)]


def test_multiples_beyond_those_looked_at_are_in_the_interval() -> None:
    order, held = 24, 0
    for seed in range(10):
        random = np.random.default_rng(seed)
        angle = np.linspace(0.0, 12 * 2.0 * np.pi / order, 120, endpoint=False)
        wound = angle
        for _ in range(60):
            # The coupling gives way by what the magnets pull.
            wound = 0.5 * (wound + angle - 0.8 / order * np.sin(order * wound))
        torque = np.sin(order * wound) + 3.0 + random.normal(0.0, 0.01, angle.size)
        found = fit_cogging(angle, torque, order=order)
        # As the procedure makes the interval of it.
        limit = math.hypot(0.5 * found.above, found.hidden) / math.sqrt(3.0)
        off = abs(found.peak_to_peak + 0.5 * found.above - 2.0)
        held += off <= 2.0 * math.hypot(found.uncertainty, limit)
    assert held >= 9


def part_of_a_turn(random: np.random.Generator, eccentric: float) -> tuple[Cogging, float]:
    """Turn through twelve of 24 periods of a rotor that cogs more on one side; return what is found and the whole turn's truth."""
    order, begin = 24, random.uniform(0.0, 6.3)
    fine, told = np.linspace(0.0, 2.0 * np.pi, 20_001), np.linspace(0.0, np.pi, 120, endpoint=False)

    def torque(at: np.ndarray) -> np.ndarray:
        return np.asarray((1.0 + eccentric * np.sin(at)) * np.sin(order * at))

    read = torque(begin + told) + 3.0 + random.normal(0.0, 0.02, told.size)
    return fit_cogging(told, read, order=order), float(np.ptp(torque(fine)))


def test_cogging_that_changes_along_a_part_of_a_turn_is_told_and_the_whole_turn_held() -> None:
    held = told = 0
    for seed in range(30):
        found, truth = part_of_a_turn(np.random.default_rng(seed), 0.3)
        told += Cause.MODULATED in {one.cause for one in found.misfit.findings}
        held += abs(found.peak_to_peak - truth) <= 2.0 * found.uncertainty + found.hidden
    assert told >= 22
    assert held >= 24


def test_even_cogging_along_a_part_of_a_turn_is_told_nothing_of() -> None:
    found = [part_of_a_turn(np.random.default_rng(seed), 0.0)[0] for seed in range(60)]
    assert sum(bool(one.misfit) for one in found) <= 2
    assert float(np.median([one.uncertainty for one in found])) < 0.02
