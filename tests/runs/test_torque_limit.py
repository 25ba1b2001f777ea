"""A dynamometer that does not hold its speed against the motor: said, not measured."""

from dataclasses import replace
from pathlib import Path

import pytest

from bench.motor.motor_file import MotorFile
from bench.testing import run_procedures, virtual_motor
from bench.virtual.virtual_station import BenchSize


def counted(motor: MotorFile) -> MotorFile:
    return replace(motor, nameplate=replace(motor.nameplate, pole_pairs=motor.virtual_motor().pole_pairs))


def test_a_torque_at_the_drives_limit_is_no_torque_of_the_motor(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """24 A make 11.5 N·m of this motor, and a virtual dynamometer that is not chosen for it gives 10 N·m."""
    monkeypatch.setattr("bench.virtual.virtual_station.bench_size_for", lambda *_: BenchSize())
    motor = virtual_motor("lg-400w", flux_linkage=0.08, viscous_friction=0.05)
    settings = {"speed_share": 0.05, "current_share": 0.83}
    ran = run_procedures(["torque-constant"], motor, tmp_path, seed=3, settings=settings, faults=[])
    assert ran.status == "failed"
    assert "the drive's torque limit" in ran.cause
    assert not ran.parameters
    assert not ran.left["energised"]


def test_a_flux_map_leaves_out_where_the_dynamometer_does_not_hold_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The motor's 17 N·m at the rated current let it run away from a dynamometer of 10 N·m; every other current is as it is."""
    monkeypatch.setattr("bench.virtual.virtual_station.bench_size_for", lambda *_: BenchSize())
    motor = counted(virtual_motor("lg-400w", flux_linkage=0.1, inertia=0.05))
    settings = {"locations": 20, "speed_share": 0.1}
    ran = run_procedures(["flux-map"], motor, tmp_path, seed=3, settings=settings, faults=[])
    assert ran.status == "completed", ran.cause
    assert "dynamometer-limit" in ran.warnings
    assert "torque-differs" not in ran.warnings
    low, high = ran.parameters["map_flux_linkage"].coverage_interval
    assert low < 0.1 < high
    assert not ran.left["energised"]


@pytest.mark.slow
def test_a_flux_map_of_which_the_dynamometer_leaves_nothing_is_refused_for_that(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("procedures.techniques.maps.readings.holds", lambda *_: False)
    settings = {"locations": 20, "speed_share": 0.1}
    ran = run_procedures(
        ["flux-map"], counted(virtual_motor("lg-400w")), tmp_path, seed=3, settings=settings, faults=[]
    )
    assert ran.status == "failed"
    assert "the dynamometer did not hold 300 rpm" in ran.cause
    assert not ran.left["energised"]
