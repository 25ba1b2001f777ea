"""The two ways to integrate a swing: order, stability and interpolants, on laws with known solutions."""

import math

import numpy as np
import pytest
from scipy.integrate import RK45, solve_ivp

from sim_instruments.physics.integration.explicit_step import DormandPrince, ExplicitStep
from sim_instruments.physics.integration.implicit_step import Rosenbrock
from sim_instruments.physics.integration.integration_step import IntegrationStep, Method, StepStart

METHODS = [(DormandPrince(), 5), (Rosenbrock(timed=True), 4)]


def pendulum(passed: float, state: list[float], direction: int) -> tuple[list[float], float, float]:
    """Return the law of a damped pendulum with a push that grows with time, and a current that it drives."""
    push = -math.sin(state[0]) - 0.1 * state[1] + 0.3 * passed - 0.05 * direction
    return [state[1], push, -2.0 * state[2] + state[1]], state[2], push


def stiff(passed: float, state: list[float], direction: int) -> tuple[list[float], float, float]:
    """Return the law of an oscillator whose current follows the speed within a hundred-thousandth of a second."""
    push = -state[0] - 0.2 * state[2]
    return [state[1], push, 1e5 * (state[1] - state[2])], state[2], push


def one(method: Method, law: object, state: list[float], start: float, length: float) -> tuple[IntegrationStep, float]:
    slopes = law(start, state, 1)[0]  # type: ignore[operator]
    return method.tried(law, StepStart(start, state, slopes, 1, 1.0), length)  # type: ignore[arg-type]


def reached(method: Method, steps: int) -> list[float]:
    state = [1.0, 0.0, 0.5]
    for k in range(steps):
        state = one(method, pendulum, state, k / steps, 1.0 / steps)[0].after
    return state


@pytest.mark.parametrize(("method", "order"), METHODS)
def test_the_error_falls_with_the_methods_order(method: Method, order: int) -> None:
    exact = solve_ivp(lambda t, y: pendulum(t, y, 1)[0], (0, 1), [1.0, 0.0, 0.5], rtol=1e-12, atol=1e-13).y[:, -1]
    errors = [np.abs(np.array(reached(method, steps)) - exact).max() for steps in (5, 10)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.5)


@pytest.mark.parametrize(("method", "order"), METHODS)
def test_within_a_step_the_interpolant_follows_the_solution(method: Method, order: int) -> None:
    step, error = one(method, pendulum, [1.0, 0.0, 0.5], 0.4, 0.05)
    solved = solve_ivp(
        lambda t, y: pendulum(t, y, 1)[0], (0.4, 0.45), [1.0, 0.0, 0.5], rtol=1e-12, atol=1e-13, dense_output=True
    ).sol
    for share in (0.0, 0.3, 0.7, 1.0):
        assert step.at(share) == pytest.approx(solved(0.4 + 0.05 * share), abs=3e-7)
        assert step.course(1)(share) == step.at(share)[1]
    assert step.at(1.0) == pytest.approx(step.after, abs=1e-15)
    assert step.slopes == pytest.approx(pendulum(0.45, step.after, 1)[0])
    assert error > 0.0


def test_only_the_implicit_method_steps_over_what_is_quick() -> None:
    state = [1.0, 0.0, 0.0]
    for k in range(20):
        step, error = one(Rosenbrock(timed=False), stiff, state, 0.05 * k, 0.05)
        state = step.after
        # The current that begins at rest is caught up with in the first step.
        assert k == 0 or error < 10.0
    # With the current at the speed, the oscillator is damped by 0.1.
    damped = math.sqrt(1.0 - 0.01)
    expected = math.exp(-0.1) * (math.cos(damped) + 0.1 / damped * math.sin(damped))
    assert state[0] == pytest.approx(expected, abs=2e-5)
    explicit, error = one(DormandPrince(), stiff, [1.0, 0.0, 0.0], 0.0, 0.05)
    assert error > 1e6
    assert isinstance(explicit, ExplicitStep)
    assert explicit.hurried
    assert not one(DormandPrince(), stiff, [1.0, 0.0, 0.0], 0.0, 5e-6)[0].hurried  # type: ignore[attr-defined]


def test_the_explicit_step_is_scipys() -> None:
    state, length = [0.4, -0.2, 0.1], 0.2
    step, _ = one(DormandPrince(), pendulum, state, 0.3, length)
    scipys = RK45(
        lambda passed, y: pendulum(passed, list(y), 1)[0], 0.3, state, 0.3 + length, first_step=length, rtol=1.0
    )
    scipys.step()
    assert step.after == pytest.approx(scipys.y, rel=1e-13)
    for share in (0.1, 0.5, 0.8):
        expected = scipys.dense_output()(0.3 + share * length)
        assert [step.course(n)(share) for n in range(3)] == pytest.approx(expected, rel=1e-12)
