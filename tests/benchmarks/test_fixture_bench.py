"""Making a bench with all of its instruments, and a round of relays."""

import pytest
import pyvisa
from pytest_benchmark.fixture import BenchmarkFixture

from bench.motor.motor_file import load_motor
from sim_instruments.bench import VirtualBench

MOTOR = load_motor("lg-400w").virtual_motor()


@pytest.mark.parametrize("fixture", [False, True])
def test_making_a_bench(benchmark: BenchmarkFixture, fixture: bool) -> None:
    def make() -> int:
        with VirtualBench(MOTOR, sockets=False, fixture=fixture) as bench:
            assert bench.visa_library is not None
            return len(bench.addresses())

    assert benchmark(make) == (10 if fixture else 7)


def test_a_round_of_relays(benchmark: BenchmarkFixture) -> None:
    with VirtualBench(MOTOR, sockets=False, fixture=True) as bench:
        matrix = pyvisa.ResourceManager(bench.visa_library).open_resource(
            str(bench.address("switch_matrix")), read_termination="\n", write_termination="\n"
        )
        names = ("A:supply+", "B:supply-", "C:supply-", "A:channel1+", "B:channel1-")
        channels = ",".join(str(bench.crosspoints[name]) for name in names)

        def switch() -> str:
            matrix.write(f"ROUT:CLOS (@{channels})")  # type: ignore[attr-defined]
            reply = str(matrix.query("ROUT:CLOS? (@111,122)"))  # type: ignore[attr-defined]
            matrix.write(f"ROUT:OPEN (@{channels})")  # type: ignore[attr-defined]
            matrix.query("*OPC?")  # type: ignore[attr-defined]
            return reply

        assert benchmark(switch) == "1,1"
