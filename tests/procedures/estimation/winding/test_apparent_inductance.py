"""Flux over current at the end of a step, with iron that saturates on the way."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.winding.current_step.response import apparent_inductance

L0, SATURATION, RESISTANCE, VOLTAGE = 2e-4, 5.0, 0.05, 0.5


def step(
    *, seconds: float = 0.05, noise: float = 0.0, offset: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    time = np.linspace(-0.3 * seconds, 0.7 * seconds, 8000)

    def slope(_: float, i: np.ndarray) -> np.ndarray:
        return (VOLTAGE - RESISTANCE * i) * (1.0 + (i / SATURATION) ** 2) / L0

    after = time[time >= 0.0]
    found = solve_ivp(slope, (0.0, float(after[-1])), [0.0], t_eval=after, rtol=1e-9, atol=1e-12)
    current = np.concatenate([np.zeros(time.size - after.size), found.y[0]])
    voltage = np.where(time >= 0.0, VOLTAGE, 0.0)
    random = np.random.default_rng(4)
    return (
        time,
        voltage + offset + noise * random.normal(size=time.size),
        current - offset + noise * random.normal(size=time.size),
    )


@pytest.mark.parametrize(("noise", "offset", "tolerance"), [(0.0, 0.0, 1e-3), (0.01, 0.02, 2e-2)])
def test_flux_of_a_saturating_winding(noise, offset, tolerance):
    found = apparent_inductance(*step(noise=noise, offset=offset))
    final = VOLTAGE / RESISTANCE
    flux = L0 * SATURATION * np.arctan(final / SATURATION)
    assert found.current == pytest.approx(final, rel=5e-3)
    assert found.inductance == pytest.approx(flux / final, rel=tolerance)


def test_a_current_that_still_rises_is_refused():
    with pytest.raises(EstimationError, match="not settled"):
        apparent_inductance(*step(seconds=0.004))


def test_a_record_without_a_step_is_refused():
    time = np.linspace(0.0, 1.0, 1000)
    with pytest.raises(EstimationError, match="no step"):
        apparent_inductance(time, np.ones_like(time), np.random.default_rng(0).normal(size=time.size))
