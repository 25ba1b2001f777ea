"""Speed of the six-step drive's steady state, against solve_ivp in the same run."""

import math
import subprocess
import sys
import time

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from bench.motor.six_step_file import EXAMPLE, load_drive
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import SteadyState, steady_state
from tests.sim_instruments.six_step.reference import Reference

RPM = math.pi / 30
SWEEP = """
import math, resource
from pathlib import Path
import numpy as np
from bench.motor.six_step_file import load_drive
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import steady_state
bridge = Bridge(load_drive("92bl-30-25l"))
torques = [steady_state(bridge, n * math.pi / 30).load_torque for n in np.linspace(10.0, 6000.0, 1000)]
assert all(math.isfinite(torque) for torque in torques)
# ru_maxrss keeps the parent's peak through fork and exec, so Linux is asked for the process's own.
status = Path("/proc/self/status")
own = [line.split()[1] for line in status.read_text().splitlines() if "VmHWM" in line] if status.exists() else []
print(own[0] if own else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)
"""


@pytest.fixture(scope="module")
def bridge() -> Bridge:
    return Bridge(load_drive(EXAMPLE))


def test_one_steady_state(benchmark: BenchmarkFixture, bridge: Bridge) -> None:
    """Target: 2 ms."""
    point = benchmark(steady_state, bridge, 3256 * RPM)
    assert isinstance(point, SteadyState)


def test_steady_state_and_its_averages(benchmark: BenchmarkFixture, bridge: Bridge) -> None:
    def solve() -> float:
        point = steady_state(bridge, 3256 * RPM)
        return float(point.product_averages[0, 0]) + point.electromagnetic_torque

    assert benchmark(solve) > 0


def test_against_solve_ivp(benchmark: BenchmarkFixture, bridge: Bridge) -> None:
    """Target: at least 100 times faster than solve_ivp at rtol 1e-9, currents equal to 1e-6 A."""
    reference = Reference(bridge.drive, 3256 * RPM)
    start = time.perf_counter()
    expected, states = reference.periodic(tolerance=1e-8)
    slow = time.perf_counter() - start
    times = []
    for _ in range(50):
        start = time.perf_counter()
        point = steady_state(bridge, 3256 * RPM)
        times.append(time.perf_counter() - start)
    assert np.abs(point.start_currents - expected).max() < 1e-6
    benchmark.extra_info["times_faster"] = slow / float(np.median(times))
    benchmark.extra_info["solve_ivp_states"] = states
    benchmark(steady_state, bridge, 3256 * RPM)


def test_sweep_of_1000_speeds(benchmark: BenchmarkFixture, bridge: Bridge) -> None:
    """Target: 2 s."""
    speeds = np.linspace(10.0, 6000.0, 1000) * RPM

    def sweep() -> int:
        return sum(steady_state(bridge, float(speed)).load_torque > 0 for speed in speeds)

    assert 0 < benchmark.pedantic(sweep, rounds=1) < 1000


def test_memory_of_the_sweep() -> None:
    """Target: 150 MB for the whole process."""
    done = subprocess.run([sys.executable, "-c", SWEEP], capture_output=True, text=True, check=True)
    assert int(done.stdout) / 1024 < 150
