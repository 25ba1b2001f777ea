"""What stands in an instrument's error queue before it is opened is somebody else's."""

import pytest

from bench.motor.motor_file import load_motor
from sim_instruments.bench import VirtualBench
from tests.runs.on_bench import measure


@pytest.mark.parametrize("procedure", ["stator-resistance", "stator-resistance-dc", "back-emf-constant"])
def test_an_error_that_somebody_left_stops_nothing(procedure):
    motor = load_motor("lg-400w")
    with VirtualBench(motor.virtual_motor(), seed=3, sockets=False) as bench:
        for role in ("supply", "lcr_meter", "voltmeter", "oscilloscope"):
            bench.instrument(role).write(b"FOO\n")
        assert measure(bench, motor.nameplate, procedure).parameters
