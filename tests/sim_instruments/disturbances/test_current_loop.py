"""What a current-regulating inverter adds: drawn within its limits, and without an effect on what else is drawn."""

import math
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_instruments.disturbances.current_loop import CurrentLoop
from sim_instruments.instruments.errors import DriveErrors, Errors, InverterErrors, VoltmeterErrors, evenly
from tests.studies.worlds.units_in_use import as_sold


def test_drawn_ones_are_within_their_limits_and_differ() -> None:
    limits = {"current_gain": 5e-3, "voltage_gain": 3e-3, "angle_error": math.radians(0.5), "current_offset_a": 0.02}
    for draw in (evenly, as_sold):
        drawn = [CurrentLoop.drawn(np.random.default_rng(seed), draw) for seed in range(400)]
        for name, limit in limits.items():
            found = np.array([getattr(one, name) for one in drawn])
            assert np.abs(found).max() <= limit
            assert np.abs(found).max() > 0.9 * limit
        assert all(0.0 <= one.voltage_delay <= 4.0e-5 for one in drawn)


def test_what_is_drawn_beside_it_is_what_it_was_without() -> None:
    generator, twin = np.random.default_rng(7), np.random.default_rng(7)
    InverterErrors.drawn(generator)
    twin.uniform(size=2)
    assert VoltmeterErrors.drawn(generator) == VoltmeterErrors.drawn(twin)
    assert DriveErrors.drawn(generator) == DriveErrors.drawn(twin)
    assert Errors.drawn(np.random.default_rng(3)).inverter == Errors.drawn(np.random.default_rng(3)).inverter


@given(
    st.complex_numbers(max_magnitude=50.0, allow_nan=False),
    st.floats(-0.1, 0.1),
    st.floats(-math.pi, math.pi),
)
def test_what_flows_is_shown_as_it_was_regulated(shown: complex, gain: float, angle: float) -> None:
    loop = CurrentLoop(current_gain=gain, angle_error=angle)
    assert loop.shown(loop.flowing(shown)) == pytest.approx(shown, abs=1e-9)
    assert abs(loop.flowing(shown)) == pytest.approx(abs(shown) * (1.0 + gain))


def test_the_sensors_offsets_are_what_the_regulator_takes_away() -> None:
    loop = CurrentLoop(current_offset_a=0.3, current_offset_b=-0.1)
    shown = np.array([0.3, -0.1, 0.0])
    axes = np.exp(1j * np.arange(3) * 2.0 * math.pi / 3.0)
    assert loop.offset == pytest.approx(complex(-(2.0 / 3.0) * np.sum(shown * axes)))


def test_a_voltage_is_commanded_ahead_by_what_the_rotor_turns_until_it_is_out() -> None:
    loop = CurrentLoop(voltage_delay=1e-4, angle_error=0.02, voltage_gain=0.01)
    found = loop.commanded(10j, 500.0)
    assert abs(found) == pytest.approx(10.1)
    assert np.angle(found) == pytest.approx(math.pi / 2.0 + 0.05 - 0.02)


@pytest.mark.parametrize("name", [entry.name for entry in fields(CurrentLoop)])
def test_what_cannot_be_is_named(name: str) -> None:
    with pytest.raises(ValueError, match=rf"CurrentLoop: {name} is nan"):
        CurrentLoop(**{name: math.nan})


def test_two_add_up() -> None:
    both = CurrentLoop(dead_time=1e-6, current_noise=3.0).with_more(CurrentLoop(dead_time=2e-6, current_noise=4.0))
    assert both == CurrentLoop(dead_time=3e-6, current_noise=5.0)
