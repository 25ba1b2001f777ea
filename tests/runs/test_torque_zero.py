"""A transducer whose zero moves between and during the ramps."""

from bench.motor.motor_file import load_motor
from procedures.estimation.fitting.misfit import Cause
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.disturbances.bench import Disturbances, ShaftSensors
from tests.runs.on_bench import measure, within


def test_a_zero_that_drifts_is_taken_off_and_told():
    file = load_motor("lg-400w")
    motor = file.virtual_motor()
    drift = Disturbances(sensors=ShaftSensors(torque_drift=0.02 * motor.coulomb_friction))
    with VirtualBench(motor, seed=4, sockets=False, setting=BenchSetting(disturbances=drift)) as bench:
        found = measure(bench, file.nameplate, "inertia")
    for name in ("inertia", "coulomb_friction", "viscous_friction"):
        assert within(found.parameter(name), getattr(motor, name)), name
    assert Cause.TORQUE_ZERO.value in {row["cause"] for row in found.findings["misfit"]}
