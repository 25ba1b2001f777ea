import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.mechanics.torque_constant import drift_within_levels, fit_torque_constant, induced_constant

CURRENT = np.array([1.0, 2.0, 3.0, 4.0, -1.0, -2.0, -3.0, -4.0])
NOISE = np.random.default_rng(1).normal(0, 1e-4, 8)


def test_friction_joins_the_offset_in_one_direction() -> None:
    fit = fit_torque_constant(CURRENT, 0.05 * CURRENT - 0.02 + NOISE, np.full(8, 100.0))
    assert fit.names == ("torque_constant", "offset")
    assert abs(fit.value("torque_constant") - 0.05) < 4 * fit.uncertainty("torque_constant")
    assert fit.value("offset") == pytest.approx(-0.02, abs=3e-4)


def test_friction_is_told_apart_in_both_directions() -> None:
    speed = np.array([100.0, 100.0, -100.0, -100.0] * 2)
    fit = fit_torque_constant(CURRENT, 0.05 * CURRENT - 0.02 * np.sign(speed) + 0.003 + NOISE, speed)
    assert fit.value("friction") == pytest.approx(0.02, abs=3e-4)
    assert fit.value("offset") == pytest.approx(0.003, abs=3e-4)


def test_resolution_of_the_torque_limits_the_uncertainty() -> None:
    fit = fit_torque_constant(CURRENT, 0.05 * CURRENT, torque_resolution=0.01)
    assert fit.uncertainty("torque_constant") == pytest.approx(0.01 / np.sqrt(12 * np.sum(CURRENT**2)))


def test_one_current_gives_no_slope() -> None:
    with pytest.raises(EstimationError, match="several currents"):
        fit_torque_constant(np.ones(5), np.ones(5))
    with pytest.raises(EstimationError, match="differ in length"):
        fit_torque_constant(CURRENT, CURRENT[:-1])


def test_levels_that_move_are_told_from_chance() -> None:
    random = np.random.default_rng(3)
    steady = np.arange(9.0)[:, None] + random.normal(0.0, 0.01, (9, 10))
    assert drift_within_levels(steady) == 0.0
    lag = 0.2 * np.exp(-np.arange(10) / 5.0)
    moving = steady - np.where(np.arange(9) > 0, 1.0, 0.0)[:, None] * lag
    assert drift_within_levels(moving) == pytest.approx(lag[:5].mean() - lag[5:].mean(), abs=0.01)
    assert drift_within_levels(moving, resolution=1.0) == 0.0
    # One reading a level cannot move.
    assert drift_within_levels(steady[:, :1]) == 0.0


@given(
    constant=st.floats(0.01, 2.0), speed=st.floats(10.0, 300.0), turned=st.floats(-0.5, 0.5), seed=st.integers(0, 99)
)
def test_the_voltage_at_no_current_is_the_torque_constant_whatever_turns_it(
    constant: float, speed: float, turned: float, seed: int
) -> None:
    """Resistance, inductance, dead time and a frame that is turned change the voltage, and not what it tells."""
    random, levels = np.random.default_rng(seed), np.linspace(-4.0, 4.0, 9)[:, None] + np.zeros(10)
    induced, noise = constant * speed / 1.5, 0.01 * constant * speed
    voltage = 1j * induced + (0.3j - 0.2) * levels + 0.4j * np.sign(levels)
    voltage = voltage * np.exp(1j * turned) + noise * (random.normal(size=(9, 10)) + 1j * random.normal(size=(9, 10)))
    found = induced_constant(levels, voltage, np.full((9, 10), speed))
    assert found is not None
    assert abs(found.value - constant) < 8.0 * found.uncertainty + 1e-3 * constant
    assert found.voltage == pytest.approx(induced, rel=0.05)


def test_few_levels_or_a_shaft_at_rest_tell_no_induced_constant() -> None:
    levels = np.linspace(-4.0, 4.0, 9)[:, None] + np.zeros(10)
    assert induced_constant(levels[[0, 4, 8]], 1j + 0.0 * levels[:3], np.full((3, 10), 100.0)) is None
    assert induced_constant(levels, 1j + 0.0 * levels, np.zeros((9, 10))) is None
