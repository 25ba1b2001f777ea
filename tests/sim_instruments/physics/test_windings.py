"""Windings and networks against what textbooks and meters say."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.windings import Windings

ANGLES = np.linspace(0.0, 2.0 * math.pi, 721)
HIGH_FREQUENCY = 2.0 * math.pi * 1e6


def inductance(windings: Windings, sockets: tuple[str, str, str], angles: np.ndarray) -> np.ndarray:
    network = Network(windings, sockets, ("lcr_high", "lcr_low"))
    return network.driving_point_impedance(angles, HIGH_FREQUENCY).imag / HIGH_FREQUENCY


def test_line_to_line_inductance_of_a_wye(lab: Any) -> None:
    seen = inductance(Windings(lab.lg_400w(), 25.0), ("open", "lcr_high", "lcr_low"), ANGLES)
    assert seen.min() == pytest.approx(146e-6, rel=1e-6)
    assert seen.max() == pytest.approx(153e-6, rel=1e-6)
    # The d axis lies along B–C a quarter electrical turn from A.
    assert np.allclose(seen, 149.5e-6 + 3.5e-6 * np.cos(2 * ANGLES), rtol=1e-6)


def test_series_parallel_inductance_is_one_and_a_half(lab: Any) -> None:
    seen = inductance(Windings(lab.lg_400w(), 25.0), ("lcr_high", "lcr_low", "lcr_low"), np.array([0.0, math.pi / 2]))
    assert seen == pytest.approx([109.5e-6, 114.75e-6], rel=1e-6)


def test_line_to_line_inductance_of_a_delta_is_two_thirds_of_a_winding(lab: Any) -> None:
    seen = inductance(Windings(lab.outrunner(), 25.0), ("lcr_high", "lcr_low", "open"), ANGLES)
    # L0 plays no part: no circulating current flows in symmetric windings.
    assert seen.min() == pytest.approx(60e-6 * 2 / 3, rel=1e-4)
    assert seen.max() == pytest.approx(70e-6 * 2 / 3, rel=1e-4)


def test_line_resistances_of_unequal_phases(lab: Any) -> None:
    wye = Windings(lab.lg_400w(), 25.0)
    network = Network(wye, ("lcr_high", "lcr_low", "open"), ("lcr_high", "lcr_low"))
    assert network.driving_point_impedance(np.zeros(1), 1e-6)[0].real == pytest.approx(32.2e-3)
    delta = Windings(lab.outrunner(), 25.0)
    network = Network(delta, ("lcr_high", "lcr_low", "open"), ("lcr_high", "lcr_low"))
    assert network.driving_point_impedance(np.zeros(1), 1e-6)[0].real == pytest.approx(0.15 * 0.315 / 0.465)


def equivalents(lab: Any, r: float, ld: float, lq: float, flux: float) -> tuple[Windings, Windings]:
    """A wye, and the delta whose terminals no one can tell from it."""
    common = {"inertia": 1e-4, "pole_pairs": 3, "flux_harmonics": ()}
    wye = lab.lg_400w(
        phase_resistances=(r,) * 3, d_axis_inductance=ld, q_axis_inductance=lq, flux_linkage=flux, **common
    )
    delta = lab.lg_400w(
        connection="delta",
        phase_resistances=(3 * r,) * 3,
        d_axis_inductance=3 * ld,
        q_axis_inductance=3 * lq,
        flux_linkage=math.sqrt(3) * flux,
        **common,
    )
    return Windings(wye, 25.0), Windings(delta, 25.0)


@given(
    r=st.floats(1e-3, 10.0),
    ld=st.floats(1e-5, 1e-2),
    saliency=st.floats(0.8, 4.0),
    angle=st.floats(0.0, 2 * math.pi),
    frequency=st.floats(10.0, 1e5),
    joined=st.booleans(),
)
def test_wye_and_its_delta_have_the_same_impedance(
    lab: Any, r: float, ld: float, saliency: float, angle: float, frequency: float, joined: bool
) -> None:
    wye, delta = equivalents(lab, r, ld, saliency * ld, 0.01)
    sockets = ("lcr_high", "lcr_low", "lcr_low" if joined else "open")
    seen = [
        Network(windings, sockets, ("lcr_high", "lcr_low")).driving_point_impedance(
            np.array([angle + windings.phase_shift]), 2 * math.pi * frequency
        )[0]
        for windings in (wye, delta)
    ]
    assert seen[0] == pytest.approx(seen[1], rel=1e-9)
    assert wye.motor.stator_resistance_y == pytest.approx(delta.motor.stator_resistance_y)
    assert wye.motor.q_axis_inductance_y == pytest.approx(delta.motor.q_axis_inductance_y)
    assert wye.motor.torque_constant == pytest.approx(delta.motor.torque_constant)


@given(angle=st.floats(-10.0, 10.0), current=st.floats(0.1, 10.0), lead=st.floats(-math.pi, math.pi))
def test_torque_is_the_dq_formula_for_wye_and_delta(lab: Any, angle: float, current: float, lead: float) -> None:
    for windings in equivalents(lab, 0.1, 1e-4, 2e-4, 0.01):
        motor = windings.motor
        terminals = current * np.cos(angle + lead - np.arange(3) * 2 * math.pi / 3)
        currents = (np.linalg.pinv(windings.incidence) @ terminals)[:, np.newaxis]
        torque = windings.torque(np.array([angle + windings.phase_shift]), currents)[0]
        along, across = current * math.cos(lead), current * math.sin(lead)
        ld, lq = motor.d_axis_inductance_y, motor.q_axis_inductance_y
        expected = 1.5 * 3 * (motor.flux_linkage_y * across + (ld - lq) * along * across)
        assert torque == pytest.approx(expected, abs=1e-9)


@given(angle=st.floats(0.0, 6.3), currents=st.tuples(*[st.floats(-5.0, 5.0)] * 3))
def test_torque_is_the_slope_of_the_coenergy(lab: Any, angle: float, currents: tuple[float, float, float]) -> None:
    harmonics = ((3, 0.1, 0.4), (5, -0.05, 0.0))
    windings = Windings(lab.lg_400w(q_axis_inductance=2e-4, flux_harmonics=harmonics), 25.0)
    i = np.array(currents)

    def coenergy(theta: float) -> float:
        flux = windings.flux_linkage * sum(
            a / h * np.cos(h * (theta - np.arange(3) * 2 * math.pi / 3) + phase)
            for h, a, phase in ((1, 1.0, 0.0), *harmonics)
        )
        return float(0.5 * i @ windings.inductance(theta) @ i + i @ flux)

    slope = (coenergy(angle + 1e-4) - coenergy(angle - 1e-4)) / 2e-4
    assert windings.torque(np.array([angle]), i[:, np.newaxis])[0] == pytest.approx(4 * slope, rel=1e-5, abs=1e-7)


def test_resistance_follows_copper_and_flux_the_magnets(lab: Any) -> None:
    motor = lab.lg_400w()
    assert motor.resistances_at(85.0)[0] == pytest.approx(16.3e-3 * (1 + 0.00393 * 65) / (1 + 0.00393 * 5), rel=1e-12)
    assert motor.flux_linkage_at(125.0) == pytest.approx(0.9 * 8.5e-3)


def test_a_motor_that_cannot_be_is_refused(lab: Any) -> None:
    with pytest.raises(ValueError, match="pole_pairs is 0"):
        lab.lg_400w(pole_pairs=0)
    with pytest.raises(ValueError, match="coulomb_friction is -1"):
        lab.lg_400w(coulomb_friction=-1.0)
    with pytest.raises(ValueError, match="orders are 2 or more"):
        lab.lg_400w(flux_harmonics=((1, 0.1, 0.0),))
    with pytest.raises(ValueError, match="allowed are 'wye' and 'delta'"):
        lab.lg_400w(connection="star")
