"""Short and open circuit and load points on virtual motors whose truth is known, through the real drivers."""

import math
from dataclasses import replace

import pytest

from bench.motor.motor_file import load_motor
from procedures.core.actions import ChangeSetup, Mend
from procedures.core.bench import ProcedureError
from procedures.estimation.winding.short_circuit import peak_speed
from procedures.verification.verifier import WiringError
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.disturbances.bench import Disturbances, ShaftSensors
from sim_instruments.disturbances.channel import ChannelPath
from sim_instruments.instruments.errors import DynamometerErrors, Errors, ScopeErrors
from sim_instruments.physics.motor.bearing import Bearing
from sim_instruments.world.machine_data import Leads
from tests.runs.on_bench import measure, within

FILE = load_motor("ipmsm")
#: More resistance and inductance: its short-circuit current stays within what the plate allows.
MOTOR = replace(
    FILE.virtual_motor(),
    phase_resistances=(0.2, 0.2, 0.2),
    d_axis_inductance=0.35e-3,
    q_axis_inductance=0.7e-3,
    d_axis_saturation_current=math.inf,
    q_axis_saturation_current=math.inf,
)
PLATE = FILE.nameplate
QUICK = ("readings=4", "periods=2", "interval=0.02", "settle=0.1", "zero_rest=0.2")
SHORT = ("phases=false", "unbalance=0.005", "speeds=7", "lowest=0.03", *QUICK)
TOP = PLATE.rated_speed_rpm * math.pi / 30.0


def one(motor=MOTOR, name="short-circuit", *settings, plate=PLATE, errors=None, known=None, setting=None, hands=None):
    with VirtualBench(motor, seed=2, errors=errors, sockets=False, setting=setting) as bench:
        more = {} if hands is None else {"hands": lambda _, operator: hands(bench, operator)}
        result = measure(bench, plate, name, *settings, known=known, **more)
        left = bench.world.truth()
    assert not left["energised"]
    assert left["shaft_speed"] == pytest.approx(0.0, abs=0.3)
    return result


def alarms(result):
    return {warning.identifier for warning in result.warnings}


def test_the_short_circuit_holds_the_truth():
    result = one(MOTOR, "short-circuit", *SHORT)
    warm = MOTOR.stator_resistance_y + Leads().resistance
    assert within(result.parameter("d_axis_chord_inductance"), MOTOR.d_axis_inductance_y)
    assert within(result.parameter("short_circuit_current"), MOTOR.flux_linkage_y / MOTOR.d_axis_inductance_y)
    assert within(result.parameter("short_circuit_resistance"), warm)
    corner = peak_speed(warm, MOTOR.d_axis_inductance_y, MOTOR.q_axis_inductance_y) / MOTOR.pole_pairs
    assert within(result.parameter("peak_braking_speed"), corner * 30.0 / math.pi)
    assert alarms(result) == set()
    assert [entry["outcome"] for entry in result.findings["wiring"]] == ["verified", "verified"]
    low, high = (result.findings["resistance_ratio"][key] for key in ("low", "high"))
    assert low < 1.0 < high


@pytest.mark.slow
def test_two_temperatures_tell_what_the_magnets_lose():
    result = one(MOTOR, "short-circuit", *SHORT, "warming_time=300")
    found = result.parameter("flux_temperature_coefficient")
    low, high = found.coverage_interval
    assert low < MOTOR.flux_temperature_coefficient < high
    cold, warm = result.findings["sweeps"]
    assert warm["winding_temperature"] > cold["winding_temperature"] + 15.0
    assert warm["resistance"] > 1.04 * cold["resistance"]


@pytest.mark.slow
def test_it_stops_at_the_motor_s_largest_current_and_carries_nothing_on():
    plate = replace(PLATE, maximum_current=28.0)
    result = one(MOTOR, "short-circuit", *SHORT, plate=plate)
    names = {parameter.name for parameter in result.parameters}
    assert "short_circuit_current" not in names
    assert "short-circuit-reach" in alarms(result)
    assert max(result.findings["sweeps"][0]["current"]) <= 28.0
    assert within(result.parameter("d_axis_chord_inductance"), MOTOR.d_axis_inductance_y)


@pytest.mark.slow
def test_speeds_between_are_read_where_the_current_ends_it_after_too_few():
    plate = replace(PLATE, maximum_current=28.0)
    result = one(
        MOTOR, "short-circuit", "phases=false", "unbalance=0.005", "speeds=5", "lowest=0.15", *QUICK, plate=plate
    )
    speeds = result.findings["sweeps"][0]["speed"]
    assert len(speeds) == 5
    assert speeds == sorted(speeds)
    assert max(result.findings["sweeps"][0]["current"]) <= 28.0
    assert within(result.parameter("d_axis_chord_inductance"), MOTOR.d_axis_inductance_y)
    assert within(result.parameter("short_circuit_resistance"), MOTOR.stator_resistance_y + Leads().resistance)


@pytest.mark.slow
def test_a_current_that_may_be_beyond_the_probe_s_range_is_looked_at_with_its_widest():
    """The first guess follows from the largest current of the plate, 200 A, which is 500 A of full scale."""
    plate = replace(PLATE, maximum_current=200.0)
    result = one(MOTOR, "short-circuit", *SHORT, plate=plate)
    assert within(result.parameter("d_axis_chord_inductance"), MOTOR.d_axis_inductance_y)
    assert within(result.parameter("short_circuit_current"), MOTOR.flux_linkage_y / MOTOR.d_axis_inductance_y)


@pytest.mark.slow
def test_speeds_follow_from_resistance_and_inductance_where_they_are_known():
    with VirtualBench(MOTOR, seed=2, sockets=False) as bench:
        names = ("stator-resistance", "dq-inductance-extremes")
        known = {p.name: p for name in names for p in measure(bench, PLATE, name).parameters}
        result = measure(bench, PLATE, "short-circuit", "phases=false", *QUICK, known=known)
    speeds = result.findings["sweeps"][0]["speed"]
    corner = 0.2 / math.sqrt(0.35e-3 * 0.7e-3) / MOTOR.pole_pairs
    assert speeds[0] == pytest.approx(0.15 * corner, rel=0.02)
    assert speeds[-1] == pytest.approx(TOP, rel=1e-3)
    extra = result.findings["leads_and_link"]
    assert extra["low"] < Leads().resistance < extra["high"]


@pytest.mark.slow
def test_a_current_probe_of_another_factor_contradicts_itself():
    # A tenth too much current makes the torque's resistance a fifth too small, the currents' a tenth.
    errors = replace(Errors(), oscilloscope=ScopeErrors(gain=(0.0, 0.0, 0.0, 0.1)))
    assert "short-circuit-resistance" in alarms(one(MOTOR, "short-circuit", *SHORT, errors=errors))


@pytest.mark.slow
def test_a_torque_transducer_that_is_off_contradicts_the_currents():
    errors = replace(Errors(), dynamometer=DynamometerErrors(torque_gain=0.1))
    assert "short-circuit-resistance" in alarms(one(MOTOR, "short-circuit", *SHORT, errors=errors))


@pytest.mark.slow
def test_a_link_of_much_resistance_is_in_the_figure_and_beside_the_winding_s():
    result = one(MOTOR, "short-circuit", *SHORT, setting=BenchSetting(leads=Leads(resistance=0.05)))
    assert within(result.parameter("short_circuit_resistance"), 0.25)
    assert within(result.parameter("d_axis_chord_inductance"), MOTOR.d_axis_inductance_y)


class LooseHands:
    """Hands that leave a wire off the link, and put it right when told, if they `mend`."""

    def __init__(self, bench, operator, terminals, *, mend):
        self._world, self._operator, self._off, self._mend = bench.world, operator, terminals, mend
        self.told = []

    def perform(self, action):
        if isinstance(action, Mend):
            self.told.append(str(action.finding))
            if self._mend:
                self._world.connect(dict.fromkeys("ABC", "link"))
            return self._mend
        given = self._operator.perform(action)
        if isinstance(action, ChangeSetup) and "link" in {s.value for s in action.after.terminals.values()}:
            self._world.take_off(self._off)
        return given


@pytest.mark.parametrize(
    ("off", "message"),
    [
        pytest.param(["B"], "B .* is open", id="one wire"),
        pytest.param(["A", "B", "C"], "not joined", id="no link at all"),
    ],
)
def test_a_wire_that_is_off_the_link_is_named(off, message):
    with pytest.raises(WiringError, match=message):
        one(MOTOR, "short-circuit", *SHORT, hands=lambda bench, hands: LooseHands(bench, hands, off, mend=False))


@pytest.mark.slow
def test_a_wire_that_was_off_the_link_is_put_right():
    result = one(MOTOR, "short-circuit", *SHORT, hands=lambda bench, hands: LooseHands(bench, hands, ["C"], mend=True))
    assert [entry["outcome"] for entry in result.findings["wiring"]] == ["verified", "wrong", "verified"]
    assert within(result.parameter("d_axis_chord_inductance"), MOTOR.d_axis_inductance_y)


def test_the_open_circuit_holds_the_truth():
    motor = replace(MOTOR, bearing=Bearing(windage=2e-7))
    result = one(motor, "open-circuit", "speeds=5", *QUICK)
    assert within(result.parameter("flux_linkage"), motor.flux_linkage_y)
    drag = motor.coulomb_friction + motor.viscous_friction * TOP + 2e-7 * TOP**2
    assert within(result.parameter("open_circuit_loss"), drag * TOP)
    assert result.findings["drag"]["tare"] is not None
    assert "open-circuit-loss" in alarms(result)


@pytest.mark.slow
def test_an_open_circuit_at_two_temperatures():
    with VirtualBench(MOTOR, seed=2, sockets=False) as bench:
        names = ("stator-resistance", "dq-inductance-extremes")
        known = {p.name: p for name in names for p in measure(bench, PLATE, name).parameters}
        result = measure(bench, PLATE, "open-circuit", "speeds=4", "warming_time=300", *QUICK, known=known)
    low, high = result.parameter("flux_temperature_coefficient").coverage_interval
    assert low < MOTOR.flux_temperature_coefficient < high
    assert within(result.parameter("flux_linkage"), MOTOR.flux_linkage_y)


def test_warming_needs_resistance_and_inductance():
    with pytest.raises(ProcedureError, match="set warming_time=0"):
        one(MOTOR, "open-circuit", "speeds=3", "tare=false", "warming_time=300", *QUICK)


LOADS = ("speed_shares=[0.3,0.7]", "current_shares=[0.5,1.0]", "phases=false", "unbalance=0.002", *QUICK)


def loss(motor, point):
    speed = point["speed_rpm"] * math.pi / 30.0
    drag = motor.coulomb_friction + motor.viscous_friction * speed
    return drag * speed + 1.5 * motor.stator_resistance_y * point["commanded_current"] ** 2


def test_load_points_hold_the_truth():
    motor = replace(FILE.virtual_motor(), phase_resistances=(0.04, 0.04, 0.04))
    result = one(motor, "load-points", *LOADS)
    points = result.findings["points"]
    assert len(points) == 4
    for point in points:
        speed = point["speed_rpm"] * math.pi / 30.0
        shaft = (
            motor.torque_constant * point["commanded_current"] * speed
            + 1.5 * motor.stator_resistance_y * point["commanded_current"] ** 2
            - loss(motor, point)
        )
        low, high = point["efficiency_interval"]
        assert low < shaft / (shaft + loss(motor, point)) < high
        assert abs(point["loss"] - loss(motor, point)) < 3.0 * point["loss_uncertainty"]
    assert alarms(result) == {"loss-parts"}
    assert result.parameter("efficiency").value == pytest.approx(100.0 * max(p["efficiency"] for p in points))


@pytest.mark.slow
def test_braking_turns_the_efficiency_round_and_the_loss_parts():
    motor = replace(FILE.virtual_motor(), phase_resistances=(0.04, 0.04, 0.04))
    with VirtualBench(motor, seed=2, sockets=False) as bench:
        known = {p.name: p for p in measure(bench, PLATE, "stator-resistance").parameters}
        result = measure(
            bench, PLATE, "load-points", "speed_shares=[0.5]", "current_shares=[-1.0,1.0]", *QUICK, known=known
        )
    braking, driving = sorted(result.findings["points"], key=lambda point: point["electrical"])
    assert braking["electrical"] < 0.0 < driving["electrical"]
    assert braking["shaft"] < braking["electrical"]
    assert 0.5 < braking["efficiency"] < 1.0
    for point in (braking, driving):
        assert point["copper"] == pytest.approx(1.5 * 0.04 * 25.0**2, rel=0.03)
        assert abs(point["rest"]) < 3.0 * point["rest_uncertainty"]


@pytest.mark.slow
def test_a_current_that_the_voltage_does_not_drive_is_left_out():
    result = one(MOTOR, "load-points", "speed_shares=[0.3,1.0]", "current_shares=[0.3,1.0]", "phases=false", *QUICK)
    assert "load-reach" in alarms(result)
    assert len(result.findings["points"]) == 3


@pytest.mark.slow
def test_a_probe_of_another_factor_gives_more_than_it_takes():
    motor = replace(FILE.virtual_motor(), phase_resistances=(0.04, 0.04, 0.04))
    errors = replace(Errors(), oscilloscope=ScopeErrors(gain=(-0.3, 0.0, 0.0, 0.0)))
    assert "power-balance" in alarms(one(motor, "load-points", *LOADS, errors=errors))


#: None of the shipped motors: one pole pair, its axes alike.
ROUND = replace(
    MOTOR,
    pole_pairs=1,
    phase_resistances=(0.5, 0.5, 0.5),
    d_axis_inductance=1e-3,
    q_axis_inductance=1e-3,
    flux_linkage=0.04,
)


def disturbed(motor, sensors=None, **path):
    channels = {4: ChannelPath(**path)} if path else {}
    setting = BenchSetting(disturbances=Disturbances(channels=channels, sensors=sensors or ShaftSensors()))
    return one(motor, "short-circuit", *SHORT, setting=setting)


def holds(result, motor):
    low, high = result.parameter("short_circuit_resistance").coverage_interval
    return low <= motor.stator_resistance_y + Leads().resistance <= high


@pytest.mark.parametrize("motor", [MOTOR, pytest.param(ROUND, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "factor", [1.05, *(pytest.param(factor, marks=pytest.mark.slow) for factor in (0.5, 0.9, 0.95, 1.03, 1.2))]
)
def test_a_current_probe_that_is_off_is_held_by_the_resistance_and_named(motor, factor):
    result = disturbed(motor, factor=factor)
    assert holds(result, motor)
    said = " ".join(str(warning.message) for warning in result.warnings)
    assert factor == 1.03 or "a current that is shown" in said
    for given in result.parameters:
        if given.name == "d_axis_chord_inductance":
            low, high = given.coverage_interval
            assert low <= motor.d_axis_inductance_y <= high


@pytest.mark.slow
def test_a_current_probe_whose_gain_warms_up_is_held():
    assert holds(disturbed(MOTOR, warm_up=0.06, warm_up_time=5.0), MOTOR)


@pytest.mark.slow
def test_a_torque_that_lags_unsaid_is_held_and_named():
    result = disturbed(MOTOR, ShaftSensors(torque_filter=0.5))
    assert holds(result, MOTOR)
    assert "a slow filter of the torque" in " ".join(str(warning.message) for warning in result.warnings)


@pytest.mark.slow
def test_currents_that_no_short_circuit_has_give_no_inductance():
    result = disturbed(MOTOR, limit=25.0)
    assert "d_axis_chord_inductance" not in {given.name for given in result.parameters}
