"""Where the sources contradict themselves: the printed figure, the right one, and that the code gives the right one."""

import math

import pytest

from procedures.core.actions import ALIGN_D, Connect, Socket, Terminal, meter_across, meter_series_parallel
from procedures.core.bench import ProcedureError
from procedures.estimation.mechanics import inertia, pole_pairs
from procedures.estimation.winding import resistance, rotor_sweep
from procedures.estimation.winding.connections import ReadingConnection, phase_factor
from procedures.techniques.dq_axes import connection_of, require

RPM = math.pi / 30.0


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
    with pytest.raises(ProcedureError, match="reads nothing"):
        connection_of(action)


def test_e3_rule_of_ten_per_cent_calls_the_example_a_surface_magnet_machine():
    assert pytest.approx(0.048, abs=5e-4) == (153.0 - 146.0) / 146.0
    assert rotor_sweep.motor_class(146e-6, 153e-6) == "SPMSM"
    assert rotor_sweep.motor_class(146e-6, 161e-6) == "IPMSM"


def test_e4_the_note_s_table_divides_by_mechanical_speed():
    recomputed = [volts / (rpm * RPM) for rpm, volts in ((1000.0, 3.7), (625.0, 2.2), (500.0, 1.8))]
    assert recomputed == pytest.approx([0.0353, 0.0336, 0.0344], abs=5e-5)
    assert sum(recomputed) / 3.0 == pytest.approx(0.0344, abs=5e-5)
    assert round(recomputed[0], 3) != 0.034


def test_e5_torque_is_shaft_power_over_mechanical_speed():
    power, pairs, mechanical = 100.0, 4, 200.0
    electrical = pairs * mechanical
    assert pairs * power / electrical == power / mechanical
    assert power / (pairs * mechanical) == pytest.approx(power / mechanical / pairs)


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


def test_e7_copper_and_the_note_s_coefficient():
    assert resistance.at_temperature(1.0, 25.0, 85.0, coefficient=0.004, reference=25.0) == pytest.approx(1.24)
    assert pytest.approx(0.00385, abs=5e-6) == 1.0 / (235.0 + 25.0)
    assert resistance.at_temperature(1.0, 25.0, 26.0) - 1.0 == pytest.approx(0.00385, abs=5e-6)
    for measured_at, error in ((15.0, 0.0016), (60.0, -0.0047)):
        note = resistance.at_temperature(1.0, measured_at, 25.0, coefficient=0.004, reference=25.0)
        copper = resistance.at_temperature(1.0, measured_at, 25.0, coefficient=1.0 / 260.0, reference=25.0)
        assert note / copper - 1.0 == pytest.approx(error, abs=5e-5)


def test_e8_delta_winding_is_three_times_the_equivalent_wye():
    winding, y_equivalent = resistance.from_lines(0.1, 0.1, 0.1, "delta")
    assert (winding, y_equivalent) == pytest.approx((0.15, 0.05))
    assert resistance.from_lines(0.1, 0.1, 0.1, "wye") == pytest.approx((0.05, 0.05))


def test_e16_pairs_are_half_the_poles():
    assert pole_pairs.from_frequency(53.76, 1600.0, 0.01, 1.0).pole_pairs == 2
    assert pole_pairs.from_frequency(53.76, 1600.0, 0.01, 1.0).ratio == pytest.approx(2.016)
