"""What the wires cost: a query, a long record, the safety contacts beside busy clients, a whole demo.

Run with `pytest tests/benchmarks/test_served_bench.py --benchmark-enable -n 0`; the figures are in `extra_info`.
"""

import json
import os
import resource
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvisa

from drivers.bases.waveform import Preamble, to_values
from drivers.catalogue import Surroundings
from drivers.transport.visa.opening import open_session
from tests.sim_instruments.server.wires import exactly, port_of

ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
POLL = bytes.fromhex("0001 0000 0006 01 02 0000 0001")


class Wall:
    def now(self) -> float:
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        raise AssertionError(seconds)


@contextmanager
def process(*arguments: str) -> Iterator[dict[str, Any]]:
    """Run Python with arguments until the end of the block; give the JSON object that it prints first."""
    started = subprocess.Popen([sys.executable, *arguments], stdout=subprocess.PIPE, env=ENVIRONMENT, text=True)
    try:
        assert started.stdout is not None
        yield json.loads(started.stdout.readline())
    finally:
        started.terminate()
        started.communicate()


def served(*arguments: str) -> Any:
    return process("-m", "bench", "sim", "serve", "--motor", "lg-400w", "--json", *arguments)


@pytest.fixture
def surroundings() -> Surroundings:
    manager = pyvisa.ResourceManager("@py")
    return Surroundings(Wall(), lambda: manager)


def seconds(action: Callable[[], object], number: int) -> float:
    """Time (s) of one call."""
    begun = time.perf_counter()
    for _ in range(number):
        action()
    return (time.perf_counter() - begun) / number


def processor_time(used: resource.struct_rusage) -> float:
    return used.ru_utime + used.ru_stime


@pytest.mark.parametrize("way", ["hislip", "socket"])
def test_a_query_by_a_driver_against_pyvisas(benchmark: Any, surroundings: Surroundings, way: str) -> None:
    with served() as bench:
        address = bench["addresses"]["supply"][way]
        session = open_session(address, surroundings, "supply")
        raw: Any = pyvisa.ResourceManager("@py").open_resource(address)
        raw.read_termination = raw.write_termination = "\n"
        raw.timeout = 10_000

        def driver() -> float:
            return session.query_number("VOLT? (@1)")

        def plain() -> float:
            return float(raw.query("VOLT? (@1)"))

        session.identity_line()
        assert driver() == plain()
        benchmark(driver)
        if benchmark.enabled:
            # One after the other again and again: a machine that others load slows both.
            pairs = [(seconds(driver, 50), seconds(plain, 50)) for _ in range(60)]
            ratio = min(pair[0] for pair in pairs) / min(pair[1] for pair in pairs)
            benchmark.extra_info["driver / PyVISA, least of each, at most 1.15"] = round(ratio, 3)
            ratio = statistics.median(ours / theirs for ours, theirs in pairs)
            benchmark.extra_info["driver / PyVISA, median"] = round(ratio, 3)
        session.close()
        raw.close()


@pytest.mark.parametrize("way", ["hislip", "socket"])
def test_ten_million_points_into_volts(benchmark: Any, surroundings: Surroundings, way: str) -> None:
    points = 10_000_000 if benchmark.enabled else 100_000
    preamble = Preamble(points, 1e-6, 0.0, 0.0, 1.25e-4, 0.5, 32768.0)
    with process("-m", "tests.benchmarks.block_server", str(points)) as addresses:
        session = open_session(addresses[way], surroundings, "oscilloscope")
        session.identity_line()

        def fetch() -> Any:
            return to_values(np.frombuffer(session.query_block("WAV:DATA?"), dtype="<u2"), preamble)

        used = resource.getrusage(resource.RUSAGE_SELF)
        volts = benchmark.pedantic(fetch, rounds=20)
        assert volts.shape == (points,)
        np.testing.assert_allclose(volts[:3], 0.5 - (32768.0 - np.arange(3)) * 1.25e-4)
        if benchmark.enabled:
            rate = 2 * points / benchmark.stats.stats.min / 1e6
            benchmark.extra_info["MB/s into volts, at least 250"] = round(rate)
            # What the machine would do if others left it alone.
            spent = processor_time(resource.getrusage(resource.RUSAGE_SELF)) - processor_time(used)
            benchmark.extra_info["MB/s of our processor time"] = round(20 * 2 * points / spent / 1e6)
        session.close()


def test_contacts_while_three_clients_read_records(benchmark: Any) -> None:
    with ExitStack() as opened:
        bench = opened.enter_context(served("--speedup", "20"))
        scope = bench["addresses"]["oscilloscope"]["socket"]
        for _ in range(3):
            opened.enter_context(process("-m", "tests.benchmarks.reader", str(port_of(scope))))
        address = bench["station"]["interlocks"]["emergency_stop"]["address"]
        poll = opened.enter_context(socket.create_connection(("127.0.0.1", port_of(address)), timeout=60.0))

        def ask() -> bytes:
            poll.sendall(POLL)
            return exactly(poll, 10)

        assert benchmark.pedantic(ask, rounds=3000)[-1] == 1
        if benchmark.enabled:
            took = sorted(benchmark.stats.stats.data)
            benchmark.extra_info["longest of 3000 polls (ms), at most 50"] = round(took[-1] * 1e3, 1)
            benchmark.extra_info["99.9 % of them (ms)"] = round(took[-4] * 1e3, 1)


def test_a_demo_through_the_wires(benchmark: Any, tmp_path: Path) -> None:
    procedures, speedup = ("all", 10) if benchmark.enabled else ("stator-resistance", 200)
    motor = ("--motor", "lg-400w", "--json", "--runs", str(tmp_path))

    def run(*station: str) -> Any:
        command = (sys.executable, "-m", "bench", "run", procedures, *station, *motor)
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=ENVIRONMENT)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    file = tmp_path / "station.toml"
    with served("--speedup", str(speedup), "--station-file", str(file)):
        wires = benchmark.pedantic(run, args=("--station", str(file)), rounds=1)
    in_process = run("--station", "virtual", "--operator", "virtual")
    assert wires["status"] == in_process["status"] == "completed"
    if benchmark.enabled:
        ratio = wires["wall_time"] * speedup / in_process["bench_time"]
        benchmark.extra_info["wires / in process at the same speed-up, at most 3"] = round(ratio, 2)
