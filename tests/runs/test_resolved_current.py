"""A rated current that no instrument of the bench resolves, as where mA were meant or a prefix was left out."""

from dataclasses import replace

import pytest

from bench.motor.motor_file import load_motor
from procedures.core.procedure_error import ProcedureError
from sim_instruments.bench import VirtualBench
from tests.runs.on_bench import measure

FILE = load_motor("lg-400w")


@pytest.mark.parametrize(
    ("name", "instrument"),
    [
        ("stator-resistance-dc", "supply"),
        ("pole-pairs-static", "supply"),
        ("dq-inductance-time-constant", "supply"),
        ("torque-constant", "inverter"),
    ],
)
def test_a_rated_current_below_what_the_bench_resolves_is_no_fault_of_the_wiring(name: str, instrument: str) -> None:
    plate = replace(FILE.nameplate, rated_current=1e-6)
    with (
        VirtualBench(FILE.virtual_motor(), seed=2, sockets=False) as bench,
        pytest.raises(
            ProcedureError, match=rf"1e-06 A, below what the {instrument} can resolve .* Correct rated_current"
        ),
    ):
        measure(bench, plate, name)


def test_a_small_motor_is_measured() -> None:
    plate = replace(FILE.nameplate, rated_current=0.5)
    with VirtualBench(FILE.virtual_motor(), seed=2, sockets=False) as bench:
        assert measure(bench, plate, "pole-pairs-static").parameter("pole_pairs").value == 4
