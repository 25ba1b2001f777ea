"""A growing map's first look against a truth that is known."""

import numpy as np
import pytest

from procedures.estimation.flux.first_look import first_look

LARGEST, SPEED = 20.0, 400.0


def readings(count: int, *, resistance: float = 0.5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Voltages of a motor that saturates a little, at currents all over the circle, half of them turning backwards."""
    random = np.random.default_rng(4)
    current = LARGEST * np.sqrt(random.uniform(size=count)) * np.exp(2j * np.pi * random.uniform(size=count))
    speed = SPEED * np.where(np.arange(count) % 2, -1.0, 1.0)
    flux = flux_of(current.real, current.imag)
    return current, resistance * current + 1j * speed * flux, speed


def flux_of(i_d: np.ndarray, i_q: np.ndarray) -> np.ndarray:
    return (0.1 + 2e-3 * i_d - 1e-5 * i_q**2) + 1j * (4e-3 * i_q - 2e-6 * i_q**3)


@pytest.mark.parametrize("resistance", [0.0, 0.5, 2.0])
def test_it_finds_the_map_without_knowing_the_resistance(resistance: float) -> None:
    seen = first_look(*readings(40, resistance=resistance), LARGEST)
    assert seen is not None
    i_d, i_q = np.meshgrid(seen.i_d, seen.i_q, indexing="ij")
    there = np.isfinite(seen.psi_d)
    assert there.mean() > 0.4
    assert np.allclose((seen.psi_d + 1j * seen.psi_q)[there], flux_of(i_d, i_q)[there], atol=1e-9)
    # Beyond the currents that were read it says nothing.
    assert not there[np.hypot(i_d, i_q) > LARGEST].any()
    torque = 1.5 * 3.0 * np.imag(np.conj(flux_of(i_d, i_q)) * (i_d + 1j * i_q))
    assert np.allclose(seen.torque(3.0)[there], torque[there], atol=1e-6)


def test_too_few_readings_and_readings_on_a_line_show_nothing() -> None:
    current, voltage, speed = readings(40)
    assert first_look(current[:4], voltage[:4], speed[:4], LARGEST) is None
    line = np.linspace(0.0, LARGEST, 40).astype(complex)
    assert first_look(line, voltage, speed, LARGEST) is None


def test_while_all_turn_one_way_it_says_nothing() -> None:
    current, voltage, speed = readings(40)
    one_way = speed > 0.0
    noise = 1.0 + 1e-5 * np.random.default_rng(1).normal(size=40)
    assert first_look(current[one_way], voltage[one_way], (speed * noise)[one_way], LARGEST) is None
    # Some the other way part resistance and flux linkage.
    one_way[np.flatnonzero(~one_way)[:3]] = True
    seen = first_look(current[one_way], voltage[one_way], (speed * noise)[one_way], LARGEST)
    assert seen is not None
    assert 0.1 < np.nanmax(np.hypot(seen.psi_d, seen.psi_q)) < 0.18


def test_it_grows_by_and_by() -> None:
    current, voltage, speed = readings(40)
    areas = [
        np.isfinite(seen.psi_d).sum()
        for count in range(6, 41, 5)
        if (seen := first_look(current[:count], voltage[:count], speed[:count], LARGEST))
    ]
    assert len(areas) == 7
    assert areas == sorted(areas)
