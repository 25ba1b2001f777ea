"""The least drag that a short coast tells: never more than there is."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from procedures.estimation.mechanics.drag_bound import OwnDrag, least_drag

OWN = OwnDrag(1.0e-4, 0.01, 2.0e-5)
TOP = 250.0


@settings(max_examples=8, deadline=None)
@given(
    motor=st.floats(1e-5, 1e-3),
    coulomb=st.floats(0.01, 4.0),
    viscous=st.floats(0.0, 8.0e-3),
    windage=st.floats(0.0, 2.0e-5),
    late=st.floats(0.0, 0.02),
    seed=st.integers(0, 2**32 - 1),
)
def test_it_is_never_above_the_truth(
    motor: float, coulomb: float, viscous: float, windage: float, late: float, seed: int
) -> None:
    inertia = OWN.inertia + motor

    def drag(speed: float) -> float:
        own = OWN.coulomb_friction + OWN.viscous_friction * speed
        return own + coulomb + viscous * speed + windage * speed**2

    # Driven from slow to the top in about a second.
    torque = drag(TOP) + inertia * TOP
    driven = solve_ivp(lambda _, w: [(torque - drag(w[0])) / inertia], (0.0, 3.0), [5.0], max_step=0.01)
    above = np.flatnonzero(driven.y[0] >= TOP)
    assume(above.size > 0)
    time = np.arange(0.0, float(driven.t[above[0]]), 0.004)
    assume(time.size > 12)
    speed = np.interp(time, driven.t, driven.y[0])
    # The torque goes off `late` s after the last reading.
    coast = solve_ivp(
        lambda t, w: [((torque if t < late else 0.0) - np.sign(w[0]) * drag(abs(w[0]))) / inertia],
        (0.0, 2.0),
        [float(speed[-1])],
        max_step=5e-4,
        events=_slow,
    )
    assume(coast.t_events[0].size > 0)
    noise = np.random.default_rng(seed).normal(0.0, 0.05, time.size)
    low = least_drag(
        OWN, time, speed + noise, np.full_like(time, torque), slow=0.2 * TOP, later=float(coast.t_events[0][0]), error=0.2
    )  # fmt: skip
    assert low <= coulomb


def _slow(_: float, speed: np.ndarray) -> float:
    return float(speed[0]) - 0.2 * TOP


_slow.terminal = True  # type: ignore[attr-defined]


def test_a_gross_drag_is_told() -> None:
    """1.02 N·m on 1.6e-4 kg·m²: from 250 to 50 rad/s in 31 ms, the dynamometer's share of which is 0.64 N·m."""
    time = np.arange(0.0, 1.0, 0.004)
    low = least_drag(OWN, time, 5.0 + 245.0 * time, np.full_like(time, 1.07), slow=50.0, later=0.031, error=0.2)
    assert 0.55 < low < 0.65
