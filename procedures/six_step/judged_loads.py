"""Differences of a six-step drive's loads from the model, and the loads that are used, with their limits of error."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from GTC.lib import UncertainReal

from drivers.interfaces import Reading
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.six_step import currents as six_step
from procedures.estimation.six_step.load_misfit import (
    LoadReadings,
    LoadVerdict,
    MeterLimits,
    VoltagePlane,
    judge_currents,
    judge_powers,
    judge_speeds,
    judge_voltages,
)
from procedures.estimation.winding.connections import Connection
from procedures.six_step.emf_fit import Seen, VoltageTerms
from procedures.six_step.load_points import LoadPoint, LoadPoints, at_least, widened
from procedures.six_step.parts import WindingData, covariance

#: Standard deviation of a rectangular distribution of the width one.
_ROUNDED = 12.0**-0.5
#: How far two ranges' mean currents differ at least (relative): by where between two samples a line is switched.
_RANGES = 2e-3
#: Stands for a reading of nothing at all, which contradicts every other one.
_NOTHING = 1e-9
#: Drop of a freewheeling diode (V): some tenths of a per cent of the power, known well enough for a balance.
_DIODE = 0.7


@dataclass(frozen=True)
class JudgedLoads:
    """The loads that count, what they show beyond the model, and how far k_e and R_t may be off together for it."""

    points: LoadPoints
    misfit: Misfit
    shifts: tuple[FloatArray, ...]


def judge_loads(
    points: LoadPoints, winding: WindingData, given: float | None, connection: Connection, pole_pairs: int | None
) -> JudgedLoads:
    """Return the loads that count; R_t is fitted where it is not `given` (Ω), and pole pairs are told from the readings where unknown."""
    seen = points.separated()
    terms = VoltageTerms.of(seen, winding, connection)
    read = [point for point, _, _ in seen]
    readings = LoadReadings(
        speed=_each(read, lambda p: p.speed.value or _NOTHING),
        frequency=_each(read, lambda p: p.electrical_frequency),
        voltage=terms.bus,
        current=_each(read, lambda p: p.bus_current.value or _NOTHING),
        torque=_each(read, lambda p: p.shaft_torque.value),
        supplied=np.array([six_step.supplied_average(line) for _, line, _ in seen]),
    )
    speed = meter_limits([p.speed for p in read], [0.0] * len(read))
    current, volts, torque = (
        meter_limits([a.reading for a in of], [a.scatter for a in of])
        for of in zip(*((p.bus_current, p.bus_voltage, p.shaft_torque) for p in read), strict=True)
    )
    line = MeterLimits(
        _each(read, lambda p: p.current_accuracy.gain),
        np.array([line.noise for _, line, _ in seen]) / readings.supplied,
    )
    judged = judge_speeds(readings, speed, pole_pairs)
    judged = judge_currents(readings, current, line, judged)
    # Every range of an oscilloscope has a gain of its own: how much they differ shows beside the current out of the source.
    ratio = (readings.supplied / readings.current)[list(judged.kept)]
    ranges = max(float(np.std(ratio, ddof=1)) if ratio.size > 1 else 0.0, _RANGES)
    magnets = np.array([float(winding.magnets_at(t).x) for _, _, t in seen])
    terms = replace(terms, speed=judged.speeds * magnets)
    design, voltage = terms.fitted(given)

    def switch() -> float:
        kept = list(judged.kept)
        return float(np.linalg.lstsq(design[kept], voltage[kept], rcond=None)[0][1]) if given is None else given

    fallen = terms.drops + switch() * terms.switched
    by_chance = (volts.chance**2 + speed.chance**2) * terms.bus**2 + (ranges * fallen) ** 2
    known = covariance(
        [
            winding.magnets_at(t) * float(v - f) + winding.resistance_at(t) * float(i) + winding.inductance * float(r)
            for (_, _, t), v, f, i, r in zip(seen, terms.bus, fallen, terms.mean_current, terms.rate, strict=True)
        ]
    )
    # Where R_t is given, leads between the voltmeter and the bridge are not in it.
    leads = terms.switched[None, :] if given is not None else np.empty((0, terms.bus.size))
    plane = VoltagePlane(design, voltage, known + np.diag(by_chance), leads)
    judged = judge_voltages(plane, readings, judged)
    both = MeterLimits(current.limit + volts.limit + speed.limit, np.hypot(current.chance, volts.chance))
    offset = max(p.shaft_torque.accuracy.offset for p in read)
    lost = np.array([_power_lost(line, t, winding, switch(), connection) for _, line, t in seen])
    judged = judge_powers(readings, lost, both, MeterLimits(torque.limit, torque.chance), offset, judged)
    return JudgedLoads(_counting(points, seen, judged), judged.misfit, judged.shifts)


def _counting(points: LoadPoints, seen: Seen, judged: LoadVerdict) -> LoadPoints:
    """Return the loads that count, with limits of error that hold what contradicts; those that could not be separated stay."""
    speeds = {id(point): float(judged.speeds[k]) for k, (point, _, _) in enumerate(seen) if k in judged.kept}
    kept = [
        (point, temperature)
        for point, temperature in zip(points.points, points.temperatures, strict=True)
        if point.line is None or id(point) in speeds
    ]
    return replace(
        points,
        points=tuple(_with_limits(point, speeds.get(id(point), point.speed.value), judged) for point, _ in kept),
        temperatures=tuple(temperature for _, temperature in kept),
    )


def _with_limits(point: LoadPoint, speed: float, judged: LoadVerdict) -> LoadPoint:
    return replace(
        point,
        speed=replace(widened(point.speed, gain=judged.speed), value=speed),
        bus_voltage=point.bus_voltage.widened(gain=judged.voltage),
        bus_current=point.bus_current.widened(gain=judged.current),
        current_accuracy=at_least(point.current_accuracy, gain=judged.current),
        shaft_torque=point.shaft_torque.widened(offset=judged.torque),
    )


def _each(points: Sequence[LoadPoint], of: Callable[[LoadPoint], float]) -> FloatArray:
    return np.array([of(point) for point in points])


def meter_limits(readings: Sequence[Reading], scatter: Sequence[float]) -> MeterLimits:
    """Return what was stated of readings, relative to them; `scatter` is the standard uncertainty of each from its repeats."""
    value = np.array([abs(each.value) or np.inf for each in readings])
    stated = [each.accuracy for each in readings]
    limit = np.array([a.gain for a in stated]) + np.array([a.offset for a in stated]) / value
    chance = [np.hypot(u, np.hypot(a.noise, _ROUNDED * a.resolution)) for u, a in zip(scatter, stated, strict=True)]
    return MeterLimits(limit, np.array(chance) / value)


def _power_lost(
    line: six_step.LineCurrent, temperature: UncertainReal, winding: WindingData, switch: float, connection: Connection
) -> float:
    """Return the power (W) that the windings, the switches and the freewheeling diode take."""
    state = six_step.conducting_state(line, connection)
    squares, idle = six_step.bridge_currents(line)
    copper = 3.0 * float(winding.resistance_at(temperature).x) * state.period_rms**2
    return copper + switch * squares + _DIODE * idle
