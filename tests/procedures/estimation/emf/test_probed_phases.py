import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from procedures.estimation.emf.probed_phases import Pattern, ProbingFault, fitting, patterns, phase_order, phasors
from procedures.estimation.fitting.fit import EstimationError

ALL = list(patterns())


def shown(pattern: Pattern, periods: float, start: float, size: float, seed: int) -> np.ndarray:
    """What three 8-bit channels show of a pattern, with a fifth harmonic, unlike gains and offsets."""
    random = np.random.default_rng(seed)
    angle = 2.0 * np.pi * np.linspace(0.0, periods, 2000) + start
    z = size * np.array(pattern.phasors)[:, np.newaxis]
    clean = np.real(z * np.exp(1j * angle)) + 0.05 * np.real(z * np.exp(5j * angle))
    seen = clean * (1.0 + random.uniform(-0.03, 0.03, (3, 1))) + random.uniform(-0.02, 0.02, (3, 1)) * size
    step = 4.0 * size / 256.0
    return np.round(seen / step) * step


@pytest.mark.parametrize("pattern", ALL, ids=lambda p: f"{p.fault.value} {p.channel} {p.terminals}")
@settings(deadline=None, max_examples=12)
@given(st.floats(2.5, 40.0), st.floats(0.0, 6.28), st.floats(1e-2, 1e3), st.integers(0, 99))
def test_every_mistake_is_told_from_all_others(pattern, periods, start, size, seed):
    (found,) = fitting(phasors(shown(pattern, periods, start, size, seed)), ALL)
    assert found is pattern


def test_sizes_are_peaks():
    seen = phasors(shown(ALL[0], 4.0, 1.0, 2.0, 1))
    assert np.abs(seen) == pytest.approx([2.0] * 3, rel=0.05)


def test_noise_fits_nothing():
    random = np.random.default_rng(3)
    assert fitting(phasors(random.normal(size=(3, 500))), ALL) == []
    assert fitting(np.zeros(3, dtype=complex), ALL) == []


def test_what_is_right_comes_first():
    assert ALL[0].fault is ProbingFault.NONE
    assert len({(p.fault, p.channel, p.terminals) for p in ALL}) == len(ALL)


@pytest.mark.parametrize(("fault", "order"), [(ProbingFault.NONE, 1), (ProbingFault.SEQUENCE, -1)])
def test_the_order_of_three_phases(fault, order):
    (pattern,) = (p for p in ALL if p.fault is fault)
    assert phase_order(shown(pattern, 4.0, 1.0, 2.0, 1), 2.0 / 64.0) == order


def test_no_order_where_three_phases_do_not_show():
    reversed_one = next(p for p in ALL if p.fault is ProbingFault.REVERSED)
    with pytest.raises(EstimationError, match="not those of three phases"):
        phase_order(shown(reversed_one, 4.0, 1.0, 2.0, 1), 2.0 / 64.0)
    with pytest.raises(EstimationError, match="too weak"):
        phase_order(shown(ALL[0], 4.0, 1.0, 2.0, 1), 1.0)
