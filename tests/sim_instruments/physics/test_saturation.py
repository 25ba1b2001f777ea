"""A held rotor whose iron saturates: against the exact quadrature, the law itself, and where it must not show."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.physics.motor.saturation import MAGNET_SHARE, Saturation
from sim_instruments.world.world import World

D, Q = 90.0, 60.0
R, LD, LQ = 40e-3, 180e-6, 360e-6
REVERSED = {"A": "supply-", "B": "supply+", "C": "supply+"}


def motor(lab: Any, **changes: Any) -> VirtualMotor:
    values: dict[str, Any] = {
        "phase_resistances": (R, R, R),
        "d_axis_inductance": LD,
        "q_axis_inductance": LQ,
        "flux_linkage": 16e-3,
        "thermal_resistance": 0.0,
        "d_axis_saturation_current": D,
        "q_axis_saturation_current": Q,
    }
    return lab.lg_400w(**{**values, **changes})


def stepped(lab: Any, given: VirtualMotor, degrees: float, voltage: float, wiring: Any, limit: float = 100.0) -> World:
    """Return a world 0.1 s after a step on the rotor held at an electrical angle, with the current of A on channel 4."""
    world, clock = lab.ideal_world(given, initial_angle=math.radians(degrees) / given.pole_pairs)
    world.lock_rotor()
    world.attach_current_probe(4, "A")
    lab.energise(world, voltage, limit, wiring)
    clock.sleep(0.1)
    return world


def one_axis_time(current: float, driving: float, inductance: Any) -> float:
    """Time (s) at which R·i + L(i)·i' = driving has brought i from zero to a current: the equation separates."""
    return float(quad(lambda i: inductance(i) / (driving - R * i), 0.0, current, epsabs=0.0, epsrel=1e-12)[0])


def d_inductance(current: float) -> float:
    return LD * (1.0 + MAGNET_SHARE**2) / (1.0 + (current / D + MAGNET_SHARE) ** 2)


def q_inductance(current: float) -> float:
    return LQ / (1.0 + (current / Q) ** 2)


@pytest.mark.parametrize(
    ("degrees", "sign", "inductance"),
    [
        (0.0, 1, d_inductance),
        (0.0, -1, lambda i: d_inductance(-i)),
        (180.0, 1, lambda i: d_inductance(-i)),
        (90.0, 1, q_inductance),
        (-90.0, 1, q_inductance),
    ],
)
def test_a_step_along_one_axis_is_the_exact_quadrature(lab: Any, degrees: float, sign: int, inductance: Any) -> None:
    world = stepped(lab, motor(lab), degrees, 4.0, lab.series_parallel if sign > 0 else REVERSED)
    final = 4.0 / 1.5 / R
    for share in (0.01, 0.1, 0.4, 0.7, 0.9, 0.99):
        # The ramp of 0.4 µs shifts the step by half its length.
        at = one_axis_time(share * final, 4.0 / 1.5, inductance) + 0.2e-6
        assert world.probe_signal(4, [at])[0] == pytest.approx(sign * share * final, rel=2e-6)


def test_two_terminals(lab: Any) -> None:
    # From A to B the current lies along −30°, and is 2/√3 times as long as at its terminals.
    world = stepped(lab, motor(lab), -30.0, 4.0, {"A": "supply+", "B": "supply-"})
    driving = 4.0 / math.sqrt(3.0)
    for share in (0.1, 0.5, 0.9):
        current = share * driving / R
        at = one_axis_time(current, driving, d_inductance) + 0.2e-6
        assert world.probe_signal(4, [at])[0] == pytest.approx(current * math.sqrt(3.0) / 2.0, rel=2e-6)


def test_a_magnetising_step_is_faster_than_a_demagnetising_one(lab: Any) -> None:
    rise = {}
    for name, wiring in (("magnetising", lab.series_parallel), ("demagnetising", REVERSED)):
        world = stepped(lab, motor(lab), 0.0, 1.2, wiring)
        times = np.linspace(0.0, 0.05, 20001)
        current = np.abs(world.probe_signal(4, times))
        rise[name] = float(np.interp(1.0 - math.exp(-1.0), current / (1.2 / 1.5 / R), times)) * R
    assert rise["magnetising"] < 0.96 * LD < LD < 1.03 * LD < rise["demagnetising"]


def test_flux_is_the_integral_of_the_voltage(lab: Any) -> None:
    given = motor(lab, phase_resistances=(R, 1.1 * R, 0.85 * R))
    saturation = given.winding_saturation
    assert saturation is not None
    world = stepped(lab, given, 25.0, 4.0, lab.series_parallel)
    for channel, terminal in enumerate("ABC", start=1):
        world.attach_current_probe(channel, terminal)  # type: ignore[arg-type]
        world.attach_voltage_probe(10 + channel, terminal, "star")  # type: ignore[arg-type]
    points, weights = np.polynomial.legendre.leggauss(16)
    edges = np.concatenate([[0.0], np.geomspace(1e-6, 0.04, 60)])
    half, middle = np.diff(edges) / 2, (edges[1:] + edges[:-1]) / 2
    times, w = (middle[:, None] + half[:, None] * points).ravel(), (half[:, None] * weights).ravel()
    axes = np.array([[math.cos(math.radians(25.0 - 120.0 * k)) for k in range(3)],
                     [-math.sin(math.radians(25.0 - 120.0 * k)) for k in range(3)]]) * 2.0 / 3.0  # fmt: skip
    v = np.array([world.probe_signal(10 + channel, times) for channel in (1, 2, 3)])
    i = np.array([world.probe_signal(channel, times) for channel in (1, 2, 3)])
    # The artificial star is not N, but their difference has no part in either axis.
    linked = axes @ ((v - np.array(given.phase_resistances)[:, None] * i) @ w)
    last = axes @ np.array([world.probe_signal(channel, [0.04])[0] for channel in (1, 2, 3)])
    assert linked == pytest.approx(fluxes(saturation, *last), rel=1e-6)


def test_a_delta_is_its_y_equivalent(lab: Any) -> None:
    wye = motor(lab)
    delta = motor(
        lab,
        connection="delta",
        phase_resistances=(3 * R,) * 3,
        d_axis_inductance=3 * LD,
        q_axis_inductance=3 * LQ,
        flux_linkage=16e-3 * math.sqrt(3.0),
    )
    times = np.linspace(1e-5, 0.09, 300)
    seen = []
    for given, degrees in ((wye, 20.0), (delta, 50.0)):
        # A delta's first winding lies 30° behind the Y-equivalent's phase.
        world = stepped(lab, given, degrees, 4.0, lab.series_parallel)
        seen.append(world.probe_signal(4, times))
    assert np.allclose(seen[0], seen[1], rtol=1e-6)


def test_constant_current_takes_over(lab: Any) -> None:
    given = motor(lab, phase_resistances=(R, 1.2 * R, 0.8 * R))
    world = stepped(lab, given, 30.0, 4.0, lab.series_parallel, limit=20.0)
    assert world.supply.mode() == "cc"
    assert world.supply.current(0.01) == pytest.approx(20.0)
    line = R + 1.2 * 0.8 / (1.2 + 0.8) * R
    assert world.supply.voltage(0.01) == pytest.approx(20.0 * line)
    world.supply.set_voltage(10.0 * line)
    world.clock.sleep(0.3)
    assert (world.supply.mode(), world.supply.current(0.01)) == ("cv", pytest.approx(10.0))
    start = world.clock.now()
    world.supply.switch(False)
    world.clock.sleep(0.5)
    assert world.supply.current(0.01) == 0.0
    assert np.all(np.diff(world.probe_signal(4, start + np.linspace(0.0, 0.1, 200))) <= 1e-9)
    world.supply.switch(True)
    world.clock.sleep(60.0)
    assert world.supply.current(0.01) == pytest.approx(10.0)


def test_the_bridge_and_small_steps_see_the_nominal_inductances(lab: Any) -> None:
    given, plain = motor(lab), motor(lab, d_axis_saturation_current=math.inf, q_axis_saturation_current=math.inf)
    for degrees in (0.0, 40.0, 90.0):
        readings = []
        for one in (given, plain):
            world, clock = lab.ideal_world(one, initial_angle=math.radians(degrees) / 4)
            world.lock_rotor()
            world.connect({"A": "lcr_high", "B": "lcr_low", "C": "lcr_low"})
            clock.sleep(1.0)
            readings.append(world.impedance(1000.0, 1.0, 0.1))
        assert readings[0] == readings[1]
        small = [stepped(lab, one, degrees, 1e-3, lab.series_parallel) for one in (given, plain)]
        times = np.linspace(1e-4, 0.05, 100)
        assert np.allclose(small[0].probe_signal(4, times), small[1].probe_signal(4, times), rtol=3e-4)


def test_a_free_rotor_does_not_saturate(lab: Any) -> None:
    seen = []
    for given in (motor(lab), lab.lg_400w(**{**vars(motor(lab)), "d_axis_saturation_current": math.inf,
                                             "q_axis_saturation_current": math.inf})):  # fmt: skip
        world, clock = lab.ideal_world(given, initial_angle=0.1)
        world.attach_current_probe(4, "A")
        lab.energise(world, 0.5, 10.0, lab.series_parallel)
        clock.sleep(0.1)
        seen.append(world.probe_signal(4, np.linspace(0.0, 0.1, 50)))
    assert np.array_equal(seen[0], seen[1])


def fluxes(law: Saturation, d_current: float, q_current: float) -> tuple[float, float]:
    """Return what currents (A, peak) add to the flux linkages (V·s, peak) of d and q axis."""
    along, across = law.d_axis_inductance * d_current, law.q_axis_inductance * q_current
    if math.isfinite(law.d_axis_current):
        angle = math.atan(d_current / law.d_axis_current + MAGNET_SHARE) - math.atan(MAGNET_SHARE)
        along = law.d_axis_inductance * law.d_axis_current * (1.0 + MAGNET_SHARE**2) * angle
    if math.isfinite(law.q_axis_current):
        across = law.q_axis_inductance * law.q_axis_current * math.atan(q_current / law.q_axis_current)
    return along, across


def test_the_law() -> None:
    law = Saturation(LD, LQ, D, Q)
    assert law.differential_inductances(0.0, 0.0) == (pytest.approx(LD, rel=1e-15), LQ)
    assert fluxes(law, 0.0, 0.0) == (0.0, 0.0)
    for d, q in ((30.0, -50.0), (-80.0, 10.0)):
        h = 1e-3
        after, before = fluxes(law, d + h, q + h), fluxes(law, d - h, q - h)
        slope = [(high - low) / (2 * h) for high, low in zip(after, before, strict=True)]
        assert slope == pytest.approx(law.differential_inductances(d, q), rel=1e-7)
    assert law.differential_inductances(30.0, 0.0)[0] < LD < law.differential_inductances(-30.0, 0.0)[0]
    assert law.differential_inductances(0.0, Q)[1] == pytest.approx(LQ / 2)
    most = brentq(lambda i: law.differential_inductances(i + 1e-3, 0.0)[0] - law.differential_inductances(i, 0.0)[0],
                  -60.0, 0.0)  # fmt: skip
    assert law.differential_inductances(most, 0.0)[0] == pytest.approx(law.largest[0])
    linear = Saturation(LD, LQ, math.inf, Q)
    assert fluxes(linear, 25.0, 0.0)[0] == pytest.approx(LD * 25.0)
    assert linear.differential_inductances(25.0, 0.0)[0] == pytest.approx(LD)
    assert linear.largest == (LD, LQ)


@pytest.mark.parametrize("value", [0.0, -5.0, math.nan])
def test_a_saturation_current_is_positive(lab: Any, value: float) -> None:
    with pytest.raises(ValueError, match="q_axis_saturation_current"):
        motor(lab, q_axis_saturation_current=value)
