"""Use of an inverter that regulates the currents of both axes at the rotor's own angle."""

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import DqReading, InstrumentError, InverterAbility

_REMEDY = "Compare the command with the manual: rms or peak, mA, which axis is which, sign"
_READS = "Compare scale, sign and axis with the manual"
#: How long (s) readings are averaged, and how far (rad) an angle may be from the rotor's.
_TIME, _APART = 0.05, 0.1
#: How long (s) a hand turns the rotor before its speed is read.
_TURNING = 2.0
#: How long (s) a stroke lasts, long enough for a current to settle in half of it, and how many there are.
_STROKE, _STROKES = 0.04, 3


@contextmanager
def holding_still(stand: OneInstrumentBench, drive: Callable[[], AbstractContextManager[None]]) -> Iterator[None]:
    """Hold the rotor, which a current would speed up, while something drives."""
    stand.world.lock_rotor()
    try:
        with drive():
            yield
    finally:
        stand.world.release_rotor()


def both_currents(stand: OneInstrumentBench, inverter: Any, checks: Checks) -> None:
    """Use it briefly."""
    most = _largest(inverter)
    _regulate(stand, inverter, checks, complex(-0.12 * most, 0.16 * most))


def both_currents_fully(stand: OneInstrumentBench, inverter: Any, checks: Checks) -> None:
    """Use it over random currents, and with those that cannot be."""
    most = _largest(inverter)
    for d, q in ((-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
        current = most * complex(d * stand.between(0.2, 0.6), q * stand.between(0.2, 0.6))
        _regulate(stand, inverter, checks, current, in_time=True)
    highest = inverter.maximum_current
    beyond = ((2.0 * highest, 0.0), (0.0, -2.0 * highest), (0.9 * highest, 0.9 * highest), (math.nan, 0.0))
    for act in (inverter.driving_dq_current, inverter.set_dq_current):
        checks.rejects("currents of both axes that cannot be", act, *beyond)
    if InverterAbility.DQ_STROKES in inverter.abilities:
        wrong = ((0.0, 3), (-1.0, 3), (math.nan, 3), (_STROKE, 0), (_STROKE, -3))
        checks.rejects(
            "strokes that cannot be", inverter.alternate_dq_current, *((1.0, 0.0, 0.0, 1.0, *one) for one in wrong)
        )
    inverter.make_safe()
    remedy = "Change currents inside a block only"
    with checks.refuses("currents outside of a block", InstrumentError, remedy=remedy):
        inverter.set_dq_current(0.0, 0.1 * most)
    stand.off(checks)
    for speed in (stand.between(20.0, 40.0), -stand.between(50.0, 80.0)):
        _turned(stand, inverter, checks, speed)


def _turned(stand: OneInstrumentBench, inverter: Any, checks: Checks, speed: float) -> None:
    """Read a rotor that a hand turns (rad/s), without a current and with one."""
    world = stand.world
    world.turn_shaft(speed)
    stand.wait(_TURNING)
    for current in (0.0, 0.1 * _largest(inverter)):
        with inverter.driving_dq_current(0.0, current) if current else nullcontext():
            stand.wait(_TIME)
            before = stand.bench.clock.now()
            reading, actual = inverter.measure_dq(_TIME), world.inverter.rotor_state().electrical_speed
            now = stand.bench.clock.now()
            checks.that("time of the reading", before <= reading.time <= now, f"{reading.time:g} s", "Give the clock's")
            right, remedy = reading.duration == _TIME and reading.samples > 1, "Take samples for as long as is asked"
            checks.that("readings: for as long as asked", right, f"{reading.samples} in {reading.duration} s", remedy)
            slack = 0.1 * abs(actual)
            checks.close("turned: electrical speed", reading.electrical_speed, actual, slack, _READS)
            shown = inverter.measure_frequency().value
            checks.close("turned: frequency", 2.0 * math.pi * shown, actual, slack, _READS)
            silent = math.isnan(reading.d_voltage) and math.isnan(reading.q_voltage)
            voltages = InverterAbility.VOLTAGES in inverter.abilities and current > 0.0
            checks.that(
                "voltages: none where it is off", silent is not voltages, f"{reading}", "Give NaN where it is off"
            )
            bus = world.inverter.stage.dc_voltage
            checks.close("bus voltage", _or(reading.bus_voltage, bus), bus, 0.05 * bus, _READS)
            if current and InverterAbility.DQ_STROKES in inverter.abilities:
                one, *_, last = inverter.alternate_dq_current(current, 0.0, 0.0, current, _STROKE, _STROKES)
                rate = (last.electrical_angle - one.electrical_angle) / (last.time - one.time)
                checks.close("strokes: angle of a rotor that turns", rate, actual, slack, _READS)
            warm = world.winding_temperature()
            checks.close("winding temperature", _or(reading.winding_temperature, warm), warm, 5.0, _READS)
    world.hold_shaft()
    stand.wait(_TURNING)
    world.let_go()


def _or(read: float, actual: float) -> float:
    """Return what is read, or the actual value where it is not measured."""
    return actual if math.isnan(read) else read


def _largest(inverter: Any) -> float:
    return float(min(inverter.maximum_current, 10.0))


def _regulate(
    stand: OneInstrumentBench, inverter: Any, checks: Checks, current: complex, *, in_time: bool = False
) -> None:
    sampling = stand.sampling(stand.world.inverter.current_amplitude)
    block = holding_still(stand, lambda: inverter.driving_dq_current(current.real, current.imag))
    with sampling as currents, block:
        checks.that("drives in a block", stand.energised, "the drive is off", "Enable it in the block")
        _reached(stand, checks, "set point: both currents", current)
        _compare(stand, inverter, checks, inverter.measure_dq(_TIME))
        inverter.set_dq_current(-0.5 * current.imag, 0.5 * current.real)
        _reached(stand, checks, "set point: both currents in a block", complex(-0.5 * current.imag, 0.5 * current.real))
        if InverterAbility.DQ_STROKES in inverter.abilities:
            _alternate(stand, inverter, checks, current, in_time=in_time)
        most, less = max(currents, default=0.0), 1.2 * abs(current) + 0.2
        none = "Command no more on the way to a current than it"
        checks.that("no more current on the way", most <= less, f"{most:.3g} A for {abs(current):.3g} A", none)
        inverter.command_zero()
        stand.wait(_TIME)
        _reached(stand, checks, "command_zero(): both currents", 0j)
    stand.off(checks)


def _alternate(stand: OneInstrumentBench, inverter: Any, checks: Checks, current: complex, *, in_time: bool) -> None:
    samples = inverter.alternate_dq_current(current.real, current.imag, current.real, -current.imag, _STROKE, _STROKES)
    said = [complex(one.d_current, one.q_current) for one in samples]
    wanted = [0j, *([current, current.conjugate()] * _STROKES)[:_STROKES], 0j]
    checks.that(
        "strokes: samples",
        len(said) == _STROKES + 2,
        f"{len(said)} samples of {_STROKES} strokes",
        "Read before each stroke, before none, and after it",
    )
    times = [one.time - samples[0].time for one in samples]
    due = [0.0, *(0.5 + number for number in range(_STROKES - 1)), _STROKES - 1.0, float(_STROKES)]
    late = max(abs(one - _STROKE * other) for one, other in zip(times, due, strict=False))
    remedy = "The first and the last have half of the duration"
    checks.close("strokes: times", late if in_time else 0.0, 0.0, 0.03 * _STROKE, remedy)
    actual = stand.world.inverter.rotor_state()
    apart = max(abs(math.remainder(one.electrical_angle - actual.electrical_angle, 2.0 * math.pi)) for one in samples)
    checks.close("strokes: angle of a rotor that stands", apart, 0.0, _APART, _READS)
    fastest = max(abs(one.electrical_speed) for one in samples)
    checks.close("strokes: speed of a rotor that stands", fastest, 0.0, 0.5, _READS)
    # The block's current before them is whatever it was.
    apart = max(abs(one - other) for one, other in zip(said[1:], wanted[1:], strict=False))
    checks.close("strokes: currents at their ends", apart, 0.0, 0.05 * abs(current) + 0.2, _REMEDY)
    stand.wait(_TIME)
    _reached(stand, checks, "strokes: none at the end", 0j)


def _reached(stand: OneInstrumentBench, checks: Checks, what: str, current: complex) -> None:
    found, slack = stand.world.inverter.rotor_state().current, 0.03 * abs(current) + 0.1
    checks.close(f"{what}, d axis", found.real, current.real, slack, _REMEDY)
    checks.close(f"{what}, q axis", found.imag, current.imag, slack, _REMEDY)


def _compare(stand: OneInstrumentBench, inverter: Any, checks: Checks, reading: DqReading) -> None:
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
