"""Use of a voltmeter: the voltage of a supply, through all ranges."""

import math
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import MeasurementError, OverloadError

#: Length (s) of a power-line cycle at 60 Hz.
_CYCLE = 1.0 / 60.0


def _prepare(stand: OneInstrumentBench) -> None:
    world = stand.world
    world.connect({"A": "supply+", "B": "supply-"})
    world.lock_rotor()
    world.supply.set_over_voltage(None)
    world.supply.set_current_limit(world.supply.stage.maximum_current)
    stand.watch(world, "voltmeter_voltage")
    _apply(stand, 2.0)


def _apply(stand: OneInstrumentBench, voltage: float) -> None:
    """Put a voltage (V) of either sign between the leads."""
    world = stand.world
    world.attach_voltmeter(*(("A", "B") if voltage >= 0.0 else ("B", "A")))
    world.supply.set_voltage(abs(voltage))
    world.supply.switch(True)
    stand.wait(0.5)


def _compare(stand: OneInstrumentBench, meter: Any, checks: Checks, full_scale: float, cycles: float) -> None:
    meter.configure(full_scale, cycles)
    reading = meter.measure_voltage()
    actual = stand.world.voltmeter_voltage(0.1)
    checks.reading(f"at {full_scale:g} V: reading", reading, actual, "V", 1e-6)
    integration = max(call[0] for call in stand.calls["voltmeter_voltage"][-3:-1])
    right = cycles * _CYCLE * 0.99 <= integration <= 20.0 * cycles * _CYCLE
    remedy = "Compare the command with the manual: cycles or seconds"
    checks.that("set point: integration time", right, f"{integration:.3g} s for {cycles:g} power-line cycles", remedy)
    stated = meter.accuracy_at(full_scale)
    right = math.isclose(stated.offset, reading.accuracy.offset) and math.isclose(stated.gain, reading.accuracy.gain)
    remedy = "Work both out by the same function"
    checks.that("accuracy_at agrees with the reading", right, f"{stated} instead of {reading.accuracy}", remedy)
    half = abs(reading.accuracy.gain * full_scale) + reading.accuracy.offset
    said, remedy = f"± {half:g} V at a full scale of {full_scale:g} V", "Choose the smallest range that holds it"
    checks.that("the range holds the full scale and is not far above it", half <= 1e-2 * full_scale, said, remedy)


def _brief(stand: OneInstrumentBench, meter: Any, checks: Checks) -> None:
    withstood, remedy = meter.maximum_voltage, "Give the voltage that its leads may be on, whatever range is set"
    checks.that("maximum_voltage is what its leads withstand", 5.0 <= withstood < math.inf, f"{withstood} V", remedy)
    _compare(stand, meter, checks, 5.0, 10.0)


def _full(stand: OneInstrumentBench, meter: Any, checks: Checks) -> None:
    for voltage, full_scale, cycles in (
        (stand.between(0.05, 0.08), 0.1, 10.0),
        (stand.between(0.6, 0.9), 1.0, 100.0),
        (-stand.between(5.0, 8.0), 10.0, 20.0),
        (stand.between(5.0, 8.0), 12.0, 10.0),
    ):
        _apply(stand, voltage)
        _compare(stand, meter, checks, full_scale, cycles)
    meter.configure(0.1)
    for _ in range(2):
        with checks.refuses("beyond the range", OverloadError, remedy="Refuse 9.9E37 and what is like it"):
            meter.measure_voltage()
    wrong = ((math.nan, 10.0), (1e6, 10.0), (-1.0, 10.0), (1.0, math.nan), (1.0, 1e9))
    checks.rejects("set points that cannot be", meter.configure, *wrong)
    with checks.refuses("accuracy beyond all ranges", MeasurementError, remedy="State none that the manual does not"):
        meter.accuracy_at(1e6)
    _apply(stand, 2.0)


SESSION = CheckSession(_prepare, _brief, _full)
