"""Power of one phase over whole periods."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.winding.phase_power import phase_power


@settings(deadline=None, max_examples=60)
@given(lag=st.floats(-3.0, 3.0), begin=st.floats(0.0, 6.0), periods=st.floats(2.05, 9.0))
def test_the_power_is_that_of_the_fundamentals_wherever_the_record_begins(lag, begin, periods):
    time = np.linspace(0.0, periods / 50.0, 4000, endpoint=False)
    angle = 2.0 * math.pi * 50.0 * time + begin
    found = phase_power(time, 20.0 * np.cos(angle) + 0.3, 8.0 * np.cos(angle - lag) - 0.1, 50.0)
    assert found.power == pytest.approx(80.0 * math.cos(lag), abs=0.2)
    assert found.voltage == pytest.approx(20.0, rel=5e-3)
    assert found.current == pytest.approx(8.0, rel=5e-3)
    assert math.remainder(found.angle - lag, 2.0 * math.pi) == pytest.approx(0.0, abs=5e-3)
    assert found.reactive == pytest.approx(80.0 * math.sin(lag), abs=0.4)


def test_harmonics_that_both_carry_count_and_others_do_not():
    time = np.linspace(0.0, 0.1, 8000, endpoint=False)
    angle = 2.0 * math.pi * 50.0 * time
    voltage = 20.0 * np.cos(angle) + 2.0 * np.cos(5.0 * angle) + 1.0 * np.cos(7.0 * angle)
    current = 8.0 * np.cos(angle) + 0.5 * np.cos(5.0 * angle)
    assert phase_power(time, voltage, current, 50.0).power == pytest.approx(80.5, abs=1e-6)


def test_its_uncertainty_is_the_periods_scatter():
    random, powers, said = np.random.default_rng(1), [], []
    time = np.linspace(0.0, 0.12, 3000, endpoint=False)
    angle = 2.0 * math.pi * 50.0 * time
    for _ in range(150):
        found = phase_power(
            time,
            20.0 * np.cos(angle) + random.standard_normal(3000),
            8.0 * np.cos(angle) + random.standard_normal(3000),
            50.0,
        )
        powers.append(found.power)
        said.append(found.uncertainty)
    assert np.sqrt(np.mean(np.square(said))) == pytest.approx(np.std(powers), rel=0.25)
    assert np.mean(powers) == pytest.approx(80.0, abs=0.1)


def test_a_record_without_two_periods_is_refused():
    time = np.linspace(0.0, 0.03, 1000)
    with pytest.raises(EstimationError, match="two are needed"):
        phase_power(time, np.cos(time), np.cos(time), 50.0)
