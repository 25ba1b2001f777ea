"""A locked rotor on the supply: closed form against integration, and the supply's own regimes."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.windings import Windings
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.machine_data import Leads, SupplyStage
from sim_instruments.world.segment import State
from sim_instruments.world.settings import SupplySettings
from sim_instruments.world.sources.supply_regime import regime
from sim_instruments.world.world import World


@pytest.mark.parametrize(("angle", "inductance"), [(0.0, 73e-6), (math.pi / 2, 76.5e-6)])
def test_step_response_of_series_parallel(lab: Any, angle: float, inductance: float) -> None:
    motor = lab.lg_400w(phase_resistances=(16e-3,) * 3, thermal_resistance=0.0)
    world, clock = lab.ideal_world(motor, initial_angle=angle / 4)
    world.lock_rotor()
    world.attach_current_probe(4, "A")
    lab.energise(world, 0.05, 50.0, lab.series_parallel)
    clock.sleep(0.05)
    times = np.linspace(1e-6, 0.05, 500)
    tau = inductance / 16e-3
    expected = 0.05 / 24e-3 * (1.0 - np.exp(-times / tau))
    # The ramp of 5 ns shifts the step by half its length.
    assert np.allclose(world.probe_signal(4, times), expected, rtol=1e-5, atol=2e-6)


def abc_wye(
    motor: VirtualMotor, angle: float, voltage: Any, resistance: float, lead: float, times: np.ndarray
) -> np.ndarray:
    """Terminal currents of A → (B ∥ C) from a wye's phase equations, star point eliminated by hand."""
    windings = Windings(motor, 25.0)
    L = windings.inductance(angle)
    ra, rb, rc = windings.resistance + lead

    def slopes(t: float, y: np.ndarray) -> np.ndarray:
        ib, ic = y
        ia = -ib - ic
        # v_A − v_B = u and v_A − v_C = u, with i_A = −(i_B + i_C)
        u = voltage(t) - resistance * ia
        right = np.array([u - ra * ia + rb * ib, u - ra * ia + rc * ic])
        rows = np.array([L[0] - L[1], L[0] - L[2]])
        matrix = np.column_stack([rows[:, 1] - rows[:, 0], rows[:, 2] - rows[:, 0]])
        return np.linalg.solve(matrix, right)

    solution = solve_ivp(slopes, (0.0, times[-1]), [0.0, 0.0], t_eval=times, rtol=1e-10, atol=1e-12, max_step=1e-4)
    ib, ic = solution.y
    return np.array([-ib - ic, ib, ic])


def test_ramped_step_of_unequal_phases_against_integration(lab: Any) -> None:
    motor = lab.lg_400w(phase_resistances=(16e-3, 20e-3, 12e-3), q_axis_inductance=150e-6, thermal_resistance=0.0)
    clock = VirtualClock()
    world = World(
        motor,
        clock,
        supply=SupplyStage(output_resistance=0.01, slew=100.0),
        leads=Leads(0.002),
        initial_angle=0.6 / 4,
    )
    world.lock_rotor()
    for channel, terminal in enumerate("ABC", start=1):
        world.attach_current_probe(channel, terminal)  # type: ignore[arg-type]
    lab.energise(world, 0.1, 10.0, lab.series_parallel)
    clock.sleep(0.03)
    times = np.linspace(0.0, 0.03, 301)
    expected = abc_wye(motor, 0.6, lambda t: min(100.0 * t, 0.1), 0.01, 0.002, times)
    seen = np.array([world.probe_signal(channel, times) for channel in (1, 2, 3)])
    assert np.allclose(seen, expected, atol=2e-6)


def test_constant_current_takes_over_at_the_limit_and_voltage_follows(lab: Any) -> None:
    motor = lab.lg_400w(phase_resistances=(16e-3,) * 3, thermal_resistance=0.0)
    world, clock = lab.ideal_world(motor)
    world.lock_rotor()
    world.attach_current_probe(4, "A")
    world.attach_voltage_probe(1, "A", "B")
    lab.energise(world, 0.3, 3.0, lab.series_parallel)
    clock.sleep(0.1)
    crossing = -73e-6 / 16e-3 * math.log(1.0 - 3.0 * 24e-3 / 0.3)
    before, after = world.probe_signal(4, [crossing - 1e-5, crossing + 1e-5])
    assert before < 3.0 - 0.01
    assert after == pytest.approx(3.0)
    assert world.probe_signal(1, [crossing - 1e-5, crossing + 1e-5]) == pytest.approx([0.3, 0.072], rel=1e-6)
    assert world.supply.mode() == "cc"
    assert world.supply.voltage(0.01) == pytest.approx(0.072)
    world.supply.set_current_limit(5.0)
    clock.sleep(0.1)
    assert (world.supply.mode(), world.supply.current(0.01)) == ("cc", pytest.approx(5.0))
    world.supply.set_current_limit(2.0)
    assert world.supply.mode() == "unregulated"
    clock.sleep(0.1)
    assert (world.supply.mode(), world.supply.current(0.01)) == ("cc", pytest.approx(2.0))
    world.supply.set_voltage(0.024)
    clock.sleep(0.1)
    assert (world.supply.mode(), world.supply.current(0.01)) == ("cv", pytest.approx(1.0))


def test_switching_off_lets_the_current_decay_before_the_output_opens(lab: Any) -> None:
    motor = lab.lg_400w(phase_resistances=(16e-3,) * 3, thermal_resistance=0.0)
    world, clock = lab.ideal_world(motor)
    world.lock_rotor()
    world.attach_current_probe(4, "A")
    lab.energise(world, 0.048, 10.0, lab.series_parallel)
    clock.sleep(0.2)
    start = clock.now()
    world.supply.switch(False)
    assert world.supply.mode() == "off"
    clock.sleep(0.2)
    times = start + np.linspace(1e-6, 0.04, 50)
    assert np.allclose(world.probe_signal(4, times), 2.0 * np.exp(-(times - start) * 16e-3 / 73e-6), atol=1e-4)
    assert world.supply.current(0.01) == 0.0
    assert world.supply.current(0.2) == pytest.approx(2.0 * 73e-6 / 16e-3 / 0.2, rel=1e-3)


def test_an_output_opens_where_time_cannot_be_told_closer(lab: Any) -> None:
    # A turning rotor drives the last current down so quickly that between two doubles of time it falls by 0.1 nA.
    windings = Windings(lab.lg_400w(), 25.0)
    network = Network(windings, ("supply+", "supply-", "supply-"), ("supply+", "supply-"))
    for current, stays in ((1.00000116e-4, False), (1.1e-4, True)):
        state = State(0.0, -0.5, np.array([current, 1.15, -1.15 - current]), 0.0, 25.0)
        found = regime(SupplySettings(), 1.0, SupplyStage(), state, network, 587.8)
        assert (found is not None) == stays


def test_energy_from_the_supply_is_loss_and_stored_energy(lab: Any) -> None:
    motor = lab.lg_400w(thermal_resistance=0.0, q_axis_inductance=120e-6)
    clock = VirtualClock()
    world = World(motor, clock, initial_angle=0.1)
    world.lock_rotor()
    for channel, terminal in enumerate("ABC", start=1):
        world.attach_current_probe(channel, terminal)  # type: ignore[arg-type]
        world.attach_voltage_probe(10 + channel, terminal, "star")  # type: ignore[arg-type]
    lab.energise(world, 0.1, 10.0, lab.series_parallel)
    clock.sleep(0.004)
    edges = np.array([0.0, 1e-4, 1e-3, 4e-3])
    points, weights = np.polynomial.legendre.leggauss(20)
    half, middle = np.diff(edges) / 2, (edges[1:] + edges[:-1]) / 2
    times = (middle[:, None] + half[:, None] * points).ravel()
    w = (half[:, None] * weights).ravel()
    i = np.array([world.probe_signal(channel, times) for channel in (1, 2, 3)])
    v = np.array([world.probe_signal(10 + channel, times) for channel in (1, 2, 3)])
    delivered = w @ (i * v).sum(axis=0)
    windings = Windings(motor, 25.0)
    lost = w @ (windings.resistance @ i**2)
    last = np.array([world.probe_signal(channel, [0.004])[0] for channel in (1, 2, 3)])
    stored = 0.5 * last @ windings.inductance(0.4) @ last
    assert delivered == pytest.approx(lost + stored, rel=1e-6)
    assert i.sum(axis=0) == pytest.approx(0.0, abs=1e-12)


def test_protections_trip(lab: Any) -> None:
    world, clock = lab.ideal_world(lab.lg_400w())
    world.lock_rotor()
    world.supply.set_over_current(True)
    lab.energise(world, 0.3, 1.0, lab.series_parallel)
    clock.sleep(0.02)
    assert world.supply.tripped is None
    clock.sleep(0.1)
    assert (world.supply.tripped, world.supply.mode(), world.supply.is_on) == ("current", "tripped", False)
    world.supply.switch(True)
    assert not world.supply.is_on
    world.supply.clear_trip()
    world.supply.set_over_current(False)
    world.supply.set_over_voltage(0.2)
    world.supply.switch(True)
    clock.sleep(0.1)
    assert world.supply.tripped == "voltage"
    with pytest.raises(ValueError, match=r"outside 0 … 60 V"):
        world.supply.set_voltage(61.0)


def test_an_open_path_carries_no_current(lab: Any) -> None:
    world, clock = lab.ideal_world(lab.lg_400w())
    lab.energise(world, 5.0, 1.0, {"A": "supply+"})
    clock.sleep(1.0)
    assert (world.supply.mode(), world.supply.current(0.1), world.supply.voltage(0.1)) == (
        "cv",
        0.0,
        pytest.approx(5.0),
    )
    world.connect(lab.series_parallel)
    world.set_open_phase("A")
    clock.sleep(1.0)
    assert world.supply.current(0.1) == 0.0
    world.set_open_phase(None)
    world.lock_rotor()
    clock.sleep(1.0)
    assert world.supply.mode() == "cc"


def test_probes_see_labels_not_motor_terminals(lab: Any) -> None:
    world, clock = lab.ideal_world(lab.lg_400w(phase_resistances=(16e-3, 20e-3, 12e-3)))
    world.lock_rotor()
    world.set_swapped(("A", "B"))
    lab.energise(world, 0.01, 50.0, {"A": "supply+", "B": "supply-"})
    world.attach_current_probe(1, "A")
    world.attach_current_probe(2, "C")
    clock.sleep(0.5)
    assert world.probe_signal(1, [clock.now()])[0] == pytest.approx(0.01 / 36e-3, rel=1e-4)
    assert world.probe_signal(2, [clock.now()])[0] == pytest.approx(0.0, abs=1e-12)
    assert world.probe_signal(7, [0.1, 0.2]).tolist() == [0.0, 0.0]


def test_history_is_for_the_past_only(lab: Any) -> None:
    world, clock = lab.ideal_world(lab.outrunner())
    world.attach_voltage_probe(1, "A", "star")
    assert world.probe_signal(1, np.array([[-600.0, 0.0]])).tolist() == [[0.0, 0.0]]
    clock.sleep(0.01)
    assert (world.supply.current(5.0), world.shaft_speed(5.0), world.dynamometer.torque(5.0)) == (0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="still to come"):
        world.probe_signal(1, [1.0])
    for _ in range(30):
        clock.sleep(60.0)
        world.short_leads(True)
    with pytest.raises(ValueError, match="no longer known"):
        world.probe_signal(1, [1.0])
