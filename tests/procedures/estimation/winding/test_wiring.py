import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.fitting.intervals import ANY, Interval, around
from procedures.estimation.winding.wiring import (
    CONTINUITY,
    Kind,
    Mistake,
    Observation,
    Pole,
    SensingLeads,
    WiringOutcome,
    current_sensed,
    currents,
    judge,
    loop_resistance,
    mistakes,
    odd_line,
    potentials,
    voltage_sensed,
)

P, M, N = Pole.PLUS, Pole.MINUS, Pole.OPEN
ALIGN_D, ALIGN_Q = (P, M, M), (N, P, M)
POLES = st.tuples(*[st.sampled_from(list(Pole))] * 3)
PHASES = st.tuples(*[st.floats(0.01, 100.0)] * 3)


def resistance_of(phases, read, tolerance=0.1):
    def predicted(mistake: Mistake) -> Interval:
        resistance = loop_resistance(phases, mistake.poles)
        if mistake.kind is Kind.TOUCHING:
            return Interval(0.0, 0.01)
        return Interval(math.inf, math.inf) if math.isinf(resistance) else around(resistance, gain=tolerance)

    return Observation(Interval(read, read), predicted)


def test_resistances_of_the_note_s_connections():
    assert loop_resistance((1.0, 1.0, 1.0), ALIGN_D) == pytest.approx(1.5)
    assert loop_resistance((1.0, 1.0, 1.0), ALIGN_Q) == pytest.approx(2.0)
    assert math.isinf(loop_resistance((1.0, 1.0, 1.0), (N, M, M)))


@given(PHASES, POLES)
def test_currents_and_potentials_obey_kirchhoff(phases, poles):
    shares, levels, total = currents(phases, poles), potentials(phases, poles), loop_resistance(phases, poles)
    assert (shares is None) == (levels is None) == math.isinf(total)
    if shares is None or levels is None:
        return
    assert sum(shares) == pytest.approx(0.0, abs=1e-9)
    assert sum(s for s, pole in zip(shares, poles, strict=True) if pole is P) == pytest.approx(1.0)
    # From each terminal, the drop over its leg leads to one star.
    stars = [level - share * phase / total for level, share, phase in zip(levels, shares, phases, strict=True)]
    assert stars == pytest.approx([stars[0]] * 3, abs=1e-9)


@given(POLES)
def test_every_state_of_the_wires_is_named_once_and_none_is_forgotten(poles):
    found = [mistake for mistake in mistakes(poles) if mistake.kind is not Kind.TOUCHING]
    assert found[0].kind is Kind.NONE
    states = [mistake.poles for mistake in found]
    assert len(states) == len(set(states))
    one_wire = {tuple(pole if k != at else other for k, pole in enumerate(poles)) for at in range(3) for other in Pole}
    assert one_wire <= set(states)


@pytest.mark.parametrize(("poles", "off"), [(ALIGN_D, {1, 2}), ((M, P, P), {1, 2})])
def test_a_missing_wire_of_two_in_parallel_is_told_by_resistance(poles, off):
    found = judge(mistakes(poles), [resistance_of((1.0, 1.0, 1.0), 2.0)])
    assert found.outcome is WiringOutcome.WRONG
    assert {(m.kind, m.terminals) for m in found.possible} == {(Kind.OPEN, (k,)) for k in off}


def test_no_path_names_the_wires_that_carry_all_current():
    for poles, off in ((ALIGN_D, {0}), (ALIGN_Q, {1, 2})):
        found = judge(mistakes(poles), [resistance_of((1.0, 1.0, 1.0), math.inf)])
        assert {m.terminals[0] for m in found.possible} == off
        assert all(m.kind is Kind.OPEN for m in found.possible)


def test_a_third_wire_is_told_and_interchanged_ones_are_not():
    joined = judge(mistakes(ALIGN_Q), [resistance_of((1.0, 1.0, 1.0), 1.5)])
    assert joined.outcome is WiringOutcome.WRONG
    assert {m.kind for m in joined.possible} == {Kind.JOINED}
    right = judge(mistakes(ALIGN_Q), [resistance_of((1.0, 1.0, 1.0), 2.0)])
    assert right.outcome is WiringOutcome.VERIFIED
    assert {m.kind for m in right.possible} == {Kind.EXCHANGED}


def test_a_coarse_reading_proves_nothing_and_accuses_nobody():
    wide = Observation(Interval(1.4, 2.1), resistance_of((1.0, 1.0, 1.0), 1.5).predicted)
    found = judge(mistakes(ALIGN_D), [wide])
    assert found.outcome is WiringOutcome.UNVERIFIED
    assert {m.kind for m in found.possible} & CONTINUITY
    assert judge(mistakes(ALIGN_D), [Observation(ANY, lambda _: ANY)]).outcome is WiringOutcome.UNVERIFIED
    assert judge(mistakes(ALIGN_D), [resistance_of((1.0, 1.0, 1.0), 9.0)]).outcome is WiringOutcome.UNEXPLAINED


@given(st.tuples(*[st.floats(0.95, 1.05)] * 3), st.floats(0.94, 1.06), st.sampled_from([ALIGN_D, ALIGN_Q, (P, M, N)]))
def test_no_false_alarm_with_unbalance_and_warm_windings(phases, warm, poles):
    found = judge(mistakes(poles), [resistance_of((1.0, 1.0, 1.0), warm * loop_resistance(phases, poles), 0.12)])
    assert found.outcome is WiringOutcome.VERIFIED


def test_what_leads_sense():
    told = SensingLeads(voltage=(0, 1), current=(0, 1))
    by_kind = {(m.kind, m.leads): m for m in mistakes(ALIGN_D, told)}
    right = by_kind[Kind.NONE, told]
    even = (1.0, 1.0, 1.0)
    assert (voltage_sensed(even, right), current_sensed(even, right)) == (1.0, 1.0)
    turned = by_kind[Kind.CURRENT_PROBE, SensingLeads((0, 1), (0, -1))]
    assert current_sensed(even, turned) == -1.0
    other = by_kind[Kind.CURRENT_PROBE, SensingLeads((0, 1), (1, 1))]
    assert current_sensed(even, other) == pytest.approx(-0.5)
    reversed_ = by_kind[Kind.VOLTAGE_REVERSED, SensingLeads((1, 0), (0, 1))]
    assert voltage_sensed(even, reversed_) == -1.0
    loose = by_kind[Kind.VOLTAGE_LEAD, SensingLeads((None, 1), (0, 1))]
    assert voltage_sensed(even, loose) == 0.0
    # An open B has the star's potential.
    open_b = next(m for m in mistakes(ALIGN_D, told) if m.kind is Kind.OPEN and m.terminals == (1,))
    assert voltage_sensed(even, open_b) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("lines", "odd"),
    [
        ((1.5, 2.0, 2.0), 0),
        ((2.02, 1.99, 1.52), 2),
        ((2.0, 2.05, 1.98), None),
        ((1.5, 1.5, 2.0), None),
        ((1.8, 2.0, 2.0), None),
    ],
)
def test_one_line_of_three_with_its_third_terminal_joined(lines, odd):
    assert odd_line(lines) == odd


def test_intervals():
    assert Interval(1.0, 2.0).overlaps(Interval(2.0, 3.0))
    assert not Interval(1.0, 2.0).overlaps(Interval(2.1, 3.0))
    assert Interval(1.0, 2.0).scaled(-2.0) == Interval(-4.0, -2.0)
    assert Interval(-1.0, 2.0).over(Interval(2.0, 4.0)) == Interval(-0.5, 1.0)
    assert Interval(1.0, 2.0).over(Interval(0.0, 4.0)) is ANY
    assert around(-2.0, gain=0.1, offset=0.1) == Interval(-2.3, -1.7)
