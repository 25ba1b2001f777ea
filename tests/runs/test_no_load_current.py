"""The no-load current of a virtual motor whose friction and torque constant are known."""

import math
from dataclasses import replace

import pytest

from bench.motor.motor_file import load_motor
from procedures.core.bench import ProcedureError
from procedures.core.procedure_error import OnlyBoundedError
from procedures.verification.verifier import WiringError
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.disturbances.bench import Disturbances, ShaftSensors
from sim_instruments.instruments.errors import DynamometerErrors, Errors
from sim_instruments.physics.motor.defects import rubbing, shorted_turns
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


@pytest.mark.parametrize("torque", [0.02, 0.2, 1.5])
def test_a_rotor_that_rubs_once_a_turn_is_measured(torque):
    with VirtualBench(replace(MOTOR, rubbing_torque=torque), seed=2, sockets=False) as bench:
        result = measure(bench, PLATE, NAME)
    found = result.parameter("no_load_current")
    assert within(found, truth(MOTOR, PLATE) + 0.5 * torque / MOTOR.torque_constant)
    assert found.standard_uncertainty < 0.02 * found.value
    # The transducer's filter, which the station does not state, takes a third off.
    assert 0.25 * torque < result.findings["drag_once_a_turn"] < 0.55 * torque


@pytest.mark.parametrize("peak", [0.3, 3.0])
def test_a_drag_that_is_too_uneven_for_the_readings_is_bounded_from_below(peak):
    motor = rubbing(MOTOR, peak)
    with (
        VirtualBench(motor, seed=2, sockets=False) as bench,
        pytest.raises(OnlyBoundedError, match="A at least") as unclear,
    ):
        # Too few to tell what repeats every turn from the mean.
        measure(bench, PLATE, NAME, "readings=4")
    error = unclear.value
    assert error.parameter == NAME.replace("-", "_")
    # It drags by the mean of (1 + cos φ)/2 of the peak besides.
    mean = truth(replace(MOTOR, coulomb_friction=MOTOR.coulomb_friction + 0.5 * peak), PLATE)
    assert 0.0 < error.low < mean


#: A motor that is none of the shipped ones: one pole pair, high resistance.
FEW = replace(
    MOTOR,
    pole_pairs=1,
    phase_resistances=(0.5, 0.5, 0.5),
    d_axis_inductance=1e-3,
    q_axis_inductance=1e-3,
    flux_linkage=0.04,
)


def disturbed(motor, **sensors):
    setting = BenchSetting(disturbances=Disturbances(sensors=ShaftSensors(**sensors)))
    with VirtualBench(motor, seed=2, setting=setting, sockets=False) as bench:
        return measure(bench, PLATE, NAME)


@pytest.mark.parametrize("motor", [MOTOR, FEW])
def test_a_zero_that_drifts_between_the_two_drags_falls_out_and_is_told(motor):
    result = disturbed(motor, torque_drift=0.01 * motor.coulomb_friction)
    low, high = result.parameter("no_load_current").coverage_interval
    assert low <= truth(motor, PLATE) <= high
    assert {row["cause"] for row in result.findings["misfit"]} == {"torque-zero-drift"}


def test_a_filter_that_nobody_states_is_waited_for():
    result = disturbed(FEW, torque_filter=0.2)
    low, high = result.parameter("no_load_current").coverage_interval
    assert low <= truth(FEW, PLATE) <= high


@pytest.mark.parametrize("slow", [{"torque_filter": 4.0}, {"torque_drift": 0.002}])
def test_a_torque_that_never_settles_gives_no_figure(slow):
    with pytest.raises(ProcedureError, match=r"still changes .* zero that drifts"):
        disturbed(MOTOR, **slow)


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


def test_shorted_turns_brake_with_and_without_a_current():
    with VirtualBench(shorted_turns(MOTOR, 0.05), seed=2, sockets=False) as bench:
        result = measure(bench, PLATE, NAME)
    # A third of the torque is that winding's. The drag of the loop is alike in both readings, and leaves their difference alone.
    assert result.findings["torque_per_ampere"] == pytest.approx(MOTOR.torque_constant * (1.0 - 0.05 / 3.0), rel=0.01)
    assert result.parameter("no_load_current").value > 5.0
