"""The slow turn on the virtual bench: its way, its end, and what it says where there is no cogging to be felt."""

import math

import pytest

from bench.files.motor_file import load_motor
from sim_instruments.bench import VirtualBench
from tests.runs.on_bench import measure

FILE = load_motor("lg-400w")


@pytest.fixture
def bench():
    with VirtualBench(FILE.virtual_motor(), seed=3, sockets=False) as virtual:
        yield virtual


@pytest.mark.parametrize(("settings", "readings", "way"), [((), 250, 1.0), (("order=24",), 120, 0.5)])
def test_it_turns_as_far_as_it_must_and_stops(bench, settings, readings, way):
    begun = bench.clock.now()
    result = measure(bench, FILE.nameplate, "cogging-torque", *settings)
    read = result.findings["readings"]["angle"]
    assert len(read) == readings
    assert (read[-1] - read[0]) / (2.0 * math.pi) == pytest.approx(way, rel=0.02)
    assert bench.world.truth()["shaft_speed"] == pytest.approx(0.0, abs=0.2)
    # Hands take 48 s of it.
    assert bench.clock.now() - begun < 48.0 + 10.0 * way + 8.0
    # The drag that the turn had to overcome: the motor's, and the dynamometer's own.
    assert 0.0 < result.findings["drag"] < 0.1


def test_a_shaft_that_feels_none_gets_a_bound(bench):
    found = measure(bench, FILE.nameplate, "cogging-torque", "order=24").parameter("cogging_torque")
    assert found.unit == "N·m"
    assert 0.0 < found.value < 1e-4
    low, high = found.coverage_interval
    assert low <= 1e-5
    assert high < 2e-4
    assert found.budget[0].source == "cogging that the scatter may hide"
