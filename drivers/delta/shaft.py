"""The shaft as the transducer shows it: zeroed torque, speed with a sign, power on a scale that was checked."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from drivers.delta.dyn200 import RPM, Dyn200, ShaftReading
from drivers.delta.options import DeltaDyn200Options
from drivers.delta.transducer_scales import PowerScale, SpeedScale
from drivers.interfaces import Accuracy, Clock, DynamometerReading, ReportedError, polls

#: Share of full scale that is the limit of error of strain-gauge transducers of this class.
TORQUE_SHARE = 1e-3
TORQUE_SOURCE = "0.1 % of full scale, typical of its class; enter the transducer's calibration"
SPEED_SOURCE = "one digit, typical of its class; enter the transducer's calibration"
#: A shaft slower than this (rad/s) is at rest.
REST_SPEED = 0.5 * RPM
#: After a zero the torque must be there within this time (s): its filter lags.
_ZERO_TIME = 1.0
#: Counts that a zeroed torque may show, and readings that a tare of our own is the mean of.
_ZERO_COUNTS, _TARE_READINGS = 3, 10
#: Consecutive readings that must agree before a speed counts as settled.
SETTLED_READINGS = 3
#: So many show that a speed is held whose reading ripples, as that of a sensor out of centre does.
RIPPLING_READINGS = 40
#: Readings of so few different values, so many counts apart, are steps of the sensor and no ripple.
_FEW_LEVELS, _COARSE_COUNTS = 5, 10.0


@dataclass(frozen=True)
class TransducerReading:
    """Torque (N·m), speed (rad/s, with its sign where that is known) and power (W) at one time."""

    torque: float
    speed: float
    power: float
    direction_known: bool


class Transducer:
    """A DYN-200 in the shaft; `name` stands for the instrument in messages."""

    def __init__(self, sensor: Dyn200, clock: Clock, options: DeltaDyn200Options, name: str) -> None:
        self._sensor = sensor
        self._clock = clock
        self._options = options
        self._power = PowerScale(name, options.power_step)
        self._tare = 0.0
        self._tared_here = False
        #: +1 or −1: what the drive was told to turn it to; None: whatever turns it, nobody told.
        self.heading: int | None = None
        self.speed_scale = SpeedScale(name, sensor.speed_decimals)

    @property
    def speed_resolution(self) -> float:
        """One count of the speed (rad/s)."""
        return self._sensor.speed_resolution

    @property
    def speed_accuracy(self) -> Accuracy:
        """Limits of error of a speed (rad/s)."""
        count = self._sensor.speed_resolution
        return _as_shown(self._options.speed_accuracy, count) or Accuracy(
            offset=count, resolution=count, source=SPEED_SOURCE
        )

    @property
    def torque_accuracy(self) -> Accuracy:
        """Limits of error of a torque (N·m)."""
        count = self._sensor.torque_resolution
        stated = _as_shown(self._options.torque_accuracy, count) or Accuracy(
            offset=TORQUE_SHARE * self._full_scale, resolution=count, source=TORQUE_SOURCE
        )
        return replace(stated, source=f"{stated.source}; zeroed by subtraction here") if self._tared_here else stated

    def speed(self) -> float:
        """Return the magnitude of the speed (rad/s)."""
        return self._sensor.read().speed

    def read(self) -> TransducerReading:
        """Return one reading; raises MeasurementError where the registers contradict each other."""
        shown = self._sensor.read()
        power = self._power.watts(shown)
        if shown.speed == 0:
            return TransducerReading(shown.torque - self._tare, 0.0, 0.0, direction_known=True)
        sign = self._sign(shown)
        speed, torque = (sign or 1) * shown.speed, shown.torque - self._tare
        # The register knows nothing of a tare made here.
        signed = math.copysign(power, shown.torque * speed) - self._tare * speed
        return TransducerReading(torque, speed, signed, sign is not None)

    def as_reading(self, shaft: TransducerReading, time: float) -> DynamometerReading:
        """Return what was read at a time (s) with its accuracy, which says where the direction is not known."""
        accuracy = self.speed_accuracy
        if not shaft.direction_known:
            accuracy = replace(accuracy, source=f"{accuracy.source}; direction not known")
        filters = self._options.speed_filter, self._options.torque_filter
        return DynamometerReading(
            time, shaft.speed, shaft.torque, shaft.power, accuracy, self.torque_accuracy, *filters
        )

    def has_settled(self, last: Sequence[float], wanted: float) -> bool:
        """Say whether consecutive speeds (rad/s) agree with each other and with the one wanted: the latest, or the means of two halves."""
        tolerance = abs(wanted) * self._options.speed_tolerance + REST_SPEED
        agreement = abs(wanted) * self._options.speed_stability + 2 * self.speed_resolution
        latest = last[-SETTLED_READINGS:]
        if all(abs(found - wanted) <= tolerance for found in latest) and max(latest) - min(latest) <= agreement:
            return len(latest) == SETTLED_READINGS
        half = RIPPLING_READINGS // 2
        return (
            len(last) == RIPPLING_READINGS
            and all(abs(found - wanted) <= tolerance for found in last)
            and abs(sum(last[:half]) - sum(last[half:])) <= agreement * half
        )

    def step_about(self, last: Sequence[float], wanted: float) -> float | None:
        """Return the step (rad/s) of speeds that are a few whole steps on either side of the one wanted; None where they are none."""
        levels = sorted(set(last))
        if (
            len(last) < RIPPLING_READINGS
            or not 2 <= len(levels) <= _FEW_LEVELS
            or not levels[0] <= wanted <= levels[-1]
        ):
            return None
        gaps = [above - below for below, above in itertools.pairwise(levels)]
        step, count = min(gaps), self.speed_resolution
        whole = all(abs(gap / step - round(gap / step)) * step <= 2.0 * count for gap in gaps)
        return step if whole and step > _COARSE_COUNTS * count else None

    def zero(self) -> None:
        """Take the present torque as zero: by the sensor, read back, else by subtracting it from now on."""
        for ask in (self._sensor.zero_by_coil, self._sensor.zero_by_register):
            try:
                ask()
            except ReportedError:
                continue
            if self._is_zero():
                self._tare, self._tared_here = 0.0, False
                return
        self._tare, self._tared_here = self._mean(), True

    @property
    def _full_scale(self) -> float:
        return self._options.transducer_range or self._options.rated_torque

    def _sign(self, shown: ShaftReading) -> int | None:
        if self._options.direction_from == "power" and shown.torque and shown.power_counts:
            return 1 if (shown.torque > 0) == (shown.power_counts > 0) else -1
        return self.heading

    def _is_zero(self) -> bool:
        band = max(_ZERO_COUNTS * self._sensor.torque_resolution, TORQUE_SHARE * self._full_scale)
        for last in polls(self._clock, _ZERO_TIME, self._options.settle_interval):
            if abs(self._sensor.read().torque) <= band:
                return True
            if last:
                break
        return False

    def _mean(self) -> float:
        total = 0.0
        for _ in range(_TARE_READINGS):
            total += self._sensor.read().torque
            self._clock.sleep(self._options.settle_interval)
        return total / _TARE_READINGS


def _as_shown(stated: Accuracy | None, count: float) -> Accuracy | None:
    """Return the station's own statement; no step of a reading is finer than the last digit that the sensor sends."""
    return stated and replace(stated, resolution=max(stated.resolution, count))
