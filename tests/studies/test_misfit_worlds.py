"""Worlds of the studies of misfit: what they disturb is the size that they say, and the truth stays the truth."""

from dataclasses import replace

import numpy as np
import pytest

from tests.studies.emf_misfit import CHANGING
from tests.studies.worlds.bent_probes import BentProbe, drawn_probe
from tests.studies.worlds.disturbed_steps import row, sampled
from tests.studies.worlds.emf_records import Changing, Setup, draw, record, spoil

PURE = Setup(flux=0.02, frequency=60.0, periods=12.0, points=12_000, harmonics=(), steps=1e9, noise=0.0)


def amplitude(time: np.ndarray, wave: np.ndarray, frequency: float) -> float:
    """Return a line's amplitude of a record of whole periods."""
    return float(2.0 * np.abs(np.mean(wave * np.exp(-2j * np.pi * frequency * time))))


def test_a_probe_reads_right_at_small_currents_and_less_and_less_of_large_ones() -> None:
    random = np.random.default_rng(1)
    lost = []
    for _ in range(100):
        probe = drawn_probe(random)
        current = np.linspace(0.0, 1.0, 101)
        gains = np.diff(probe.read(current)) / np.diff(current)
        assert probe.read(np.zeros(1)) == 0.0
        assert probe.read(np.array([1e-3]))[0] == pytest.approx(1e-3, rel=0.01)
        assert np.all(np.diff(gains) < 1e-5)
        assert probe.read(-current) == pytest.approx(-probe.read(current))
        lost.append(1.0 - float(probe.read(np.ones(1))[0]))
    assert np.quantile(lost, 0.2) < 1e-3
    assert 0.1 < max(lost) < 0.25


def test_a_magnetised_probe_is_zeroed_and_not_the_same_for_both_signs() -> None:
    assert drawn_probe(np.random.default_rng(1), magnetised=True).remanence != 0.0
    probe = BentProbe(np.tanh, 0.5, remanence=0.2)
    assert probe.read(np.zeros(1)) == 0.0
    assert abs(probe.read(np.ones(1))[0]) < abs(probe.read(-np.ones(1))[0])


def test_steps_of_a_bent_probe_differ_from_its_circuits_current_at_large_currents_only() -> None:
    bent = sampled(row("bend", 40, 7), bits=16, noise=(1e-3, 1e-3))
    ends = []
    for one in bent:
        zero = np.mean(one.current[:200])
        ends.append(1.0 - (np.mean(one.current[-100:]) - zero))
    assert min(ends) < 2e-3
    assert max(ends) > 0.05


def test_a_flux_linkage_that_changes_with_the_turn_has_its_mean_and_the_sidebands_of_a_flux_linkage() -> None:
    setup = replace(PURE, changing=Changing(pole_pairs=3, orders=((1, 0.06, 0.3),), apart=2.1))
    time, v = record(np.random.default_rng(1), setup)
    wanted = setup.flux * 2.0 * np.pi * 60.0
    for wave in v:
        # Lower and upper sideband by the derivative of the flux linkage, a third of the frequency away.
        found = [amplitude(time, wave, 60.0 * (1.0 + k / 3.0)) / wanted for k in (-1, 0, 1)]
        assert found == pytest.approx([0.03 * 2.0 / 3.0, 1.0, 0.03 * 4.0 / 3.0], rel=2e-3)


def test_magnets_that_warm_up_change_the_amplitude_by_so_much_and_keep_the_mean() -> None:
    setup = replace(PURE, changing=Changing(drift=-0.05, settling=0.7))
    time, v = record(np.random.default_rng(1), setup)
    wanted = setup.flux * 2.0 * np.pi * 60.0
    first, last = (amplitude(time[part], v[0][part], 60.0) / wanted for part in (slice(0, 1000), slice(-1000, None)))
    assert last - first == pytest.approx(-0.05, rel=0.1)
    assert amplitude(time, v[0], 60.0) / wanted == pytest.approx(1.0, abs=5e-4)


@pytest.mark.parametrize("cause", CHANGING)
def test_drawn_changes_are_of_the_kind_that_their_row_says(cause: str) -> None:
    random = np.random.default_rng(5)
    for _ in range(200):
        setup = spoil(random, draw(random), cause)
        changing = setup.changing
        assert changing is not None
        turns = setup.periods / changing.pole_pairs
        assert turns < 1.0 if cause == "part of a turn" else turns > 1.0
        assert bool(changing.orders) is ("turn" in cause)
        assert bool(changing.drift) is ("drift" in cause)
