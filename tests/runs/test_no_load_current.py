"""The no-load current of a virtual motor whose friction and torque constant are known."""

import math
from dataclasses import replace

import pytest

from bench.motor.motor_file import load_motor
from procedures.core.bench import ProcedureError
from procedures.verification.verifier import WiringError
from sim_instruments.bench import VirtualBench
from sim_instruments.instruments.errors import DynamometerErrors, Errors
from tests.runs.on_bench import measure, within

FILE = load_motor("lg-400w")
MOTOR, PLATE = FILE.virtual_motor(), FILE.nameplate
NAME = "no-load-current"


def truth(motor, plate, share=0.5):
    speed = share * plate.rated_speed_rpm * math.pi / 30.0
    return (motor.coulomb_friction + motor.viscous_friction * speed) / motor.torque_constant


@pytest.mark.parametrize(
    "motor",
    [
        MOTOR,
        pytest.param(replace(MOTOR, coulomb_friction=0.05), id="a bearing that brakes"),
        pytest.param(replace(MOTOR, flux_linkage=0.8 * MOTOR.flux_linkage), id="weak magnets"),
    ],
)
def test_it_holds_the_truth(motor):
    with VirtualBench(motor, seed=2, sockets=False) as bench:
        result = measure(bench, PLATE, NAME)
        assert bench.world.truth()["shaft_speed"] == pytest.approx(0.0, abs=0.2)
    found = result.parameter("no_load_current")
    assert found.unit == "A"
    assert within(found, truth(motor, PLATE))
    assert found.standard_uncertainty < 0.03 * found.value
    assert result.findings["drag"] == pytest.approx(motor.torque_constant * truth(motor, PLATE), rel=0.02)


def test_the_transducer_s_zero_and_gain_cancel():
    errors = replace(Errors(), dynamometer=DynamometerErrors(torque_gain=0.002, torque_offset=0.005))
    with VirtualBench(MOTOR, seed=2, errors=errors, sockets=False) as bench:
        found = measure(bench, PLATE, NAME).parameter("no_load_current")
    assert within(found, truth(MOTOR, PLATE))
    torque = [row.contribution for row in found.budget if str(row.source).startswith("dynamometer, torque:")]
    assert max(torque, default=0.0) < 1e-6 * found.value


def test_a_tare_that_is_known_need_not_be_measured():
    with VirtualBench(MOTOR, seed=2, sockets=False) as bench:
        tare = measure(bench, PLATE, NAME).findings["tare"]
    with VirtualBench(MOTOR, seed=2, sockets=False) as bench:
        found = measure(bench, PLATE, NAME, f"tare={tare}", "tare_uncertainty=0.0002").parameter("no_load_current")
    assert within(found, truth(MOTOR, PLATE))
    assert "tare: drag" in {str(row.source) for row in found.budget}


def test_wires_that_drive_backwards_are_refused():
    with VirtualBench(MOTOR, seed=2, sockets=False) as bench:
        bench.world.set_swapped(("A", "B"))
        with pytest.raises(WiringError, match="torque falls"):
            measure(bench, PLATE, NAME)


def test_a_current_that_moves_nothing_is_refused():
    with (
        VirtualBench(MOTOR, seed=2, sockets=False) as bench,
        pytest.raises(ProcedureError, match="Raise current_share"),
    ):
        measure(bench, PLATE, NAME, "current_share=0.0003")
