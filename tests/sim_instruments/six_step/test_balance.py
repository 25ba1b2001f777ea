"""Energy and waveforms hold together for any drive."""

import math
import warnings

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sim_instruments.six_step.balance import losses, power_residual, winding_rms
from sim_instruments.six_step.circuit import Observables
from sim_instruments.six_step.drive import EmfHarmonic, SixStepDrive
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import steady_state


@st.composite
def drives(draw: st.DrawFn) -> SixStepDrive:
    inductance = 10 ** draw(st.floats(-5, -2))
    orders = draw(st.lists(st.sampled_from([3, 5, 7, 9, 11]), unique=True, max_size=3))
    switch_resistance = draw(st.sampled_from([0.0, 0.003, 0.1]))
    return SixStepDrive(
        connection=draw(st.sampled_from(["delta", "wye"])),
        resistance=10 ** draw(st.floats(-2, 1)),
        self_inductance=inductance,
        mutual_inductance=inductance * draw(st.floats(-0.49, 0.9)),
        emf_constant=10 ** draw(st.floats(-2, 0)),
        pole_pairs=draw(st.integers(1, 20)),
        source_voltage=draw(st.floats(5, 400)),
        source_resistance=draw(st.sampled_from([0.0, 0.01, 0.3])),
        switch_resistance=switch_resistance,
        # A diode without drop beside a resistive switch changes over without end at no current.
        diode_drop=draw(st.sampled_from([0.7, 1.5] if switch_resistance else [0.0, 0.7, 1.5])),
        inertia=1e-4,
        coulomb_friction=0.01,
        viscous_friction=1e-5,
        emf_harmonics=tuple(EmfHarmonic(n, draw(st.floats(-0.3, 0.3)), draw(st.floats(-3, 3))) for n in orders),
        advance_angle=draw(st.floats(-1.0, 1.0)),
    )


RELATIVE_SPEED = st.floats(-2.5, 1.0).map(lambda x: 10**x)


@settings(max_examples=80, deadline=None)
@given(drives(), RELATIVE_SPEED)
def test_power_closes(drive: SixStepDrive, relative: float) -> None:
    bridge = Bridge(drive)
    steady = steady_state(bridge, relative * bridge.no_load_speed)
    assert abs(power_residual(steady)) < 1e-9
    found = losses(steady)
    assert min(found.copper, found.switches, found.diode, found.source, found.friction) >= 0.0


@settings(max_examples=25, deadline=None)
@given(drives(), RELATIVE_SPEED)
def test_waveforms_are_periodic_continuous_and_obey_kirchhoff(drive: SixStepDrive, relative: float) -> None:
    bridge = Bridge(drive)
    steady = steady_state(bridge, relative * bridge.no_load_speed)
    scale = bridge.current_scale * (1 + relative)
    times = np.linspace(-0.3, 1.3, 997) * steady.period
    current, line, legs = steady.winding_currents(times), steady.line_currents(times), steady.leg_voltages(times)
    voltage, bus = steady.winding_voltages(times), steady.bus_voltage(times)
    # Beyond it the other diode of the leg conducts beside the switch, which the model has not.
    assume((drive.source_resistance + drive.switch_resistance) * np.abs(line).max() < drive.source_voltage)
    assert np.abs(line.sum(axis=0)).max() < 1e-9 * scale
    assert np.abs(steady.winding_currents(times + 2 * steady.period) - current).max() < 1e-6 * scale
    if drive.connection == "delta":
        assert np.abs(voltage - (legs - np.roll(legs, -1, axis=0))).max() < 1e-8 * drive.source_voltage * (1 + relative)
    else:
        neutral = legs - voltage
        assert np.abs(neutral - neutral[0]).max() < 1e-8 * drive.source_voltage * (1 + relative)
    assert (legs.max(axis=0) <= bus + drive.diode_drop + 1e-6 * drive.source_voltage).all()
    assert (legs.min(axis=0) >= -drive.diode_drop - 1e-6 * drive.source_voltage).all()
    edges = np.arange(6) * steady.state_time
    jump = steady.winding_currents(edges) - steady.winding_currents(edges - 1e-9 * steady.state_time)
    assert np.abs(jump).max() < 1e-5 * scale


def test_averages_are_those_of_the_waveforms(bridge: Bridge) -> None:
    steady = steady_state(bridge, 500.0)
    times = (np.arange(20000) + 0.5) / 20000 * steady.state_time
    averages = steady.averages
    assert np.allclose(steady.winding_currents(times).mean(axis=1), averages[Observables.currents], atol=1e-5)
    assert np.allclose(steady.leg_voltages(times).mean(axis=1), averages[Observables.leg_voltages], atol=1e-3)
    assert math.isclose(steady.bus_voltage(times).mean(), steady.average_bus_voltage, rel_tol=1e-6)
    assert math.isclose(steady.supply_current(times).mean(), steady.average_supply_current, rel_tol=1e-5)
    assert math.isclose(steady.torque(times).mean(), steady.electromagnetic_torque, rel_tol=1e-5)
    assert np.allclose(np.sqrt((steady.winding_currents(times) ** 2).mean(axis=1)), winding_rms(steady), rtol=1e-6)


def test_the_idle_leg_floats_between_the_rails_and_the_bus_returns_energy_above_no_load(bridge: Bridge) -> None:
    motoring, generating = steady_state(bridge, 340.0), steady_state(bridge, 500.0)
    late = 0.9 * motoring.state_time
    assert 0.0 < motoring.leg_voltages(late)[1, 0] < motoring.bus_voltage(late)[0]
    assert motoring.average_supply_current > 0
    assert generating.average_supply_current < 0
    assert generating.average_bus_voltage > bridge.drive.source_voltage
    assert generating.electromagnetic_torque < 0


def test_no_warning_over_a_wide_sweep(bridge: Bridge) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for relative in np.geomspace(1e-8, 1e5, 40):
            assert math.isfinite(steady_state(bridge, relative * bridge.no_load_speed).electromagnetic_torque)
