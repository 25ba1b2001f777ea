"""The bridge's reading of a standing, a slowly and a quickly turning rotor."""

import cmath
import math
from typing import Any

import numpy as np
import pytest

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.world.machine_data import Leads
from sim_instruments.world.world import World

LINE = {"B": "lcr_high", "C": "lcr_low"}


def bench(motor: Any, **more: Any) -> tuple[World, VirtualClock]:
    clock = VirtualClock()
    world = World(motor, clock, **{"leads": Leads(0.0, 0.0, 0.0), **more})
    world.connect(LINE)
    clock.sleep(10.0)
    return world, clock


def test_standing_rotor(lab: Any) -> None:
    for angle, expected in ((0.0, 153e-6), (math.pi / 2, 146e-6)):
        world, _ = bench(lab.lg_400w(), initial_angle=angle / 4)
        reading = world.impedance(1000.0, 1.0, 0.1)
        assert reading == pytest.approx(complex(31.7e-3, 2 * math.pi * 1000 * expected), rel=1e-6)


def test_aligned_bridge_reads_one_and_a_half(lab: Any) -> None:
    for angle, expected in ((0.0, 109.5e-6), (math.pi / 2, 114.75e-6)):
        world, _ = bench(lab.lg_400w(phase_resistances=(16e-3,) * 3), initial_angle=angle / 4)
        world.connect({"A": "lcr_high", "B": "lcr_low", "C": "lcr_low"})
        reading = world.impedance(1000.0, 1.0, 0.1)
        assert reading == pytest.approx(complex(24e-3, 2 * math.pi * 1000 * expected), rel=1e-6)


def test_slow_turning_reads_the_mean_over_the_aperture(lab: Any) -> None:
    world, clock = bench(lab.lg_400w(q_axis_inductance=120e-6))
    world.turn_shaft(0.2)
    clock.sleep(1.0)
    start = 4 * (world.dial_angle() - 0.2 * 0.1)
    angles = start + np.linspace(0.0, 4 * 0.2 * 0.1, 2001)
    expected = np.mean(193e-6 + 47e-6 * np.cos(2 * angles))
    reading = world.impedance(1000.0, 1.0, 0.1)
    assert reading.imag / (2 * math.pi * 1000) == pytest.approx(expected, rel=1e-3)


def test_quick_turning_spoils_the_reading(lab: Any) -> None:
    def error(speed: float) -> float:
        world, clock = bench(lab.lg_400w())
        world.turn_shaft(speed)
        clock.sleep(1.03)
        return abs(world.impedance(1000.0, 1.0, 0.1).imag / (2 * math.pi * 1000) - 149.5e-6)

    assert error(0.1) < 3.6e-6
    assert max(error(66.0), error(73.0), error(80.0)) > 10e-6
    # The EMF alone is more than the bridge takes.
    assert math.isnan(error(104.0))


def test_leak_is_that_of_a_rectangular_window(lab: Any) -> None:
    """The whole measurement replayed on samples: source behind 100 Ω, EMF in series, one Fourier component."""
    motor = lab.lg_400w(q_axis_inductance=73e-6, phase_resistances=(16e-3,) * 3)
    world, clock = bench(motor)
    world.turn_shaft(7.3)
    clock.sleep(2.0)
    frequency, window = 1000.0, 0.05
    omega = 2 * math.pi * frequency
    count = 400_000
    s = (np.arange(count) + 0.5) / count * window - 0.5 * window
    world.attach_voltage_probe(1, "B", "C")
    emf = world.probe_signal(1, clock.now() - 0.5 * window + s)
    impedance = complex(32e-3, omega * 146e-6)
    leak = 2 * np.mean(emf * np.exp(-1j * omega * s))
    source = math.sqrt(2)
    current = (source - leak) / (100.0 + impedance)
    expected = (source - 100.0 * current) / current
    assert abs(leak) > 1e-5
    assert world.impedance(frequency, 1.0, window) == pytest.approx(expected, rel=1e-6)


def test_shorted_leads_read_what_the_fixture_leaves(lab: Any) -> None:
    world, _ = bench(lab.lg_400w(), leads=Leads(0.0, 2e-3, 30e-9))
    open_reading = world.impedance(1000.0, 1.0, 0.1)
    world.short_leads(True)
    short = world.impedance(1000.0, 1.0, 0.1)
    assert short == pytest.approx(complex(2e-3, 2 * math.pi * 1000 * 30e-9))
    world.short_leads(False)
    assert (open_reading - short).real == pytest.approx(31.7e-3, rel=1e-6)


def test_no_path_is_infinite(lab: Any) -> None:
    world, _ = bench(lab.lg_400w())
    world.connect({"A": "lcr_high"})
    assert cmath.isinf(world.impedance(1000.0, 1.0, 0.1))
    world.connect(LINE)
    world.set_open_phase("C")
    assert cmath.isinf(world.impedance(1000.0, 1.0, 0.1))
    with pytest.raises(ValueError, match="frequency is 0"):
        world.impedance(0.0, 1.0, 0.1)


def test_temperature_shows_in_the_resistance(lab: Any) -> None:
    world, clock = bench(lab.lg_400w())
    world.set_winding_temperature(85.0)
    ratio = (1 + 0.00393 * 65) / (1 + 0.00393 * 5)
    assert world.impedance(1000.0, 1.0, 0.1).real == pytest.approx(31.7e-3 * ratio)
    clock.sleep(600.0)
    cooled = 25.0 + 60.0 / math.e
    assert world.truth()["winding_temperature"] == pytest.approx(cooled)
    assert world.impedance(1000.0, 1.0, 0.1).real == pytest.approx(
        31.7e-3 * (1 + 0.00393 * (cooled - 20)) / (1 + 0.00393 * 5)
    )
    world.set_ambient_temperature(40.0)
    clock.sleep(60_000.0)
    assert world.truth()["winding_temperature"] == pytest.approx(40.0)


def test_current_heats_the_winding_to_its_balance(lab: Any) -> None:
    motor = lab.lg_400w(phase_resistances=(16e-3,) * 3, thermal_resistance=5.0, thermal_time_constant=60.0)
    world, clock = lab.ideal_world(motor)
    world.lock_rotor()
    lab.energise(world, 5.0, 10.0, lab.series_parallel)
    clock.sleep(1200.0)
    temperature = world.truth()["winding_temperature"]
    resistance = 24e-3 * (1 + 0.00393 * (temperature - 20)) / (1 + 0.00393 * 5)
    assert temperature == pytest.approx(25.0 + 5.0 * 100.0 * resistance, rel=1e-3)
    assert world.supply.voltage(1.0) == pytest.approx(10.0 * resistance, rel=1e-3)
