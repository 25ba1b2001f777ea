"""A closed circuit beside a winding, seen by a bridge at three frequencies."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.winding.second_circuit import SeriesReading, resistance_of_losses, second_circuit
from sim_instruments.instruments.keysight.e4980a.accuracy import basic_accuracy, short_offset

FREQUENCIES = (1000.0, 250.0, 20.0)
#: Inductance (H) and resistance (Ω) between lines: a gimbal motor, a servo motor, a large one.
WINDINGS = ((3.8e-3, 11.0), (7e-4, 0.6), (1.5e-4, 0.5), (2e-2, 5.0))
ERRORS = st.lists(st.floats(min_value=-1.0, max_value=1.0), min_size=6, max_size=6)


def readings(inductance, resistance, errors, *, coupling=0.0, time_constant=1e-4, skin=0.0, frequencies=FREQUENCIES):
    """Return what a bridge within its limits of error reads; `skin` is the rise of the wire's resistance at 1 kHz."""
    found = []
    for place, frequency in enumerate(frequencies):
        omega = 2.0 * math.pi * frequency
        shorted = 1.0 / (1.0 / time_constant + 1j * omega)
        impedance = resistance * (1.0 + skin * (frequency / 1000.0) ** 2) + 1j * omega * inductance
        impedance += omega**2 * coupling * inductance * shorted
        limit = basic_accuracy("LONG", frequency, 1.0) * abs(impedance)
        limit += short_offset("LONG", frequency, 1.0, abs(impedance))
        found.append(
            SeriesReading(
                frequency,
                impedance.real + errors[2 * place] * limit,
                (impedance.imag + errors[2 * place + 1] * limit) / omega,
                limit / math.sqrt(3.0),
                limit / omega / math.sqrt(3.0),
            )
        )
    return found


@given(st.sampled_from(WINDINGS), ERRORS)
def test_a_winding_alone_shows_none_whatever_the_bridge_within_its_limits(winding, errors):
    assert second_circuit(readings(*winding, errors)) is None


@given(st.sampled_from(WINDINGS), ERRORS, st.floats(0.1, 0.4), st.floats(8e-5, 6e-4))
def test_the_inductance_for_slow_changes_is_held(winding, errors, coupling, time_constant):
    read = readings(*winding, errors, coupling=coupling, time_constant=time_constant)
    found = second_circuit(read)
    assert found is not None
    inductance = winding[0]
    # The reading's own limit of error comes beside it.
    assert abs(found.inductance - inductance) <= found.half_width + math.sqrt(3.0) * read[0].u_inductance
    assert read[0].inductance < inductance - found.half_width / 4.0


def test_the_circuit_is_the_one_that_made_the_readings():
    found = second_circuit(readings(3.8e-3, 11.0, [0.0] * 6, coupling=0.16, time_constant=3.2e-4))
    assert found is not None
    assert found.time_constant == pytest.approx(3.2e-4, rel=0.03)
    assert found.coupling == pytest.approx(0.16, rel=0.03)
    assert found.inductance == pytest.approx(3.8e-3, rel=0.002)
    assert found.half_width < 0.05 * 3.8e-3


@pytest.mark.parametrize("winding", WINDINGS)
def test_a_skin_effect_in_the_wire_changes_the_inductance_little(winding):
    random = np.random.default_rng(1)
    for _ in range(20):
        found = second_circuit(readings(*winding, random.uniform(-1.0, 1.0, 6), skin=0.03))
        if found is not None:
            assert abs(found.inductance - winding[0]) < 0.01 * winding[0]
            assert found.half_width < 0.02 * winding[0]


def test_several_circuits_at_once_are_held_too():
    # Iron has many: a part of the field follows quickly, a part slowly.
    parts = [readings(3.8e-3, 11.0, [0.0] * 6, coupling=0.08, time_constant=tau) for tau in (5e-5, 4e-4)]
    plain = readings(3.8e-3, 11.0, [0.0] * 6)
    both = [
        SeriesReading(
            a.frequency,
            a.resistance + b.resistance - none.resistance,
            a.inductance + b.inductance - none.inductance,
            a.u_resistance,
            a.u_inductance,
        )
        for a, b, none in zip(*parts, plain, strict=True)
    ]
    found = second_circuit(both)
    assert found is not None
    assert abs(found.inductance - 3.8e-3) <= found.half_width


@given(
    st.sampled_from(WINDINGS),
    ERRORS,
    st.lists(st.tuples(st.floats(0.0, 0.3), st.floats(1e-5, 0.03)), min_size=1, max_size=3),
    st.floats(0.0, 0.02),
    st.sampled_from([1.0, 1.5, 2.0]),
)
def test_what_losses_add_to_a_resistance_is_within_its_bounds(winding, errors, circuits, loss, power):
    frequencies = (80.0, 40.0, 20.0)
    resistance = winding[1]
    read = readings(*winding, errors, frequencies=frequencies)
    still = readings(*winding, [0.0] * 6, frequencies=frequencies)
    for coupling, time_constant in circuits:
        parts = readings(*winding, [0.0] * 6, coupling=coupling, time_constant=time_constant, frequencies=frequencies)
        read = [
            replace(
                r,
                resistance=r.resistance + p.resistance - s.resistance,
                inductance=r.inductance + p.inductance - s.inductance,
            )
            for r, p, s in zip(read, parts, still, strict=True)
        ]
    read = [replace(r, resistance=r.resistance + loss * resistance * (r.frequency / 20.0) ** power) for r in read]
    bounds = resistance_of_losses(read)
    assert bounds is not None
    error = errors[-2] * math.sqrt(3.0) * still[-1].u_resistance
    added = read[-1].resistance - error - resistance
    limit = math.sqrt(3.0) * still[-1].u_resistance
    assert bounds[0] - limit * 1e-6 <= added <= bounds[1] + limit * 1e-6
