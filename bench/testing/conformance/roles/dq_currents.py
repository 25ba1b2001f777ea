"""Use of an inverter that regulates the currents of both axes at the rotor's own angle."""

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.stand import Stand
from drivers.interfaces import DqReading, InverterAbility

_REMEDY = "Compare the command with the manual: rms or peak, mA, which axis is which, sign"
_READS = "Compare scale, sign and axis with the manual"
#: How long (s) readings are averaged, and how far (rad) an angle may be from the rotor's.
_TIME, _APART = 0.05, 0.1
#: How long (s) a stroke lasts, long enough for a current to settle in half of it, and how many there are.
_STROKE, _STROKES = 0.04, 3


@contextmanager
def holding_still(stand: Stand, drive: Callable[[], AbstractContextManager[None]]) -> Iterator[None]:
    """Hold the rotor, which a current would speed up, while something drives."""
    stand.world.lock_rotor()
    try:
        with drive():
            yield
    finally:
        stand.world.release_rotor()


def both_currents(stand: Stand, inverter: Any, checks: Checks) -> None:
    """Use it briefly."""
    most = _largest(inverter)
    _regulate(stand, inverter, checks, complex(-0.12 * most, 0.16 * most))


def both_currents_fully(stand: Stand, inverter: Any, checks: Checks) -> None:
    """Use it over random currents, and with those that cannot be."""
    most = _largest(inverter)
    for d, q in ((-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
        _regulate(stand, inverter, checks, most * complex(d * stand.between(0.2, 0.6), q * stand.between(0.2, 0.6)))
    highest = inverter.maximum_current
    beyond = ((2.0 * highest, 0.0), (0.0, -2.0 * highest), (0.9 * highest, 0.9 * highest), (math.nan, 0.0))
    for act in (inverter.driving_dq_current, inverter.set_dq_current):
        checks.rejects("currents of both axes that cannot be", act, *beyond)


def _largest(inverter: Any) -> float:
    return float(min(inverter.maximum_current, 10.0))


def _regulate(stand: Stand, inverter: Any, checks: Checks, current: complex) -> None:
    sampling = stand.sampling(stand.world.inverter.current_amplitude)
    block = holding_still(stand, lambda: inverter.driving_dq_current(current.real, current.imag))
    with sampling as currents, block:
        checks.that("drives in a block", stand.energised, "the drive is off", "Enable it in the block")
        _reached(stand, checks, "set point: both currents", current)
        _compare(stand, inverter, checks, inverter.measure_dq(_TIME))
        inverter.set_dq_current(-0.5 * current.imag, 0.5 * current.real)
        _reached(stand, checks, "set point: both currents in a block", complex(-0.5 * current.imag, 0.5 * current.real))
        if InverterAbility.DQ_STROKES in inverter.abilities:
            _alternate(stand, inverter, checks, current)
        most, less = max(currents, default=0.0), 1.2 * abs(current) + 0.2
        none = "Command no more on the way to a current than it"
        checks.that("no more current on the way", most <= less, f"{most:.3g} A for {abs(current):.3g} A", none)
        inverter.command_zero()
        stand.wait(_TIME)
        _reached(stand, checks, "command_zero(): both currents", 0j)
    stand.off(checks)


def _alternate(stand: Stand, inverter: Any, checks: Checks, current: complex) -> None:
    samples = inverter.alternate_dq_current(current.real, current.imag, current.real, -current.imag, _STROKE, _STROKES)
    said = [complex(one.d_current, one.q_current) for one in samples]
    wanted = [0j, *([current, current.conjugate()] * _STROKES)[:_STROKES], 0j]
    checks.that(
        "strokes: samples",
        len(said) == _STROKES + 2,
        f"{len(said)} samples of {_STROKES} strokes",
        "Read before each stroke, before none, and after it",
    )
    # The block's current before them is whatever it was.
    apart = max(abs(one - other) for one, other in zip(said[1:], wanted[1:], strict=False))
    checks.close("strokes: currents at their ends", apart, 0.0, 0.05 * abs(current) + 0.2, _REMEDY)
    stand.wait(_TIME)
    _reached(stand, checks, "strokes: none at the end", 0j)


def _reached(stand: Stand, checks: Checks, what: str, current: complex) -> None:
    found, slack = stand.world.inverter.rotor_state().current, 0.03 * abs(current) + 0.1
    checks.close(f"{what}, d axis", found.real, current.real, slack, _REMEDY)
    checks.close(f"{what}, q axis", found.imag, current.imag, slack, _REMEDY)


def _compare(stand: Stand, inverter: Any, checks: Checks, reading: DqReading) -> None:
    actual = stand.world.inverter.rotor_state()
    for axis, read, true in (
        ("d axis", reading.d_current, actual.current.real),
        ("q axis", reading.q_current, actual.current.imag),
    ):
        checks.accuracy(f"current reading, {axis}", reading.current_accuracy, read, "A", true, 0.05)
    frequency, current = inverter.measure_frequency(), inverter.measure_current()
    checks.reading(
        "with both currents: frequency reading", frequency, actual.electrical_speed / (2.0 * math.pi), "Hz", 0.05
    )
    checks.reading("with both currents: current reading", current, actual.current.imag, "A", 0.05)
    speed = reading.electrical_speed
    checks.close(
        "electrical speed reading", speed, actual.electrical_speed, 0.01 * abs(actual.electrical_speed) + 0.5, _READS
    )
    within = "Average what the drive says within the time that is asked for"
    checks.that("readings are averaged", reading.samples >= 1, f"{reading.samples} samples", within)
    if InverterAbility.VOLTAGES in inverter.abilities:
        for axis, read, true in (
            ("d axis", reading.d_voltage, actual.voltage.real),
            ("q axis", reading.q_voltage, actual.voltage.imag),
        ):
            checks.accuracy(f"voltage reading, {axis}", reading.voltage_accuracy, read, "V", true, 0.05)
    else:
        silent = math.isnan(reading.d_voltage) and math.isnan(reading.q_voltage)
        checks.that("voltages that are not read", silent, f"{reading}", "Give NaN for them")
    if InverterAbility.ROTOR_ANGLE in inverter.abilities:
        apart = math.remainder(reading.electrical_angle - actual.electrical_angle, 2.0 * math.pi)
        checks.close(
            "angle reading",
            apart,
            0.0,
            _APART,
            "Compare direction and zero with the manual: 0 is d along terminal A's axis",
        )
        known = 0.0 <= reading.electrical_angle <= 2.0 * math.pi
        checks.that("angle within a turn", known, f"{reading.electrical_angle} rad", "Give it from 0 to 2π")
    else:
        unknown = math.isnan(reading.electrical_angle)
        checks.that("an angle that is not read", unknown, f"{reading.electrical_angle}", "Give NaN for it")
