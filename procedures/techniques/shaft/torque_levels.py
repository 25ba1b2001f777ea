"""Shaft torque at levels of the inverter's current, read once no filter of the transducer lags behind them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import Accuracy, InverterAbility
from drivers.interfaces.text import text
from procedures.core.bench import ProcedureError
from procedures.estimation.fitting.fit import Fit
from procedures.estimation.fitting.misfit import ALARM
from procedures.estimation.fitting.noise import undithered
from procedures.estimation.mechanics.torque_constant import (
    InducedConstant,
    drift_within_levels,
    fit_torque_constant,
    induced_constant,
)
from procedures.techniques.shaft.driven_shaft import check_held
from procedures.techniques.shaft.shaft_readings import ShaftReadings

#: Waits before the readings of a level that are tried one after the other, in units of the first.
_LONGER = (1.0, 4.0, 16.0)
#: The first level is waited for so many times longer: the shaft has just been run up, and the current comes from nothing.
_AT_FIRST = 10.0
#: Readings are this much of their interval apart, least and most.
_UNEVEN = (0.5, 1.5)
#: Where the torque still moves by less than this share of a step, the level before it has been forgotten.
_LEFT = 0.02
#: Share of what a moving zero does to the slope by which a course that bends may leave the straight line between its two ends.
_BEND = 0.25


@dataclass(frozen=True)
class MovedZero:
    """What the torque's zero moved by (N·m) in a `time` (s) while the levels were taken, with its standard `uncertainty`.

    It is taken out already; `left` (N·m/A) is the half-width of what may be left of it in the slope over the current.
    """

    moved: float
    uncertainty: float
    time: float
    left: float


@dataclass(frozen=True)
class TorqueLevels:
    """Current (A, peak) and the motor's torque on the shaft (N·m), both of shape (levels, readings), and their accuracies.

    `settling` (s) is how long each level was waited for. `voltages` (V, peak, d + j·q, of that shape) are the inverter's, with their
    accuracy, where it tells them, and `speeds` (rad/s) the shaft's; `times` (s, of that shape) when they were read, and `zero` is how the
    torque's zero moved meanwhile, None where it stayed.
    """

    currents: NDArray[np.float64]
    torques: NDArray[np.float64]
    current_accuracy: Accuracy
    torque_accuracy: Accuracy
    settling: float
    speeds: NDArray[np.float64]
    voltages: NDArray[np.complex128] | None
    voltage_accuracy: Accuracy
    speed_accuracy: Accuracy
    times: NDArray[np.float64]
    zero: MovedZero | None = None

    def induced(self) -> InducedConstant | None:
        """Return the torque constant (N·m/A) that the voltage at no current tells, None where the inverter tells no voltages."""
        return None if self.voltages is None else induced_constant(self.currents, self.voltages, self.speeds)

    def fit(self) -> Fit:
        """Fit torque over current, a point a level: readings of one level share what rounding leaves of them."""
        steps = self.torque_accuracy.resolution, self.current_accuracy.resolution
        torque, current = (
            undithered(max(float(np.std(values - values.mean(axis=1)[:, None])), step / math.sqrt(12.0)), step)
            for values, step in zip((self.torques, self.currents), steps, strict=True)
        )
        levels = self.currents.mean(axis=1), self.torques.mean(axis=1)
        slope = fit_torque_constant(*levels).value("torque_constant")
        # A step of the current is one of the torque that it makes.
        return fit_torque_constant(*levels, torque_resolution=math.sqrt(12.0) * math.hypot(torque, slope * current))


def torque_at_levels(
    shaft: ShaftReadings, levels: Sequence[float], readings: int, interval: float, settling: float, *, speed: float
) -> TorqueLevels:
    """Return readings about `interval` (s) apart at each current (A), `settling` (s) after it was set, or longer where the torque lags.

    The `speed` (rad/s) of the `shaft` and a current are driven already; levels follow one another in even steps. Where a little of a lag
    is left, the first is left out.
    Raises ProcedureError where the torque lags however long it is waited for, or the speed is not held.
    """
    for share in _LONGER:
        taken = _taken(shaft, levels, readings, interval, share * settling, speed)
        if shaft.bench.dynamometer.read_by_hand:
            return taken
        taken = _with_zero(taken, _taken(shaft, levels[:1], readings, interval, share * settling, speed))
        drift = drift_within_levels(taken.torques, taken.torque_accuracy.resolution)
        if not drift:
            return taken
    if abs(drift) < _LEFT * abs(float(np.mean(np.diff(taken.torques.mean(axis=1))))):
        # Alike at all levels but the first, it is an offset of the others.
        return replace(
            taken,
            currents=taken.currents[1:],
            torques=taken.torques[1:],
            speeds=taken.speeds[1:],
            times=taken.times[1:],
            voltages=None if taken.voltages is None else taken.voltages[1:],
        )
    raise ProcedureError(
        text(
            "the torque still changes {settling:g} s after a current was set, as behind a slow filter: shorten the torque transducer's "
            "filter, or set settling to more than five of its time constants",
            settling=taken.settling,
        )
    )


def _taken(
    shaft: ShaftReadings, levels: Sequence[float], readings: int, interval: float, settling: float, speed: float
) -> TorqueLevels:
    bench = shaft.bench
    shape = len(levels), readings
    currents, torques, speeds, times = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
    voltages = np.empty(shape, complex) if InverterAbility.VOLTAGES in bench.inverter.abilities else None
    # At even intervals, cogging and the ripple of the current's torque would show the same few angles again and again: a ripple that
    # grows with the current is then a slope. Any fixed sequence that is not periodic does.
    waits = interval * np.random.default_rng(1).uniform(*_UNEVEN, shape)
    torque_accuracy = current_accuracy = voltage_accuracy = speed_accuracy = Accuracy()
    for place, level in enumerate(levels):
        bench.inverter.set_current(float(level))
        bench.clock.sleep(settling if place else _AT_FIRST * settling)
        for number in range(readings):
            bench.clock.sleep(float(waits[place, number]))
            read = shaft.measure()
            check_held(bench, [read], speed)
            # What the dynamometer puts on the shaft, the motor takes off.
            torques[place, number], speeds[place, number] = -read.torque, read.speed
            times[place, number] = bench.clock.now()
            torque_accuracy, speed_accuracy = read.torque_accuracy, read.speed_accuracy
            if voltages is None:
                current = bench.inverter.measure_current()
                currents[place, number], current_accuracy = current.value, current.accuracy
            else:
                told = bench.inverter.measure_dq()
                currents[place, number], current_accuracy = told.q_current, told.current_accuracy
                voltages[place, number] = complex(told.d_voltage, told.q_voltage)
                voltage_accuracy = told.voltage_accuracy
    return TorqueLevels(
        currents, torques, current_accuracy, torque_accuracy, settling, speeds, voltages, voltage_accuracy,
        speed_accuracy, times,
    )  # fmt: skip


def _with_zero(taken: TorqueLevels, again: TorqueLevels) -> TorqueLevels:
    """Return levels without what the torque's zero moved by from their first one to the same one `again`: over levels that rise all the
    time it would be a slope.
    """
    current, torque = taken.currents.mean(axis=1), taken.torques.mean(axis=1)
    if np.ptp(current) <= 1e-9 * float(np.max(np.abs(current))) or taken.torques.shape[1] < 2:
        # Nothing is made of such readings, and the procedure says so.
        return taken
    slope = fit_torque_constant(current, torque).value("torque_constant")
    first, then = (each.torques[0] - slope * each.currents[0] for each in (taken, again))
    moved = float(then.mean() - first.mean())
    step = math.hypot(taken.torque_accuracy.resolution, slope * taken.current_accuracy.resolution)
    uncertainty = math.sqrt((np.var(first, ddof=1) + np.var(then, ddof=1)) / first.size + step**2 / 6.0)
    if abs(moved) <= ALARM * uncertainty:
        return taken
    time = float(again.times.mean() - taken.times[0].mean())
    course = (taken.times - float(taken.times.mean())) / time
    # Per unit of what moved.
    lever = fit_torque_constant(current, course.mean(axis=1)).value("torque_constant")
    zero = MovedZero(moved, uncertainty, time, abs(lever) * (_BEND * abs(moved) + 2.0 * uncertainty))
    return replace(taken, torques=taken.torques - moved * course, zero=zero)
