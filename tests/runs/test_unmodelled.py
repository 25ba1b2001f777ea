"""What the virtual bench does not model: the procedure fails and says so, and gives no figure."""

from dataclasses import replace
from pathlib import Path

import pytest

from bench.testing import run_procedures, virtual_motor
from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.motor import defects
from sim_instruments.world.machine_data import InverterStage
from sim_instruments.world.world import World


def test_a_six_step_drive_does_not_run_on_a_dead_hall_sensor(tmp_path: Path) -> None:
    sound = virtual_motor("92bl-30-25l")
    bad = replace(sound, virtual=defects.hall_stuck(sound.virtual_motor(), "high"))
    for motor, status in ((sound, "completed"), (bad, "failed")):
        ran = run_procedures(["no-load-current-six-step"], motor, tmp_path, seed=2, settings={}, faults=[])
        assert ran.status == status
        assert bool(ran.parameters) == (status == "completed")
    assert (
        "the virtual bench does not model a six-step drive that commutates by faulty or turned Hall sensors"
        in ran.cause
    )
    assert "leave the motor's Hall faults out" in ran.cause
    assert not ran.left["energised"]


@pytest.mark.parametrize(("bus", "told"), [(400.0, False), (20.0, True)])
def test_an_inverter_that_is_off_conducts_once_the_emf_is_above_its_bus(bus: float, told: bool) -> None:
    clock = VirtualClock()
    motor = virtual_motor("lg-400w").virtual_motor()
    world = World(motor, clock, inverter=InverterStage(dc_voltage=bus))
    world.couple_dynamometer()
    world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
    world.dynamometer.set_mode("speed")
    world.dynamometer.command(400.0)
    world.dynamometer.enable(True)
    clock.sleep(5.0)
    assert 20.0 < 400.0 * motor.pole_pairs * motor.flux_linkage * 3.0**0.5 < 400.0
    assert any("the diodes of an inverter" in what for what in world.truth()["unmodelled"]) == told
    world.connect({})
    clock.sleep(1.0)
    seen = dict(world.unmodelled)
    world.dynamometer.command(500.0)
    clock.sleep(1.0)
    assert dict(world.unmodelled) == seen
