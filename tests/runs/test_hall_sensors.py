"""The Hall sensors of virtual motors: sound ones, and every fault that a sensor or its leads can have."""

import math
from dataclasses import replace

import pytest

from bench.motor.motor_file import load_motor
from procedures.core.bench import ProcedureError
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.disturbances.channel import ChannelPath
from sim_instruments.physics.motor.hall import SimulatedHallSensors
from tests.runs.on_bench import measure, within

FILE = load_motor("lg-400w")
PLATE = replace(FILE.nameplate, pole_pairs=4, hall_sensors=True)


def checked(halls, plate=PLATE, *settings, channels=None):
    setting = BenchSetting(disturbances=Disturbances(channels=channels or {}))
    with VirtualBench(replace(FILE.virtual_motor(), halls=halls), seed=3, sockets=False, setting=setting) as bench:
        result = measure(bench, plate, "hall-sensors", *settings)
        bench.clock.sleep(60.0)
        assert abs(bench.world.truth()["shaft_speed"]) < 0.1
    return result, {parameter.name: parameter for parameter in result.parameters}


def test_sound_sensors_are_where_block_commutation_wants_them():
    result, found = checked(SimulatedHallSensors())
    assert found["hall_faults"].value == 0.0
    for name in ("hall_offset", "hall_spacing_deviation", "hall_duty_deviation"):
        assert within(found[name], 0.0), name
        assert found[name].standard_uncertainty < 0.3
    assert result.warnings == ()


@pytest.mark.parametrize("offset", [-20.0, 12.0, 60.0])
def test_an_offset_is_measured_in_electrical_degrees(offset):
    _, found = checked(SimulatedHallSensors(offset=math.radians(offset)))
    assert found["hall_faults"].value == 0.0
    assert within(found["hall_offset"], offset)


@pytest.mark.parametrize(
    "channels", [{1: ChannelPath(pole=500.0)}, {1: ChannelPath(coupling_corner=5.0)}, {2: ChannelPath(skew=2e-4)}]
)
def test_what_is_late_cancels_by_turning_both_ways_and_is_said(channels):
    result, found = checked(SimulatedHallSensors(offset=math.radians(5.0)), channels=channels)
    assert within(found["hall_offset"], 5.0)
    assert within(found["hall_spacing_deviation"], 0.0)
    assert [notice.identifier for notice in result.warnings] == ["channel-delay"]
    _, once = checked(SimulatedHallSensors(offset=math.radians(5.0)), PLATE, "both_ways=false", channels=channels)
    assert not within(once["hall_offset"], 5.0)


@pytest.mark.parametrize("offset", [-40.0, 0.0, 6.0])
def test_a_probe_the_wrong_way_round_is_named_and_no_offset_is_given(offset):
    result, found = checked(SimulatedHallSensors(offset=math.radians(offset)), channels={1: ChannelPath(factor=-1.0)})
    assert [(one.name, one.cause) for one in result.withheld] == [("hall_offset", "probe-factor")]
    assert found["hall_faults"].value == 0.0
    assert within(found["hall_spacing_deviation"], 0.0)


def test_an_inverting_probe_and_a_dead_sensor_are_not_counted_as_three_faults():
    result, found = checked(SimulatedHallSensors(stuck=((1, "low"),)), channels={1: ChannelPath(factor=-1.0)})
    assert {one.name for one in result.withheld} >= {"hall_offset"}
    assert "hall_faults" not in found or found["hall_faults"].value == 1.0


def test_sensors_that_are_made_half_a_turn_off_are_measured_where_that_is_stated():
    halls = SimulatedHallSensors(offset=math.radians(171.0))
    assert [one.name for one in checked(halls)[0].withheld] == ["hall_offset"]
    result, found = checked(halls, PLATE, "offset=180")
    assert not result.withheld
    assert within(found["hall_offset"], -9.0)


def test_a_sensor_glued_in_the_wrong_place():
    _, found = checked(SimulatedHallSensors(placements=(0.0, math.radians(9.0), 0.0)))
    assert within(found["hall_spacing_deviation"], 9.0)
    assert within(found["hall_offset"], 3.0)


@pytest.mark.parametrize(
    ("halls", "faults"),
    [
        (SimulatedHallSensors(order=(2, 1, 3)), ["H1: swapped", "H2: swapped"]),
        (SimulatedHallSensors(order=(1, 3, 2)), ["H2: swapped", "H3: swapped"]),
        (SimulatedHallSensors(inverted=(2,)), ["H2: inverted"]),
        (SimulatedHallSensors(stuck=((3, "high"),)), ["H3: dead"]),
        (SimulatedHallSensors(stuck=((1, "low"),), inverted=(2,)), ["H1: dead", "H2: inverted"]),
        (SimulatedHallSensors(order=(3, 2, 1), inverted=(1,)), ["H1: swapped", "H3: swapped", "H3: inverted"]),
    ],
)
def test_each_fault_is_counted_and_named(halls, faults):
    result, found = checked(halls)
    assert result.findings["faults"] == faults
    assert found["hall_faults"].value == len({fault[:2] for fault in faults})
    said = " ".join(str(notice.message) for notice in result.warnings)
    for fault in faults:
        assert fault[:2] in said


def test_three_dead_ones_leave_nothing_else_to_measure():
    result, found = checked(SimulatedHallSensors(stuck=((1, "low"), (2, "low"), (3, "high"))))
    assert set(found) == {"hall_faults"}
    assert found["hall_faults"].value == 3.0
    assert len(result.warnings) == 3


def test_a_motor_whose_sensors_are_not_fitted_has_dead_leads():
    result, found = checked(None)
    assert found["hall_faults"].value == 3.0
    assert result.findings["missing_part"] == "Hall sensors"


def test_a_motor_without_sensors_is_refused_before_anything_is_connected():
    assert load_motor("lg-400w").nameplate.hall_sensors is False
    assert load_motor("92bl-30-25l").nameplate.hall_sensors is True
    with pytest.raises(ProcedureError, match="this motor has no Hall sensors"):
        checked(None, FILE.nameplate)


def test_a_motor_made_for_another_offset_is_held_against_that():
    _, found = checked(SimulatedHallSensors(offset=math.radians(30.0)), PLATE, "offset=30")
    assert within(found["hall_offset"], 0.0)


def test_without_pole_pairs_it_is_only_less_certain():
    _, found = checked(SimulatedHallSensors(offset=math.radians(5.0)), replace(PLATE, pole_pairs=None))
    assert within(found["hall_offset"], 5.0)
    assert found["hall_faults"].value == 0.0
