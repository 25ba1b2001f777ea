"""One record of a coast-down's or a driven ramp's file, and the parts of it that belong to one motion."""

from dataclasses import dataclass, replace

import numpy as np

from bench.analysis.applied import ErrorInput
from bench.analysis.pulse_times import at_middles, over_turns, pulse_intervals, with_missing_tooth
from bench.captures import CaptureChannel
from bench.captures.written_digits import FloatArray
from drivers.interfaces.text import Text, text
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.mechanics.release import driven_again, release_of, standstill_of
from procedures.estimation.mechanics.turning import SpeedRamp

#: What stands for the channel of a torque that no column has.
_GIVEN = "as given"


@dataclass(frozen=True)
class RampRecord:
    """One file: time (s), speed (rad/s), and the torque's channel, or the torque (N·m) where no column has it; `filters` are the time
    constants (s) of speed and torque.
    """

    time: FloatArray
    speed: CaptureChannel
    torque: CaptureChannel | float
    filters: tuple[float, float] = (0.0, 0.0)

    @property
    def torque_name(self) -> str:
        """The torque's name; empty for none."""
        return self.torque.name if isinstance(self.torque, CaptureChannel) else _GIVEN * bool(self.torque)

    def ramp(self, error: ErrorInput | None = None, by: float = 0.0) -> SpeedRamp:
        """Return the ramp as recorded, or off by an error at its limit times `by`."""
        torque = (
            self.torque.values if isinstance(self.torque, CaptureChannel) else np.asarray(self.torque, dtype=np.float64)
        )
        time, speed = self.time, self.speed.values
        if error is not None:
            time = error.on("time", "time", time, by)
            speed = error.on("speed", self.speed.name, speed, by)
            torque = error.on("torque", self.torque_name, torque, by)
        result = torque if torque.ndim else float(torque)
        return SpeedRamp(time, speed, result, self.speed.resolution, *self.filters)


def read_of_pulses(record: RampRecord) -> tuple[RampRecord, list[Text]]:
    """Return a record without a torque with its speeds at the times that they belong to, where they are means between pulses, and what is
    said of it.
    """
    found = pulse_intervals(record.time, record.speed.values)
    if found is None:
        return record, []
    count, angle = found
    said = text(
        "each speed of '{name}' is the mean over a time between pulses ({turns:.4g} of a turn): it is taken at the middle of that time, "
        "not where it is written",
        name=record.speed.name,
        turns=angle / (2.0 * np.pi),
    )
    turns = over_turns(record.time, record.speed.values, count, angle)
    if turns is not None:
        time, speeds = turns
        notes = [
            said,
            text("means over whole turns are evaluated, in which uneven distances between pulses and cogging drop out"),
        ]
        return replace(record, time=time, speed=replace(record.speed, values=speeds, resolution=0.0)), notes
    time, rows = at_middles(record.time, count)
    return replace(record, time=time, speed=replace(record.speed, values=record.speed.values[rows])), [said]


def with_each_tooth(record: RampRecord) -> tuple[RampRecord, list[Text]]:
    """Return a record of pulses with those of a tooth that is missing put in, and what is said of it."""
    found = with_missing_tooth(record.time, record.speed.values)
    if found is None:
        return record, []
    time, speeds, teeth = found
    said = text(
        "once a turn '{name}' is half of what it is before and after, as where one of {teeth} teeth is missing and the logger counts it: "
        "the interval there is taken for two teeth",
        name=record.speed.name,
        teeth=teeth,
    )
    return replace(record, time=time, speed=replace(record.speed, values=speeds)), [said]


def coasting(record: RampRecord) -> tuple[RampRecord, list[Text]]:
    """Return the part of a record without a torque in which the shaft coasts, and what is said of the rest.

    Raises EstimationError for a record with more than one coast-down.
    """
    speeds, time = record.speed.values, record.time
    again = driven_again(speeds)
    if again is not None:
        raise EstimationError(
            f"the shaft slows down and is driven again at about {time[again]:.4g} s: the record has more than one coast-down; take one "
            f"of them with --from and --to, as with --to {time[again]:.4g}"
        )
    first, after = release_of(time, speeds), standstill_of(speeds)
    notes = []
    if first:
        notes.append(
            text(
                "the coast-down begins at {begin:.6g} s: the part before, in which the speed was held or driven, "
                "is left out; --from sets another beginning",
                begin=time[first],
            )
        )
    if after < time.size:
        notes.append(
            text(
                "the reading is constant from {end:.6g} s on, because the shaft or its sensor has stopped: this "
                "part is left out; --to sets another end",
                end=time[after],
            )
        )
    if not notes or after - first < 2:
        return record, []
    part = slice(first, after)
    return replace(record, time=time[part], speed=replace(record.speed, values=speeds[part])), notes


def split(ramp: SpeedRamp) -> list[SpeedRamp]:
    """Part a record with a torque column where the drive lets go: before it a driven ramp, after it a coast-down."""
    torque = np.asarray(ramp.torque, dtype=np.float64)
    if torque.ndim == 0:
        return [ramp]
    level = float(np.median(np.abs(torque[np.abs(torque) > 0.5 * np.max(np.abs(torque))]))) if np.any(torque) else 0.0
    driving = np.abs(torque) > 0.5 * level
    last = np.flatnonzero(driving)
    if level == 0 or not last.size or last[-1] >= torque.size - 8 or last[-1] < 8:
        return [ramp]
    # The samples around the change belong to neither.
    end, begin = int(last[-1]), int(last[-1]) + 2
    rest = torque[begin:]
    quiet = float(np.mean(np.abs(rest))) < 0.1 * level
    parts = [(slice(0, end), torque[:end]), (slice(begin, None), np.zeros(rest.size) if quiet else rest)]
    return [replace(ramp, time=ramp.time[s], speed=ramp.speed[s], torque=t) for s, t in parts]
