"""The six-step drive as a part of the world: speed, waveforms, bus, load steps, faults."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.six_step.drive import EmfHarmonic, SixStepDrive
from sim_instruments.six_step.load import balance_load
from sim_instruments.six_step.machine import virtual_motor
from sim_instruments.six_step.run_up import run_up
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import SteadyState, steady_state
from sim_instruments.world.machine_data import DynamometerMachine
from sim_instruments.world.sources.six_step_output import SixStepOutput
from sim_instruments.world.world import World
from tests.sim_instruments.motors import SIX_STEP

WIRED = {"A": "drive_1", "B": "drive_2", "C": "drive_3"}
RPM = math.pi / 30.0
#: A dynamometer's machine that takes nothing for itself.
LIGHT = DynamometerMachine(inertia=0.0, coulomb_friction=0.0, viscous_friction=0.0)
WYE = replace(SIX_STEP, connection="wye", advance_angle=0.1, emf_harmonics=(EmfHarmonic(5, 0.04, 0.3),))


class Stand:
    """A drive's motor on the dynamometer, wired and coupled."""

    def __init__(self, drive: SixStepDrive = SIX_STEP, *, machine: DynamometerMachine = LIGHT, **more: Any) -> None:
        self.drive = drive
        self.clock = VirtualClock()
        self.world = World(virtual_motor(drive), self.clock, six_step=drive, dynamometer=machine, **more)
        self.world.couple_dynamometer()
        self.world.connect(WIRED)

    @property
    def output(self) -> SixStepOutput:
        assert self.world.six_step is not None
        return self.world.six_step

    def load(self, torque: float, seconds: float) -> None:
        """Brake with a torque (N·m) and let time pass."""
        self.world.dynamometer.set_mode("torque")
        self.world.dynamometer.command(-torque)
        self.world.dynamometer.enable(True)
        self.clock.sleep(seconds)

    def running(self, torque: float) -> "Stand":
        self.output.enable(True)
        self.load(torque, 3.0)
        return self

    def window(self, seconds: float, count: int) -> np.ndarray:
        return np.linspace(self.clock.now() - seconds, self.clock.now(), count)

    def times_in(self, steady: SteadyState, times: np.ndarray) -> np.ndarray:
        """Times since a state T1T2 began, from the shaft's angle at `times`, told from the present one."""
        electrical = self.drive.pole_pairs * (
            self.world.dial_angle() - steady.speed * (self.clock.now() - np.asarray(times))
        )
        # The EMF of the first winding is −sin of the rotor's angle here and cos in the model.
        start = (math.pi / 6 if self.drive.connection == "delta" else 0.0) - self.drive.advance_angle
        return (electrical + math.pi / 2 - start) / (self.drive.pole_pairs * steady.speed)


@pytest.fixture(scope="module", params=[SIX_STEP, WYE], ids=["delta", "wye"])
def loaded(request: pytest.FixtureRequest) -> tuple[Stand, SteadyState]:
    return Stand(request.param).running(0.5), balance_load(Bridge(request.param), 0.5)


def test_the_documents_speed_at_half_a_newton_metre() -> None:
    stand = Stand().running(0.5)
    assert stand.world.shaft_speed(1.0) / RPM == pytest.approx(3251.7, rel=1e-5)
    assert stand.world.shaft_speed(0.5) / RPM == pytest.approx(3256.0, rel=2e-3)
    assert stand.world.dynamometer.torque(0.5) == pytest.approx(-0.5)
    assert stand.output.electrical_frequency() == pytest.approx(4 * 3251.7 / 60, rel=1e-5)


def test_line_currents_and_voltages_are_the_models(loaded: tuple[Stand, SteadyState]) -> None:
    stand, model = loaded
    times = stand.window(0.02, 4001)
    here = stand.times_in(model, times)
    for row, terminal in enumerate(("A", "B", "C")):
        stand.world.attach_current_probe(4, terminal)
        assert stand.world.probe_signal(4, times) == pytest.approx(model.line_currents(here)[row], abs=1e-6)
    stand.world.attach_voltage_probe(1, "A", "B")
    stand.world.attach_voltage_probe(2, "C", "star")
    legs = model.leg_voltages(here)
    seen = np.abs(stand.world.probe_signal(1, times) - (legs[0] - legs[1]))
    star = np.abs(stand.world.probe_signal(2, times) - (legs[2] - legs.mean(axis=0)))
    # A sample beside a commutation may fall to either side of its jump.
    assert np.sort(seen)[:-4].max() < 1e-5
    assert np.sort(star)[:-4].max() < 1e-5


def test_currents_and_emf_make_the_torque_on_the_bench_too(loaded: tuple[Stand, SteadyState]) -> None:
    stand, model = loaded
    truth = stand.world.truth()
    friction = stand.drive.coulomb_friction + stand.drive.viscous_friction * model.speed
    assert truth["motor_torque"] == pytest.approx(0.5 + friction, rel=1e-6)
    # Same winding, same EMF: what the bench would show of it with open terminals.
    times = stand.window(model.period, 20_001)
    open_circuit = World(virtual_motor(stand.drive), VirtualClock(), initial_angle=stand.world.dial_angle())
    open_circuit.turn_shaft(model.speed)
    open_circuit.attach_voltage_probe(1, "A", "B")
    emf = open_circuit.probe_signal(1, np.array([0.0]))[0]
    a, b, _ = model.emfs(stand.times_in(model, times[-1:]))[:, 0]
    assert emf == pytest.approx(a if stand.drive.connection == "delta" else a - b, abs=1e-5)


def test_bus_means_are_the_models(loaded: tuple[Stand, SteadyState]) -> None:
    stand, model = loaded
    whole = 20 * model.period
    assert stand.output.bus_current(whole) == pytest.approx(model.average_supply_current, rel=1e-6)
    assert stand.output.bus_voltage(whole) == pytest.approx(model.average_bus_voltage, rel=1e-7)
    times = stand.window(0.0031, 400_001)
    here = stand.times_in(model, times)
    assert stand.output.bus_current(0.0031) == pytest.approx(np.trapezoid(model.supply_current(here), here) / 0.0031)
    assert stand.output.bus_current(0.0) == pytest.approx(model.supply_current(here[-1:])[0], abs=1e-5)
    assert stand.output.bus_voltage(0.0) == pytest.approx(model.bus_voltage(here[-1:])[0], abs=1e-6)


def test_hall_signals_tell_the_state(loaded: tuple[Stand, SteadyState]) -> None:
    stand, model = loaded
    order = []
    for _ in range(60):
        stand.clock.sleep(model.state_time / 5.0)
        state = math.floor(stand.times_in(model, np.array([stand.clock.now()]))[0] / model.state_time + 1e-6) % 6
        pattern = stand.output.hall_state()
        assert pattern == [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)][state]
        order.append(state)
    assert set(order) == set(range(6))


def test_the_dynamometers_own_machine_brakes_too() -> None:
    machine = DynamometerMachine(inertia=1e-4, coulomb_friction=0.02, viscous_friction=5e-5)
    stand = Stand(machine=machine)
    stand.output.enable(True)
    stand.clock.sleep(5.0)
    speed = stand.world.shaft_speed(0.5)
    model = steady_state(Bridge(SIX_STEP), speed)
    assert model.load_torque == pytest.approx(0.02 + 5e-5 * speed, rel=1e-6)
    assert speed < Stand().running(0.0).world.shaft_speed(0.1)


@pytest.mark.slow
def test_a_load_step_settles_on_the_time_scale_of_the_exact_run_up() -> None:
    stand = Stand().running(0.3)
    before = stand.world.shaft_speed(0.0)
    after = balance_load(Bridge(SIX_STEP), 0.6).speed
    exact = run_up(Bridge(SIX_STEP), 0.3, load_torque=0.6, initial_speed=before)
    stand.load(0.6, 0.0)
    speeds = []
    for _ in range(100):
        stand.clock.sleep(3e-3)
        speeds.append(stand.world.shaft_speed(0.0))
    assert np.all(np.diff(speeds) <= 0.0)
    threshold = before + 0.9 * (after - before)
    settled = 3e-3 * (1 + int(np.argmax(np.array(speeds) < threshold)))
    assert settled == pytest.approx(float(exact.times[np.argmax(exact.speeds < threshold)]), rel=0.25)
    # Mean bus current on the way lies between the ends; the source's resistance ties the voltage to it.
    current, voltage = stand.output.bus_current(0.3), stand.output.bus_voltage(0.3)
    low, high = (balance_load(Bridge(SIX_STEP), load).average_supply_current for load in (0.3, 0.6))
    assert low < current < high
    assert voltage == pytest.approx(SIX_STEP.source_voltage - SIX_STEP.source_resistance * current, rel=1e-6)
    stand.clock.sleep(2.0)
    assert stand.world.shaft_speed(0.1) == pytest.approx(after, rel=1e-6)


def test_waveforms_on_the_way_are_those_of_the_present_speed() -> None:
    stand = Stand().running(0.3)
    stand.world.attach_current_probe(4, "A")
    stand.load(0.8, 0.0)
    start = stand.clock.now()
    for _ in range(50):
        stand.clock.sleep(1e-3)
        now = np.array([stand.clock.now()])
        model = steady_state(Bridge(SIX_STEP), stand.world.shaft_speed(0.0))
        expected = model.line_currents(stand.times_in(model, now))[0, 0]
        assert stand.world.probe_signal(4, now)[0] == pytest.approx(expected, abs=0.1)
    times = np.linspace(start, stand.clock.now(), 20_001)
    # Nowhere does the current jump where one steady state hands over to the next.
    assert np.abs(np.diff(stand.world.probe_signal(4, times))).max() < 0.5


def test_driven_at_a_speed_the_dynamometer_takes_what_is_left() -> None:
    stand = Stand()
    stand.world.dynamometer.command(3000 * RPM)
    stand.world.dynamometer.enable(True)
    stand.clock.sleep(3.0)
    stand.output.enable(True)
    stand.clock.sleep(1.0)
    model = steady_state(Bridge(SIX_STEP), 3000 * RPM)
    assert stand.world.shaft_speed(0.5) / RPM == pytest.approx(3000.0, rel=1e-4)
    assert stand.world.dynamometer.torque(0.5) == pytest.approx(-model.load_torque, rel=1e-3)
    assert stand.output.bus_current(0.5) == pytest.approx(model.average_supply_current, rel=1e-3)
    # Above the speed at which the EMF beats the source, energy goes back.
    stand.world.dynamometer.command(5000 * RPM)
    stand.clock.sleep(2.0)
    assert stand.output.bus_current(0.2) < 0.0
    assert stand.output.bus_voltage(0.2) > SIX_STEP.source_voltage
    assert stand.output.fault is None


def test_driven_by_torque_it_stops_at_the_dynamometers_largest_speed() -> None:
    stand = Stand(machine=replace(LIGHT, maximum_speed=420.0)).running(-0.5)
    assert stand.world.shaft_speed(0.1) == pytest.approx(420.0)
    model = steady_state(Bridge(SIX_STEP), 420.0)
    assert stand.world.dynamometer.torque(0.1) == pytest.approx(-model.load_torque, rel=1e-6)
    assert -model.load_torque < 0.5


def test_uncoupled_it_runs_light() -> None:
    stand = Stand()
    stand.world.uncouple_dynamometer()
    stand.output.enable(True)
    stand.clock.sleep(3.0)
    assert stand.world.shaft_speed(0.1) == pytest.approx(balance_load(Bridge(SIX_STEP), 0.0).speed, rel=1e-6)


def test_off_it_coasts_and_the_bus_is_idle() -> None:
    stand = Stand().running(0.2)
    stand.world.dynamometer.enable(False)
    stand.output.enable(False)
    stand.world.attach_current_probe(4, "A")
    stand.clock.sleep(0.1)
    assert stand.output.bus_voltage(0.02) == pytest.approx(SIX_STEP.source_voltage)
    assert stand.output.bus_current(0.02) == 0.0
    assert np.all(stand.world.probe_signal(4, stand.window(0.05, 100)) == 0.0)
    stand.clock.sleep(5.0)
    assert stand.world.shaft_speed(0.1) == 0.0
    assert stand.output.electrical_frequency() == 0.0
    # The part of the window before it was switched off still counts.
    stand.output.enable(True)
    stand.clock.sleep(2.0)
    running = stand.output.bus_current(1.0)
    stand.output.enable(False)
    stand.clock.sleep(1.0)
    assert stand.output.bus_current(2.0) == pytest.approx(0.5 * running, rel=1e-2)


def test_a_warm_winding_has_more_resistance_and_weaker_magnets() -> None:
    stand = Stand().running(0.5)
    stand.world.set_winding_temperature(90.0)
    stand.clock.sleep(1.0)
    copper = (1.0 + 0.00393 * 70.0) / (1.0 + 0.00393 * 5.0)
    warm = replace(SIX_STEP, resistance=SIX_STEP.resistance * copper, emf_constant=SIX_STEP.emf_constant * 0.935)
    # The stage goes by quarters of a kelvin, and the winding has cooled by a little.
    assert stand.world.shaft_speed(0.01) == pytest.approx(balance_load(Bridge(warm), 0.5).speed, rel=5e-4)


def wiring(**sockets: str) -> Callable[[Stand], None]:
    return lambda stand: stand.world.connect(sockets)


@pytest.mark.parametrize(
    ("spoil", "fault"),
    [
        (wiring(A="drive_1", B="drive_2"), "output phase missing"),
        (wiring(A="drive_1", B="drive_2", C="inverter_w"), "output phase missing"),
        (wiring(A="drive_1", B="drive_1", C="drive_3"), "output phase missing"),
        (wiring(A="drive_2", B="drive_1", C="drive_3"), "overcurrent"),
        (wiring(A="drive_2", B="drive_3", C="drive_1"), "overcurrent"),
        (lambda stand: stand.world.set_swapped(("A", "C")), "overcurrent"),
        (lambda stand: stand.world.set_open_phase("B"), "output phase missing"),
        (lambda stand: stand.world.lock_rotor(), "no rotation"),
        (lambda stand: stand.world.set_stuck_rotor(True), "no rotation"),
        (lambda stand: stand.load(9.9, 0.0), "no rotation"),
    ],
)
@pytest.mark.parametrize("already_running", [False, True])
def test_what_it_cannot_run_with_makes_it_trip(
    spoil: Callable[[Stand], None], fault: str, already_running: bool
) -> None:
    stand = Stand()
    if already_running:
        stand.output.enable(True)
        stand.clock.sleep(0.5)
        spoil(stand)
    else:
        spoil(stand)
        stand.output.enable(True)
    assert not stand.output.enabled
    assert stand.output.fault == fault
    assert stand.world.truth()["six_step_fault"] == fault
    stand.clock.sleep(1.0)
    assert stand.output.bus_current(0.5) == 0.0


def test_switching_on_again_clears_the_fault() -> None:
    stand = Stand()
    stand.world.lock_rotor()
    stand.output.enable(True)
    assert stand.output.fault == "no rotation"
    stand.world.release_rotor()
    stand.output.enable(True)
    assert (stand.output.enabled, stand.output.fault) == (True, None)


def test_a_shaft_that_turns_backwards_is_too_much() -> None:
    stand = Stand()
    stand.world.dynamometer.command(-100.0)
    stand.world.dynamometer.enable(True)
    stand.clock.sleep(2.0)
    stand.output.enable(True)
    assert stand.output.fault == "overcurrent"
    stand.world.dynamometer.enable(False)
    stand.output.enable(True)
    assert stand.output.fault == "overcurrent"


def test_braked_to_standstill_by_the_dynamometer_it_trips_there() -> None:
    stand = Stand()
    stand.world.dynamometer.command(200.0)
    stand.world.dynamometer.enable(True)
    stand.clock.sleep(2.0)
    stand.output.enable(True)
    stand.world.dynamometer.command(0.0)
    stand.clock.sleep(0.2)
    assert stand.output.enabled
    assert stand.output.bus_current(0.05) > balance_load(Bridge(SIX_STEP), 0.5).average_supply_current
    stand.clock.sleep(2.0)
    assert stand.output.fault == "no rotation"


def test_a_bench_without_the_drive_has_no_such_sockets() -> None:
    world = World(virtual_motor(SIX_STEP), VirtualClock())
    assert world.six_step is None
    with pytest.raises(ValueError, match="'drive_1' for terminal A is unknown"):
        world.connect(WIRED)


def test_the_motor_must_be_the_drives_machine() -> None:
    with pytest.raises(ValueError, match="pole_pairs 4 and the motor on the bench 7"):
        World(
            virtual_motor(replace(SIX_STEP, pole_pairs=7, emf_constant=0.0613 * 7 / 4)),
            VirtualClock(),
            six_step=SIX_STEP,
        )
