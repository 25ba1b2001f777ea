import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.winding.held_angle import AxisAngle, current_angle, explaining, held_angle
from procedures.estimation.winding.joined_lines import LineReading, joined_lines
from procedures.estimation.winding.wiring import Kind, Pole

P, M, N = Pole.PLUS, Pole.MINUS, Pole.OPEN
ALIGN_D, ALIGN_Q = (P, M, M), (N, P, M)
ANGULAR = 2.0 * math.pi * 1000.0


def read(angle, ld, lq, resistance):
    """What A against B and C, AB and CA show of a rotor at an electrical angle, from the loops themselves."""
    mean, half = 0.5 * (ld + lq), 0.5 * (ld - lq)
    aa, bb = mean + half * math.cos(2 * angle), mean - half * math.cos(2 * angle)
    ab = half * math.sin(2 * angle)
    lines = [1.5 * aa + sign * math.sqrt(3.0) * ab + 0.5 * bb for sign in (-1.0, 1.0)]
    # iα is driven; the loop of B and C lets iβ flow as its impedance has it: (R + jωLββ)·iβ = −jωLαβ·iα.
    coupled = -1j * ANGULAR * ab / (resistance + 1j * ANGULAR * bb)
    reading = 1.5 * (resistance + 1j * ANGULAR * (aa + ab * coupled))
    ab, ca = (LineReading(2.0 * resistance + 1j * ANGULAR * line, 2.0 * resistance) for line in lines)
    return joined_lines(reading, ab, ca, ANGULAR)


@given(st.floats(-1.5, 1.5), st.floats(1e-5, 1e-2), st.floats(1.03, 3.0), st.floats(1e-3, 1.0))
def test_the_angle_is_found_from_three_readings(angle, ld, ratio, share):
    found = held_angle(read(angle, ld, ratio * ld, share * ANGULAR * ld))
    assert abs(math.remainder(found.angle - angle, math.pi)) < 1e-6
    assert found.saliency == pytest.approx(2.0 * (ratio - 1.0) / (ratio + 1.0), rel=1e-6)
    assert found.telling


def test_without_saliency_no_angle_is_told():
    assert not held_angle(read(0.3, 1e-3, 1.005e-3, 0.1)).telling


def test_angles_of_the_note_s_alignments():
    assert current_angle(ALIGN_D) == pytest.approx(0.0)
    assert current_angle(ALIGN_Q) == pytest.approx(math.pi / 2)
    assert current_angle((P, P, M)) == pytest.approx(math.pi / 3)
    assert current_angle((N, P, N)) is None


@pytest.mark.parametrize(
    ("degrees", "told", "named"),
    [
        (60.0, ALIGN_D, {(Kind.EXCHANGED, (0, 2)), (Kind.OTHER_POLE, (1,))}),
        (-60.0, ALIGN_D, {(Kind.EXCHANGED, (0, 1)), (Kind.OTHER_POLE, (2,))}),
        (30.0, ALIGN_Q, {(Kind.EXCHANGED, (0, 1))}),
        (-30.0, ALIGN_Q, {(Kind.EXCHANGED, (0, 2))}),
        (8.0, ALIGN_D, {(Kind.NONE, ())}),
        (180.0, ALIGN_D, {(Kind.NONE, ())}),
        # Friction may hold a rotor so far off; no wire does.
        (28.0, ALIGN_D, set()),
    ],
)
def test_which_wires_turn_it_there(degrees, told, named):
    found = explaining(AxisAngle(math.radians(degrees), 0.2), told, continuous=True)
    assert {(m.kind, m.terminals) for m in found} == named


def test_an_open_wire_turns_it_half_as_far():
    found = explaining(AxisAngle(math.radians(28.0), 0.2), ALIGN_D, continuous=False)
    assert [(m.kind, m.terminals) for m in found] == [(Kind.OPEN, (1,))]
