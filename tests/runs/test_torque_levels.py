"""Torque constant behind a transducer that lags, by its own setting or otherwise, and that shows the torque in coarse steps."""

import numpy as np
import pytest

from bench.motor.motor_file import load_motor
from procedures.core.bench import ProcedureError, Role
from procedures.estimation.fitting.randomness import chance_of_pattern
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.disturbances.bench import Disturbances, ShaftSensors
from tests.runs.on_bench import measure
from tests.studies.hostile_states import FOUND, PRESSED, from_state
from tests.studies.worlds.random_motors import draw_motor

FILE = load_motor("lg-400w")
MOTOR = FILE.virtual_motor()
TRUTH = MOTOR.torque_constant
TRANSDUCER, FILTER = 2, 0x06


def bench_behind(torque_filter: float) -> VirtualBench:
    setting = BenchSetting(disturbances=Disturbances(sensors=ShaftSensors(torque_filter=torque_filter)))
    return VirtualBench(MOTOR, seed=5, setting=setting, sockets=False)


def holds(found) -> bool:
    low, high = found.parameter("torque_constant").coverage_interval
    return low <= TRUTH <= high and high - low < 0.05 * TRUTH


@pytest.mark.parametrize(("torque_filter", "settling"), [(0.05, 0.4), (0.45, 1.6)])
def test_levels_are_waited_for_as_long_as_the_torque_lags(torque_filter, settling):
    with bench_behind(torque_filter) as bench:
        found = measure(bench, FILE.nameplate, "torque-constant", "levels=2")
    assert holds(found)
    assert found.findings["settling"] == pytest.approx(settling)


@pytest.mark.parametrize("seed", [41, 42])
def test_what_cogging_leaves_between_readings_is_no_pattern(seed):
    file = load_motor("ipmsm")
    with VirtualBench(file.virtual_motor(), seed=seed, sockets=False) as bench:
        found = measure(bench, file.nameplate, "torque-constant", "levels=4")
    order = np.argsort(found.findings["currents"], kind="stable")
    assert chance_of_pattern(np.array(found.findings["residuals"])[order]) > 1e-3


def test_a_torque_that_lags_however_long_it_is_waited_for_is_refused():
    with bench_behind(3.0) as bench:
        with pytest.raises(
            ProcedureError, match=r"still changes 1\.6 s after a current was set, as behind a slow filter"
        ):
            measure(bench, FILE.nameplate, "torque-constant", "levels=2")
        assert not bench.world.truth()["energised"]


def test_a_filter_that_somebody_left_at_the_transducer_is_shortened_and_given_back():
    with VirtualBench(MOTOR, seed=5, sockets=False) as bench:
        sensor = bench.instrument("dynamometer").units[TRANSDUCER]
        sensor.write(FILTER, [0, 99])
        found = measure(bench, FILE.nameplate, "torque-constant")
        assert sensor.read(FILTER, 2) == [0, 99]
    assert holds(found)
    assert found.findings["settling"] == pytest.approx(0.1)


@pytest.mark.parametrize("drift", [3e-3, 1e-2])
def test_a_zero_that_moves_while_the_current_rises_is_no_slope(drift):
    """Levels rise all the time: before the first was read once more, 3 mN·m/s were −3.6 % at an interval of ± 2 %."""
    setting = BenchSetting(disturbances=Disturbances(sensors=ShaftSensors(torque_drift=drift)))
    with VirtualBench(MOTOR, seed=5, setting=setting, sockets=False) as bench:
        found = measure(bench, FILE.nameplate, "torque-constant")
    assert holds(found)
    assert found.parameter("torque_constant").value == pytest.approx(TRUTH, rel=5e-3)
    (told,) = found.findings["misfit"]
    assert told["cause"] == "torque-zero-drift"
    assert told["figures"]["drift"] == pytest.approx(abs(drift) * told["figures"]["time"], rel=0.1)
    assert found.findings["settling"] == pytest.approx(0.1)


@pytest.mark.slow
def test_right_wires_are_not_accused_while_the_torque_of_the_run_up_is_still_shown():
    motor, plate = draw_motor(np.random.default_rng([7, 48]))
    with VirtualBench(motor, seed=5, sockets=False) as bench:

        def lengthen(available, operator):
            # Somebody at the sensor's keys, once the driver has shortened the filter.
            assert available[Role.DYNAMOMETER].maximum_speed
            bench.instrument("dynamometer").units[TRANSDUCER].write(FILTER, [0, 50])
            return operator

        found = measure(bench, plate, "torque-constant", hands=lengthen)
    low, high = found.parameter("torque_constant").coverage_interval
    assert low <= motor.torque_constant <= high
    assert {row["outcome"] for row in found.findings["wiring"]} == {"verified"}


def test_steps_of_torque_and_current_are_in_the_interval():
    """A motor of 0.14 A: the torque is shown in steps of 1 mN·m, the current in steps of 10 mA."""
    became = from_state(7, ("torque-constant",), 31)
    assert [became.counts["torque-constant", PRESSED, outcome] for outcome in ("held", "off", "far off")] == [1, 0, 0]
    assert not became.counts["torque-constant", FOUND, "off"]
