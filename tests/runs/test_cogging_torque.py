"""The slow turn on the virtual bench: its way, its end, and what it says where there is no cogging to be felt."""

import math
from dataclasses import replace

import pytest

from bench.motor.motor_file import load_motor
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.disturbances.bench import Disturbances, ShaftSensors
from tests.runs.on_bench import measure, within

FILE = load_motor("lg-400w")


@pytest.fixture
def bench():
    with VirtualBench(FILE.virtual_motor(), seed=3, sockets=False) as virtual:
        yield virtual


@pytest.mark.parametrize(
    ("settings", "readings", "way"),
    [((), 1200, 2.0), (("turns=1", "readings=250"), 250, 1.0), (("order=24",), 120, 0.5)],
)
def test_it_turns_as_far_as_it_must_and_stops(bench, settings, readings, way):
    begun = bench.clock.now()
    result = measure(bench, FILE.nameplate, "cogging-torque", *settings)
    read = result.findings["readings"]["angle"]
    # A long curve is thinned for the record.
    assert len(read) == min(readings, 300)
    assert (read[-1] - read[0]) / (2.0 * math.pi) == pytest.approx(way, rel=0.02)
    assert bench.world.truth()["shaft_speed"] == pytest.approx(0.0, abs=0.2)
    # Hands take 48 s of it.
    assert bench.clock.now() - begun < 48.0 + 10.0 * way + 8.0
    # The drag that the turn had to overcome: the motor's, and the dynamometer's own.
    assert 0.0 < result.findings["drag"] < 0.1


def test_a_shaft_that_feels_none_gets_a_bound():
    smooth = replace(FILE.virtual_motor(), cogging_torque=0.0)
    with VirtualBench(smooth, seed=3, sockets=False) as bench:
        found = measure(bench, FILE.nameplate, "cogging-torque", "order=24").parameter("cogging_torque")
    assert found.unit == "N·m"
    assert 0.0 < found.value < 1e-4
    low, high = found.coverage_interval
    assert low <= 1e-5
    assert high < 2e-4
    assert str(found.budget[0].source) == "cogging that the scatter may hide"


@pytest.mark.parametrize(
    "motor",
    [
        FILE.virtual_motor(),
        pytest.param(replace(FILE.virtual_motor(), pole_pairs=10, coulomb_friction=0.05), marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("constant", [0.5, pytest.param(3.0, marks=pytest.mark.slow)])
def test_a_filter_that_nobody_states_gives_no_bound_where_no_order_is_seen(motor, constant):
    setting = BenchSetting(disturbances=Disturbances(sensors=ShaftSensors(torque_filter=constant)))
    smooth = replace(motor, cogging_torque=1e-5)
    with VirtualBench(smooth, seed=3, setting=setting, sockets=False) as bench:
        result = measure(bench, FILE.nameplate, "cogging-torque")
    assert [one.name for one in result.withheld] == ["cogging_torque"]
    assert "torque-filter" in [row["cause"] for row in result.findings["misfit"]]


@pytest.mark.slow
def test_a_bound_holds_what_averaging_takes_of_the_highest_order():
    file = load_motor("gimbal")
    with VirtualBench(file.virtual_motor(), seed=3, sockets=False, fixture=True) as bench:
        found = measure(bench, file.nameplate, "cogging-torque").parameter("cogging_torque")
    low, high = found.coverage_interval
    assert low <= 2.0 * file.virtual_motor().cogging_torque <= high


@pytest.fixture
def feeling():
    """Benches whose dynamometer feels the motor's cogging."""

    def make(motor):
        return VirtualBench(motor, seed=3, sockets=False, fixture=True)

    return make


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("lg-400w", ()),
        pytest.param("lg-400w", ("order=24",), marks=pytest.mark.slow),
        pytest.param("outrunner-delta", (), marks=pytest.mark.slow),
        pytest.param("outrunner-delta", ("order=84",), marks=pytest.mark.slow),
    ],
)
def test_it_holds_the_truth(feeling, name, settings):
    file = load_motor(name)
    motor = file.virtual_motor()
    with feeling(motor) as bench:
        result = measure(bench, file.nameplate, "cogging-torque", *settings)
    found = result.parameter("cogging_torque")
    assert within(found, 2.0 * motor.cogging_torque)
    assert found.standard_uncertainty < 0.04 * found.value
    assert result.findings["orders"] == [motor.cogging_order]


def test_more_cogging_than_the_type_has_is_found(feeling):
    with feeling(replace(FILE.virtual_motor(), cogging_torque=0.009)) as bench:
        found = measure(bench, FILE.nameplate, "cogging-torque", "order=24").parameter("cogging_torque")
    assert within(found, 0.018)


def test_an_order_too_high_for_a_whole_turn_is_no_small_cogging(feeling):
    file = load_motor("outrunner-delta")
    motor = file.virtual_motor()
    with feeling(motor) as bench:
        result = measure(bench, file.nameplate, "cogging-torque", "readings=250")
        # The readings alone do not tell it from scatter; those at half the speed show that there is more.
        low, high = (
            measure(bench, file.nameplate, "cogging-torque", "readings=250", "half_speed=false")
            .parameter("cogging_torque")
            .coverage_interval
        )
    assert low <= 2.0 * motor.cogging_torque <= high
    assert within(result.parameter("cogging_torque"), 2.0 * motor.cogging_torque)
    (said,) = [notice for notice in result.warnings if notice.identifier == "vibration"]
    assert "state the order" in str(said.message)


@pytest.mark.parametrize("settings", [(), pytest.param(("order=24",), marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("sensors", "cause", "given"),
    [
        (ShaftSensors(torque_filter=0.05), "torque-filter", True),
        pytest.param(ShaftSensors(torque_filter=0.3), "torque-filter", False, marks=pytest.mark.slow),
        (ShaftSensors(vibration=0.003, vibration_frequency=7.4), "vibration", False),
    ],
)
def test_what_does_not_go_with_the_angle_is_told_by_half_the_speed(settings, sensors, cause, given):
    setting = BenchSetting(disturbances=Disturbances(sensors=sensors))
    with VirtualBench(FILE.virtual_motor(), seed=3, sockets=False, setting=setting) as bench:
        result = measure(bench, FILE.nameplate, "cogging-torque", *settings)
    assert cause in [notice.identifier for notice in result.warnings]
    assert bool(result.parameters) is given
    if given:
        assert within(result.parameter("cogging_torque"), 2.0 * FILE.virtual_motor().cogging_torque)


def test_averaging_that_blurs_is_said(feeling):
    file = load_motor("gimbal")
    with feeling(file.virtual_motor()) as bench:
        result = measure(bench, file.nameplate, "cogging-torque", "order=264")
    assert [notice.identifier for notice in result.warnings] == ["blurred"]
    assert within(result.parameter("cogging_torque"), 2.0 * file.virtual_motor().cogging_torque)


@pytest.mark.parametrize(
    ("settings", "part"), [((), False), (("order=24",), True), (("order=24", "periods=24"), False)]
)
def test_a_part_of_a_turn_is_told_as_one(feeling, settings, part):
    with feeling(FILE.virtual_motor()) as bench:
        result = measure(bench, FILE.nameplate, "cogging-torque", *settings)
    assert result.findings["turned"] == pytest.approx(0.5 if part else (1.0 if settings else 2.0), rel=0.02)
    assert result.parameter("cogging_torque").estimator.endswith("that was read") is part
