"""What stands in an instrument's error queue before it is opened is somebody else's: it is told, and gone the next time."""

import pytest

from bench.motor.motor_file import load_motor
from drivers.interfaces import ReportedError
from sim_instruments.bench import VirtualBench
from tests.runs.on_bench import measure


def test_an_error_that_somebody_left_is_told_as_such():
    motor = load_motor("lg-400w")
    with VirtualBench(motor.virtual_motor(), seed=3, sockets=False) as bench:
        bench.instrument("lcr_meter").write(b"FOO\n")
        with pytest.raises(
            ReportedError, match=r"-113.*before the instrument was opened and is cleared now: start again"
        ):
            measure(bench, motor.nameplate, "stator-resistance")
        assert measure(bench, motor.nameplate, "stator-resistance").parameters
