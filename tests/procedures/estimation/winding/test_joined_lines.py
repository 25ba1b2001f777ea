"""The loop of two joined lines, against motors of unlike phases whose circuits are solved as they are."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from procedures.estimation.winding.joined_lines import LineReading, joined_lines
from procedures.estimation.winding.second_circuit import SeriesReading, second_circuit

FREQUENCIES = (1000.0, 250.0, 90.0, 40.0, 20.0)
LD, LQ, IRON = 1e-3, 2.5e-3, 5e-3
A_BC, AB, CA = (1.0, -1.0, -1.0), (1.0, -1.0, 0.0), (1.0, 0.0, -1.0)


def inductances(angle, turns):
    """The windings' inductances (H), of unlike turns, with a zero sequence of a tenth of the mean."""
    axes = angle - 2.0 * math.pi / 3.0 * np.arange(3)
    d, q = np.cos(axes), -np.sin(axes)
    like = 2.0 / 3.0 * (LD * np.outer(d, d) + LQ * np.outer(q, q)) + 0.05 * (LD + LQ) / 3.0
    return like * np.outer(turns, turns)


def impedance(connection, poles, angular, inductance, resistances):
    """What is between the poles (1 and −1, 0 open) of three windings: nodes of a network whose windings are coupled."""
    branches = np.linalg.inv(np.diag(resistances) + 1j * angular * inductance)
    if connection == "wye":
        ones = branches.sum(axis=1)
        admittance = branches - np.outer(ones, ones) / ones.sum()
    else:
        incidence = np.array([[1, 0, -1], [-1, 1, 0], [0, -1, 1]])
        admittance = incidence @ branches @ incidence.T
    driven = [k for k, pole in enumerate(poles) if pole > 0.0]
    free = [k for k, pole in enumerate(poles) if pole == 0.0]
    left = admittance[np.ix_(driven, driven)]
    if free:
        left = left - admittance[np.ix_(driven, free)] @ np.linalg.solve(
            admittance[np.ix_(free, free)], admittance[np.ix_(free, driven)]
        )
    return 1.0 / left[0, 0]


def read(connection, angle, resistances, turns=(1.0, 1.0, 1.0)):
    """Return what a perfect bridge shows of a rotor at an angle from phase A: the axes, and A against B and C at its frequencies."""
    # A delta's winding from A to B has its axis 30° behind phase A's.
    inductance = inductances(angle if connection == "wye" else angle + math.pi / 6.0, turns)
    at = {
        (poles, f): impedance(connection, poles, 2.0 * math.pi * f, inductance, resistances)
        for poles in (A_BC, AB, CA)
        for f in FREQUENCIES
    }
    high, low = FREQUENCIES[0], FREQUENCIES[-1]
    lines = (LineReading(at[p, high], at[p, low].real) for p in (AB, CA))
    series = []
    for f in FREQUENCIES:
        z, omega = at[A_BC, f], 2.0 * math.pi * f
        limit = 5e-4 * abs(z) / math.sqrt(3.0)
        series.append(SeriesReading(f, z.real, z.imag / omega, limit, limit / omega))
    return joined_lines(at[A_BC, high], *lines, 2.0 * math.pi * high), series


@settings(max_examples=30)
@given(
    st.sampled_from(["wye", "delta"]),
    st.floats(-0.3, 0.3),
    st.sampled_from([0.0, math.pi / 2.0]),
    st.floats(0.1, 5.0),
    st.tuples(*(st.floats(0.97, 1.03),) * 3),
)
def test_nothing_of_the_loop_is_left(connection, off, axis, resistance, unlike):
    angle = axis + off
    lines, series = read(connection, angle, [resistance * share for share in unlike])
    scale = 3.0 if connection == "delta" else 1.0
    assert scale * lines.along == pytest.approx(LD * math.cos(angle) ** 2 + LQ * math.sin(angle) ** 2, rel=1e-3)
    assert second_circuit(lines.without_loop(series), IRON) is None


@pytest.mark.parametrize("connection", ["wye", "delta"])
def test_it_looks_like_a_closed_circuit(connection):
    _, series = read(connection, 0.12, [0.5, 0.5, 0.5])
    found = second_circuit(series, IRON)
    assert found is not None
    assert found.coupling == pytest.approx((0.5 * (LQ - LD) * math.sin(0.24)) ** 2 / LD / LQ, rel=0.1)


def test_turns_that_one_phase_has_more_show_in_the_other_axis():
    turns = (1.02, 0.985, 0.995)
    on_d, on_q = (read("wye", angle, [0.5, 0.5, 0.5], turns)[0] for angle in (0.0, math.pi / 2.0))
    for along, across, true in ((on_d.along, on_q.across, LD), (on_q.along, on_d.across, LQ)):
        assert along == pytest.approx(1.02 * true, rel=1e-3)
        assert 0.5 * (along + across) == pytest.approx(true, rel=1e-3)
