"""Use of a six-step drive: the motor run up, its DC link and its Hall sensors read."""

import math
from contextlib import AbstractContextManager
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import OneInstrumentBench

_RUN_UP = 2.0


def _prepare(stand: OneInstrumentBench) -> None:
    stand.world.connect({"A": "drive_1", "B": "drive_2", "C": "drive_3"})


def _energise(_: OneInstrumentBench, drive: Any) -> AbstractContextManager[None]:
    block: AbstractContextManager[None] = drive.running()
    return block


def _compare(stand: OneInstrumentBench, drive: Any, checks: Checks, what: str) -> None:
    actual = stand.world.six_step
    checks.reading(f"{what}: DC link voltage", drive.measure_bus_voltage(), actual.bus_voltage(0.02), "V", 0.02)
    checks.reading(f"{what}: DC link current", drive.measure_bus_current(), actual.bus_current(0.02), "A", 0.03)
    checks.reading(f"{what}: frequency", drive.measure_frequency(), actual.electrical_frequency(), "Hz", 0.1)


def _halls(stand: OneInstrumentBench, drive: Any, checks: Checks, angles: int) -> None:
    for _ in range(angles):
        stand.world.move_shaft(10.0, 2.0 * math.pi / stand.world.motor.pole_pairs / angles / 10.0)
        stand.wait(0.5)
        found, actual = drive.hall_state(), stand.world.six_step.hall_state()
        checks.that("Hall signals", found == actual, f"{found} instead of {actual}", "Compare the order of the bits")
    stand.world.let_go()


def _brief(stand: OneInstrumentBench, drive: Any, checks: Checks) -> None:
    with drive.running():
        checks.that("runs in a block", stand.energised, "the bridge is off", "Enable it in the block")
        stand.wait(0.5)
        _compare(stand, drive, checks, "running")
        found, actual = drive.hall_state(), stand.world.six_step.hall_state()
    right, remedy = len(found) == 3 and isinstance(found[0], bool), "Give three"
    checks.that("Hall signals while running", right, f"{found}, {actual}", remedy)
    stand.off(checks)


def _full(stand: OneInstrumentBench, drive: Any, checks: Checks) -> None:
    stand.wait(10.0)
    _compare(stand, drive, checks, "at rest")
    _halls(stand, drive, checks, 12)
    with drive.running():
        stand.wait(_RUN_UP)
        _compare(stand, drive, checks, "at speed")
    stand.off(checks)
    stand.wait(20.0)


SESSION = CheckSession(_prepare, _brief, _full, _energise, stuck="drive")
