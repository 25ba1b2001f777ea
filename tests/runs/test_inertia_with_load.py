"""Inertia of the rotor alone, and of rotor and load together, in one run."""

import pytest

from bench.motor.motor_file import load_motor
from sim_instruments.bench import VirtualBench
from sim_instruments.world.machine_data import DynamometerMachine
from tests.runs.on_bench import measure, within


@pytest.mark.parametrize("load", [None, 4.0e-4])
def test_rotor_alone_and_with_its_load(load):
    motor = load_motor("lg-400w")
    stated = () if load is None else (f"load_inertia={load}", "load_inertia_uncertainty=2e-6")
    with VirtualBench(motor.virtual, seed=6, sockets=False) as bench:
        found = measure(bench, motor.nameplate, "inertia", *stated)
    alone, together = found.parameter("inertia"), found.parameter("inertia_with_load")
    assert within(alone, motor.virtual.inertia)
    assert within(together, motor.virtual.inertia + (DynamometerMachine().inertia if load is None else load))
    assert together.section == "2.6"
    # Both come from the same ramps, and share what is wrong with them.
    assert alone.covariance(together) != 0.0
