"""Ramps of a shaft's speed: driven by the dynamometer's torque, and coasting (§3.5)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interfaces import Accuracy, DynamometerReading
from drivers.interfaces.text import text
from procedures.core.bench import Bench, ProcedureError
from procedures.core.nameplate import Nameplate
from procedures.core.procedure_error import MotorFaultError
from procedures.core.settings import Settings
from procedures.estimation.mechanics.inertia import torque_from_power
from procedures.estimation.mechanics.ramp_torque import torque_runout
from procedures.estimation.mechanics.turning import SpeedRamp
from procedures.techniques.shaft.driven_shaft import driving_speed_rad
from procedures.techniques.shaft.plots import coast_plot, ramp_plot
from procedures.techniques.shaft.shaft_readings import ShaftReadings
from procedures.techniques.shaft.torque_zero import TorqueZero, ZeroLine, read_zero

#: Share of the dynamometer's torque at which the search for the ramp's torque begins.
_SMALLEST_TORQUE = 0.002
#: The ramp may be this much slower or faster than asked for, and the search for it halves its step this often.
_PACES = (0.7, 2.0)
_HALVINGS = 4
#: A ramp ends at this share of the dynamometer's largest speed: where its drive limits the speed, the torque is no longer the set one.
_BELOW_LIMIT = 0.95
#: A shaft that has less than this share of its speed stands: one that is only heavy, or stiff, turns.
_HELD = 0.01
#: Fewer readings on a ramp do not fix three parameters.
_FEWEST = 10
#: Longest time constant (s) of a sensor's filter.
_LONGEST_FILTER = 5.0
_COAST = text("Coast-down")


class TorqueSource(Enum):
    """The source of the accelerating torque."""

    MEASURED = "measured"
    POWER = "power"


class RampSettings(Settings):
    """Settings for driving and reading the ramps."""

    speed_share: float = Field(
        default=0.8, gt=0.0, le=1.0, description="speed at the end of the ramp, share of the rated speed"
    )
    ramp_time: float = Field(default=1.0, gt=0.05, le=120.0, description="time aimed at for the driven ramp, s")
    coast_share: float = Field(
        default=0.2, gt=0.02, lt=1.0, description="the coast-down is recorded down to this share of the top speed"
    )
    longest_coast: float = Field(default=60.0, gt=0.1, le=3600.0, description="longest time of the coast-down, s")
    settling: float = Field(
        default=0.05,
        ge=0.0,
        le=5.0,
        description="readings within this time after the torque is switched are left out, because of the transducer's filter, "
        "s",
    )
    speed_filter: float | None = Field(
        default=None,
        ge=0.0,
        le=_LONGEST_FILTER,
        description="time constant of the speed signal's first-order filter, s; as the station states it when not given",
    )
    torque_filter: float | None = Field(
        default=None,
        ge=0.0,
        le=_LONGEST_FILTER,
        description="time constant of the torque signal's first-order filter, s; as the station states it when not given",
    )
    sample_interval: float = Field(default=0.004, gt=0.0, le=1.0, description="time between readings, s")
    zero_rest: float = Field(
        default=2.0,
        ge=0.0,
        le=60.0,
        description="wait before the torque's zero is read, until a filter has settled, s",
    )
    torque: float | None = Field(
        default=None, gt=0.0, description="accelerating torque, N·m; found by trial when not given"
    )
    torque_source: TorqueSource = Field(
        default=TorqueSource.MEASURED, description="torque as measured, or from shaft power and speed"
    )


@dataclass(frozen=True)
class Curve:
    """One ramp: time (s) from its first reading, speed (rad/s) and torque (N·m), each of shape (n,), the readings' accuracies and filters
    (s); `begin` is the first reading's bench time (s), `zero` the torque's at rest beside the ramp.
    """

    begin: float
    zero: TorqueZero
    time: NDArray[np.float64]
    speed: NDArray[np.float64]
    torque: NDArray[np.float64]
    torque_accuracy: Accuracy
    speed_accuracy: Accuracy
    speed_filter: float
    torque_filter: float


@dataclass(frozen=True)
class Ramps:
    """A driven ramp, its torque freed of the `zero` that was read before it and after the coast, and that coast."""

    driven: Curve
    coast: Curve
    zero: ZeroLine

    @classmethod
    def freed(cls, driven: Curve, coast: Curve) -> "Ramps":
        """Take the zero off a driven ramp as it was read."""
        turning = torque_runout(driven.torque, driven.time, driven.speed)
        zero = ZeroLine(driven.zero, coast.zero, turning)
        return cls(replace(driven, torque=driven.torque - zero.at(driven.begin + driven.time)), coast, zero)

    def to_fit(self) -> list[SpeedRamp]:
        """Return both ramps, the driven one first, as the estimator takes them; nothing drives the coast."""

        def taken(curve: Curve, torque: float | NDArray[np.float64]) -> SpeedRamp:
            resolution = curve.speed_accuracy.resolution
            return SpeedRamp(curve.time, curve.speed, torque, resolution, curve.speed_filter, curve.torque_filter)

        return [taken(self.driven, self.driven.torque), taken(self.coast, 0.0)]


class ShortCoastError(ProcedureError):
    """A coast that was over after too few readings; `last` is the last of them, the first below the share of speed that it goes to."""

    def __init__(self, count: int, fewest: int, last: DynamometerReading, time: float) -> None:
        super().__init__(
            text(
                "the shaft is already slow {time:.2g} s after the torque was removed, which leaves {n} readings "
                "of the coast-down, but {fewest} are needed: something brakes it hard, or its inertia is small; "
                "shorten sample_interval and settling",
                time=time,
                n=count,
                fewest=fewest,
            )
        )
        self.last = last


def ramp_top(bench: Bench, nameplate: Nameplate, share: float) -> float:
    """Return the speed (rad/s) at which a driven ramp ends: a share of the rated one, as far as motor and dynamometer allow."""
    return min(driving_speed_rad(bench, nameplate, share), _BELOW_LIMIT * bench.dynamometer.maximum_speed)


class RampRecorder:
    """Drives the coupled shaft by the dynamometer's torque, lets it coast, and reads both ramps.

    Where the dynamometer `turned_alone` before, a shaft that stands still is held by the motor (MotorFaultError).
    """

    def __init__(self, bench: Bench, settings: RampSettings, *, turned_alone: bool = False) -> None:
        self._bench, self._settings, self._turned_alone = bench, settings, turned_alone

    def accelerate(self, top: float) -> Curve:
        """Return the driven ramp, up to `top` (rad/s)."""
        dynamometer, clock = self._bench.dynamometer, self._bench.clock
        torque = self._settings.torque or self._find_torque(top)
        zero = read_zero(self._bench, self._settings.sample_interval, self._settings.zero_rest)
        deadline = clock.now() + 20.0 * self._settings.ramp_time
        readings: list[DynamometerReading] = []
        with dynamometer.driving_torque(torque):
            switched = clock.now()
            self._bench.show(lambda: ramp_plot(text("Driven ramp"), switched, top))
            while not readings or readings[-1].speed < top:
                if clock.now() > deadline:
                    self._check_held(torque, readings[-1].speed / top)
                    raise ProcedureError(
                        text(
                            "{torque:.3g} N·m brought the shaft only to {speed:.0f} rpm, but {top:.0f} rpm are "
                            "needed: something brakes it, or the torque is too small",
                            torque=torque,
                            speed=readings[-1].speed * 30.0 / math.pi,
                            top=top * 30.0 / math.pi,
                        )
                    )
                readings.append(dynamometer.measure())
                clock.sleep(self._settings.sample_interval)
        return self._curve(readings, switched, zero)

    def coast(self, top: float) -> Curve:
        """Return the coast down from `top` (rad/s), then stop the shaft."""
        dynamometer, clock = self._bench.dynamometer, self._bench.clock
        switched = clock.now()
        deadline = switched + self._settings.longest_coast
        self._bench.show(lambda: ramp_plot(_COAST, switched, self._settings.coast_share * top))
        readings: list[DynamometerReading] = []
        while clock.now() < deadline and not _is_slow(readings, self._settings.coast_share * top):
            readings.append(dynamometer.measure())
            clock.sleep(self._settings.sample_interval)
        dynamometer.stop()
        time = np.array([r.time for r in readings]) - switched
        self._bench.show(lambda: coast_plot(_COAST, time, np.array([r.speed for r in readings])))
        kept = sum(r.time >= switched + self._settings.settling for r in readings)
        if kept < _FEWEST and readings[-1].speed <= self._settings.coast_share * top:
            raise ShortCoastError(kept, _FEWEST, readings[-1], time[-1])
        return self._curve(
            readings, switched, read_zero(self._bench, self._settings.sample_interval, self._settings.zero_rest)
        )

    def _find_torque(self, top: float) -> float:
        """Return a torque (N·m) that reaches `top` (rad/s) in about the ramp time, from short trials."""
        largest = self._bench.dynamometer.maximum_torque
        torque, too_little = _SMALLEST_TORQUE * largest, 0.0
        while (pace := self._pace(torque, top)) < _PACES[0]:
            if torque >= largest:
                self._check_held(torque, pace)
                raise ProcedureError(
                    text(
                        "the dynamometer's full torque of {torque:.3g} N·m does not bring the shaft to speed; is the rotor free?",
                        torque=torque,
                    )
                )
            torque, too_little = min(1.5 * torque, largest), torque
        for _ in range(_HALVINGS):
            if pace <= _PACES[1]:
                break
            between = 0.5 * (torque + too_little)
            if (slower := self._pace(between, top)) < _PACES[0]:
                too_little = between
            else:
                torque, pace = between, slower
        return torque

    def _check_held(self, torque: float, share: float) -> None:
        """Raise MotorFaultError where the motor holds the shaft: `share` is how much of the wanted speed this torque (N·m) gave it."""
        if self._turned_alone and share < _HELD:
            raise MotorFaultError(
                text(
                    "the dynamometer turns when uncoupled, but with {torque:.3g} N·m it does not turn the motor: "
                    "the motor's bearing is seized, the coupling is jammed, or the rotor is still locked",
                    torque=torque,
                ),
                "bearing",
            )

    def _pace(self, torque: float, top: float) -> float:
        """Return how many times faster than asked for this torque (N·m) would bring the shaft to `top`."""
        dynamometer, trial = self._bench.dynamometer, 0.1 * self._settings.ramp_time
        # Against a large friction the torque above it is left to the inertia alone: the drive itself keeps the speed down.
        with dynamometer.driving_torque(torque, min(1.05 * top, dynamometer.maximum_speed)):
            self._bench.clock.sleep(trial)
            reached = ShaftReadings(self._bench).measure().speed
        dynamometer.stop()
        return reached * self._settings.ramp_time / (trial * top)

    def _curve(self, readings: list[DynamometerReading], switched: float, zero: TorqueZero) -> Curve:
        readings = [r for r in readings if r.time >= switched + self._settings.settling]
        if len(readings) < _FEWEST:
            raise ProcedureError(
                text(
                    "the ramp has {n} readings only, {fewest} are needed; lengthen ramp_time or shorten sample_interval",
                    n=len(readings),
                    fewest=_FEWEST,
                )
            )
        by_power = self._settings.torque_source is TorqueSource.POWER
        speed = np.array([r.speed for r in readings])
        if by_power:
            torque = np.full_like(speed, torque_from_power([r.power for r in readings], speed))
        else:
            torque = np.array([r.torque for r in readings])
        time = np.array([r.time for r in readings])
        last, settings = readings[-1], self._settings
        return Curve(
            float(time[0]),
            zero,
            time - time[0],
            speed,
            torque,
            last.torque_accuracy,
            last.speed_accuracy,
            _within_reach("speed_filter", last.speed_filter)
            if settings.speed_filter is None
            else settings.speed_filter,
            _within_reach("torque_filter", last.torque_filter)
            if settings.torque_filter is None
            else settings.torque_filter,
        )


def _within_reach(key: str, stated: float) -> float:
    """Return a filter's time constant (s) as the station states it. Raises ProcedureError for one that no sensor has."""
    if not 0.0 <= stated <= _LONGEST_FILTER:
        raise ProcedureError(
            text(
                "the station file's dynamometer: {key} = {stated:g} s; allowed is 0 … {longest:g} s",
                key=key,
                stated=stated,
                longest=_LONGEST_FILTER,
            )
        )
    return stated


def _is_slow(readings: Sequence[DynamometerReading], limit: float) -> bool:
    """Return whether a coast has come down to a speed (rad/s): one reading far below the one before may be the sensor's."""
    if len(readings) < 2 or readings[-1].speed > limit:
        return False
    before, last = (each.speed for each in readings[-2:])
    return before <= limit or last > 0.5 * before
