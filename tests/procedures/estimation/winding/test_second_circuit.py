"""A closed circuit beside a winding, seen by a bridge at several frequencies."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.winding.second_circuit import SeriesReading, hidden_share, second_circuit
from sim_instruments.instruments.keysight.e4980a.accuracy import basic_accuracy, short_offset

FREQUENCIES = (1000.0, 250.0, 90.0, 40.0, 20.0)
#: Inductance (H) and resistance (Ω) between lines: a gimbal motor, a servo motor, a large one.
WINDINGS = ((3.8e-3, 11.0), (7e-4, 0.6), (1.5e-4, 0.5), (2e-2, 5.0))
#: Longest time constant (s) of iron's circuits, and what a linear program and its grid of time constants may leave.
IRON, ROUNDING = 5e-3, 2e-4
ERRORS = st.lists(st.floats(min_value=-1.0, max_value=1.0), min_size=10, max_size=10)


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


@pytest.mark.parametrize("winding", WINDINGS)
def test_a_winding_alone_shows_none(winding):
    random = np.random.default_rng(3)
    drawn = [readings(*winding, random.uniform(-1.0, 1.0, 10)) for _ in range(100)]
    assert sum(second_circuit(read, IRON) is not None for read in drawn) <= 3


@given(st.sampled_from(WINDINGS), ERRORS, st.floats(0.1, 0.4), st.floats(8e-5, 6e-4))
def test_one_circuit_is_seen_and_narrows_the_inductance_for_slow_changes(winding, errors, coupling, time_constant):
    inductance, read = winding[0], readings(*winding, errors, coupling=coupling, time_constant=time_constant)
    found = second_circuit(read, IRON)
    assert found is not None
    assert found.inductance.low <= inductance * (1.0 + ROUNDING)
    assert found.inductance.high >= inductance * (1.0 - ROUNDING)
    assert found.inductance.high - found.inductance.low < 0.4 * inductance


def test_the_circuit_is_the_one_that_made_the_readings():
    found = second_circuit(readings(3.8e-3, 11.0, [0.0] * 10, coupling=0.16, time_constant=3.2e-4), IRON)
    assert found is not None
    assert found.time_constant == pytest.approx(3.2e-4, rel=0.03)
    assert found.coupling == pytest.approx(0.16, rel=0.03)
    assert found.inductance.low <= 3.8e-3 <= found.inductance.high
    assert found.inductance.high - found.inductance.low < 0.1 * 3.8e-3


@pytest.mark.parametrize("winding", [WINDINGS[0], *(pytest.param(w, marks=pytest.mark.slow) for w in WINDINGS[1:])])
def test_a_skin_effect_in_the_wire_changes_the_inductance_little(winding):
    random = np.random.default_rng(1)
    for _ in range(20):
        found = second_circuit(readings(*winding, random.uniform(-1.0, 1.0, 10), skin=0.03), IRON)
        if found is not None:
            assert found.inductance.low * (1.0 - ROUNDING) <= winding[0] <= found.inductance.high * (1.0 + ROUNDING)
            assert found.inductance.high - found.inductance.low < 0.12 * winding[0]


def spoiled(read, winding, circuits, loss, power):
    """Return the readings of a winding with several circuits of k² and a time constant (s), and a loss that grows with the frequency."""
    frequencies = [r.frequency for r in read]
    still = readings(*winding, [0.0] * 10, frequencies=frequencies)
    for coupling, time_constant in circuits:
        parts = readings(*winding, [0.0] * 10, coupling=coupling, time_constant=time_constant, frequencies=frequencies)
        read = [
            replace(
                r,
                resistance=r.resistance + p.resistance - s.resistance,
                inductance=r.inductance + p.inductance - s.inductance,
            )
            for r, p, s in zip(read, parts, still, strict=True)
        ]
    return [replace(r, resistance=r.resistance + loss * winding[1] * (r.frequency / 20.0) ** power) for r in read]


@given(
    st.sampled_from(WINDINGS),
    ERRORS,
    st.lists(st.tuples(st.floats(0.05, 0.3), st.floats(1e-4, 0.005)), min_size=1, max_size=3),
    st.floats(0.0, 0.02),
    st.sampled_from([1.0, 2.0]),
)
def test_any_mixture_of_circuits_and_losses_is_held(winding, errors, circuits, loss, power):
    for frequencies, slowest in ((FREQUENCIES, IRON), ((80.0, 40.0, 20.0), 0.03)):
        read = spoiled(readings(*winding, errors, frequencies=frequencies), winding, circuits, loss, power)
        found = second_circuit(read, slowest)
        if found is None:
            continue
        for true, held in zip(winding, (found.inductance, found.resistance), strict=True):
            assert held is not None
            assert held.low <= true * (1.0 + ROUNDING)
            assert held.high >= true * (1.0 - ROUNDING)


def test_a_field_that_diffuses_into_solid_iron_is_held():
    # One circuit for every odd order, 1/order² of the first in share and time constant.
    circuits = [(0.2 / order**2, 2e-3 / order**2) for order in range(1, 20, 2)]
    read = spoiled(readings(3.8e-3, 11.0, [0.0] * 10), (3.8e-3, 11.0), circuits, 0.0, 1.0)
    found = second_circuit(read, IRON)
    assert found is not None
    assert found.inductance.low <= 3.8e-3 <= found.inductance.high
    assert found.inductance.high - found.inductance.low < 0.15 * 3.8e-3


@pytest.mark.parametrize(
    "winding", [WINDINGS[0], *(pytest.param(w, marks=pytest.mark.slow) for w in (*WINDINGS[1:], (6e-5, 0.032)))]
)
def test_what_is_hidden_is_no_less_than_circuits_that_are_not_seen(winding):
    random = np.random.default_rng(4)
    unseen = held = 0
    for _ in range(120):
        coupling, time_constant = (
            math.exp(random.uniform(math.log(a), math.log(b))) for a, b in ((1e-3, 0.3), (3e-5, IRON))
        )
        read = readings(*winding, random.uniform(-1.0, 1.0, 10), coupling=coupling, time_constant=time_constant)
        if second_circuit(read, IRON) is None:
            unseen += 1
            share = hidden_share(read, IRON)
            # Errors are independent here, so those of the inductance itself are allowed for apart.
            room = 2.0 * read[0].u_inductance / read[0].inductance
            held += winding[0] <= read[0].inductance * (1.0 + share + room)
    assert unseen > 5
    assert held >= 0.95 * unseen


def test_direct_current_leaves_less_hidden():
    inductance, ohms = 6e-5, 0.032
    read = readings(inductance, ohms, [0.0] * 10)
    alone, beside = hidden_share(read, IRON), hidden_share(read, IRON, 0.99 * ohms)
    assert 0.02 < beside < 0.7 * alone
    # All that direct current leaves of the resistance, one circuit of 5 ms would take: k²·L = τ·ΔR.
    assert beside > 0.5 * IRON * 0.01 * ohms / inductance
    slow = readings(inductance, ohms, [0.0] * 10, coupling=0.019, time_constant=2.4e-3)
    assert second_circuit(slow, IRON) is None
    assert inductance <= slow[0].inductance * (1.0 + hidden_share(slow, IRON, 0.99 * ohms))


def test_a_winding_that_has_cooled_by_much_is_not_held_against_direct_current():
    read = readings(1.5e-4, 0.5, [0.0] * 10)
    assert hidden_share(read, IRON, 0.6) == hidden_share(read, IRON)
