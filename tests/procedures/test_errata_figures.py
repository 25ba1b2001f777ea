"""Where the sources contradict themselves: the printed figure, the right one, and that the code that measures gives it."""

import math

import numpy as np
import pytest
from GTC import ureal

from procedures.core.actions import ALIGN_D, Connect, Socket, Terminal, meter_across, meter_series_parallel
from procedures.core.bench import ProcedureError
from procedures.estimation.fitting.checks import estimate_of
from procedures.estimation.mechanics import inertia, pole_pairs
from procedures.estimation.six_step.currents import WindingState
from procedures.estimation.winding import resistance
from procedures.estimation.winding.connections import ReadingConnection, phase_factor
from procedures.estimation.winding.sweep import rotor_sweep
from procedures.techniques.winding.dq_axes import connection_of, require


def test_e1_factor_follows_from_the_connection_of_the_reading():
    line = phase_factor("wye", ReadingConnection.LINE_TO_LINE).y_equivalent
    series_parallel = phase_factor("wye", ReadingConnection.SERIES_PARALLEL).y_equivalent
    assert (series_parallel * 146e-6, series_parallel * 153e-6) == pytest.approx((97.33e-6, 102.0e-6), rel=1e-4)
    assert (line * 146e-6, line * 153e-6) == pytest.approx((73e-6, 76.5e-6))


def test_e2_a_reading_on_the_other_pair_is_refused():
    assert connection_of(meter_series_parallel()) is ReadingConnection.SERIES_PARALLEL
    assert connection_of(meter_across(Terminal.B, Terminal.C)) is ReadingConnection.LINE_TO_LINE
    with pytest.raises(ProcedureError, match="only A against B and C together shows the q axis"):
        require(connection_of(meter_across(Terminal.B, Terminal.C)), ReadingConnection.SERIES_PARALLEL)


@pytest.mark.parametrize("action", [ALIGN_D, Connect({}), Connect({Terminal.A: Socket.METER_HIGH})])
def test_a_meter_on_one_terminal_reads_nothing(action):
    with pytest.raises(ProcedureError, match="gives no reading"):
        connection_of(action)


def test_e3_rule_of_ten_per_cent_calls_the_example_a_surface_magnet_machine():
    assert pytest.approx(0.048, abs=5e-4) == (153.0 - 146.0) / 146.0
    assert rotor_sweep.motor_class(146e-6, 153e-6) == "SPMSM"
    assert rotor_sweep.motor_class(146e-6, 161e-6) == "IPMSM"


def test_e5_torque_is_shaft_power_over_mechanical_speed():
    pairs, torque = 4, 0.5
    speed = np.linspace(20.0, 200.0, 40)
    found = inertia.torque_from_power(torque * speed, speed)
    assert found == pytest.approx(torque)
    # The note's P/(p·ω), and what the torque scales with it.
    assert inertia.torque_from_power(torque * speed, pairs * speed) == pytest.approx(torque / pairs)


def test_e6_two_points_are_biased_by_viscous_friction():
    j, coulomb, viscous, torque, top = 1e-3, 0.02, 1.3e-4, 0.2, 300.0
    rate, end = viscous / j, (torque - coulomb) / viscous

    def rising(speed: float) -> float:
        return -math.log(1.0 - speed / end) / rate

    def falling(speed: float) -> float:
        return -math.log((speed + coulomb / viscous) / (top + coulomb / viscous)) / rate

    low, high = 0.1 * top, 0.9 * top
    same, _ = inertia.two_point(rising(low), low, rising(high), high, torque, falling(high), high, falling(low), low)
    other, _ = inertia.two_point(
        rising(low), low, rising(0.5 * top), 0.5 * top, torque, falling(high), high, falling(0.5 * top), 0.5 * top
    )
    assert same / j - 1.0 == pytest.approx(0.013, abs=0.004)
    assert abs(other / j - 1.0) > 0.05


@pytest.mark.parametrize("number", [float, lambda value: ureal(value, 0.01 * value)])
def test_e7_copper_and_the_note_s_coefficient(number):
    one = number(1.0)
    note, copper = {"coefficient": 0.004, "reference": 25.0}, {"coefficient": 1.0 / 260.0, "reference": 25.0}
    assert estimate_of(resistance.at_temperature(one, 25.0, 85.0, **note)) == pytest.approx(1.24)
    assert pytest.approx(0.00385, abs=5e-6) == 1.0 / (235.0 + 25.0)
    assert estimate_of(resistance.at_temperature(one, 25.0, 26.0)) - 1.0 == pytest.approx(0.00385, abs=5e-6)
    for measured_at, error in ((15.0, 0.0016), (60.0, -0.0047)):
        ratio = resistance.at_temperature(one, measured_at, 25.0, **note) / resistance.at_temperature(
            one, measured_at, 25.0, **copper
        )
        assert estimate_of(ratio) - 1.0 == pytest.approx(error, abs=5e-5)


@pytest.mark.parametrize("number", [float, lambda value: ureal(value, 0.01 * value)])
def test_e8_delta_winding_is_three_times_the_equivalent_wye(number):
    lines = (number(0.1), number(0.1), number(0.1))
    delta, wye = resistance.from_lines(*lines, "delta"), resistance.from_lines(*lines, "wye")
    assert [estimate_of(value) for value in delta] == pytest.approx([0.15, 0.05])
    assert [estimate_of(value) for value in wye] == pytest.approx([0.05, 0.05])


def test_e12_power_closes_with_one_half_of_the_inductive_part():
    r, ell, tau = 0.1146, 0.435e-3, 0.7678e-3
    time = np.linspace(0.0, tau, 20_001)
    current = 3.0 + 4.0 * np.sin(1.3 * time / tau)
    power = float(np.trapezoid((r * current + ell * np.gradient(current, time, edge_order=2)) * current, time)) / tau
    average, square = (float(np.trapezoid(values, time)) / tau for values in (current, current**2))
    state = WindingState(average, math.sqrt(square), float(current[0]), float(current[-1]), math.nan)
    resistive, inductive = (average**2 * part for part in (state.resistive(r), state.inductive(ell, tau)))
    assert resistive + inductive == pytest.approx(power, rel=1e-6)
    assert resistive + 2.0 * inductive > 1.3 * power


def test_e16_pairs_are_half_the_poles():
    assert pole_pairs.from_frequency(53.76, 1600.0, 0.01, 1.0).pole_pairs == 2
    assert pole_pairs.from_frequency(53.76, 1600.0, 0.01, 1.0).ratio == pytest.approx(2.016)
