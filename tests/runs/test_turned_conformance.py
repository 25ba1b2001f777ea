"""Open circuit, short circuit and load points by the conformance kit: random motors, and an abort at every step."""

import pytest

from bench.motor.motor_file import MotorFile
from bench.testing.conformance.procedure import check_procedure
from sim_instruments.world.machine_data import Leads

pytestmark = pytest.mark.slow

QUICK = ("readings=4", "periods=2", "interval=0.02", "settle=0.1", "zero_rest=0.2")
BEFORE = ("stator-resistance", "dq-inductance-extremes")


def short(motor: MotorFile) -> dict[str, float]:
    true = motor.virtual_motor()
    return {
        "d_axis_chord_inductance": true.d_axis_inductance_y,
        "short_circuit_current": true.flux_linkage_y / true.d_axis_inductance_y,
        "short_circuit_resistance": true.stator_resistance_y + Leads().resistance,
    }


def loss(motor: MotorFile) -> dict[str, float]:
    true, plate = motor.virtual_motor(), motor.nameplate
    speed = (plate.rated_speed_rpm or 0.0) * 3.141592653589793 / 30.0
    return {"open_circuit_loss": (true.coulomb_friction + true.viscous_friction * speed) * speed}


def load(motor: MotorFile) -> dict[str, float]:
    true, plate = motor.virtual_motor(), motor.nameplate
    speed = 0.5 * (plate.rated_speed_rpm or 0.0) * 3.141592653589793 / 30.0
    drag = (true.coulomb_friction + true.viscous_friction * speed) * speed
    return {"total_loss": 1.5 * true.stator_resistance_y * (0.5 * plate.rated_current) ** 2 + drag}


@pytest.mark.parametrize(
    ("name", "settings", "before", "truth"),
    [
        ("open-circuit", ("speeds=3",), (), loss),
        ("short-circuit", ("phases=false",), BEFORE, short),
        ("load-points", ("speed_shares=[0.5]", "current_shares=[0.5]", "phases=false"), (), load),
    ],
)
def test_it_conforms(name, settings, before, truth, tmp_path):
    taken = [f"{name}.{each}" for each in (*settings, *QUICK)]
    check_procedure(name, tmp_path, motors=2, settings=taken, before=before, truth=truth).require()
