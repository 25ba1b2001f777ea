"""A dynamometer that does not hold its speed against the motor: said, not measured."""

from pathlib import Path

import pytest

from bench.testing import run_procedures, virtual_motor
from bench.virtual.virtual_station import BenchSize


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
