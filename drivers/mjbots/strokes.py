"""Strokes of a moteus: one current vector after the other, each commanded and what was before it read in one frame."""

import math
from collections.abc import Iterator, Mapping

from drivers.bases.set_points import check_setpoint
from drivers.interfaces import Clock, DqSample
from drivers.interfaces.text import text
from drivers.mjbots.power_stage import MoteusPowerStage
from drivers.mjbots.readings import MoteusReadings
from drivers.mjbots.registers import Register

#: How long (s) a stroke may be: frames take their time, and nobody looks at limits between them. Of so many at most.
_SHORTEST, _LONGEST, _FEWEST, _MOST = 1.0e-3, 0.5, 3, 99
#: A stroke lasts at least this share of its time, whenever the one before began.
_LEAST_OF_ONE = 0.95


def check_strokes(name: str, duration: float, strokes: int) -> None:
    """Raise SetpointError for a duration (s) or a number that cannot be."""
    whose = text("the driver")
    check_setpoint(name, text("duration"), duration, "s", _SHORTEST, _LONGEST, whose)
    check_setpoint(name, text("strokes"), strokes, "", _FEWEST, _MOST, whose)


def alternating(
    power: MoteusPowerStage,
    readings: MoteusReadings,
    clock: Clock,
    vectors: tuple[complex, complex],
    duration: float,
    strokes: int,
) -> Iterator[DqSample]:
    """Alternate between two current vectors (A, d + j·q), an odd number of strokes, then none; yield what the interface says.

    Raises ReportedError where the drive does not regulate any more.
    """
    zero = readings.angle()
    first = power.sample()[Register.POSITION]

    def sample(state: Mapping[int, float]) -> DqSample:
        return DqSample(
            clock.now(),
            state[Register.D_CURRENT],
            state[Register.Q_CURRENT],
            zero + readings.electrical_angle(state[Register.POSITION] - first),
            2.0 * math.pi * readings.frequency(state),
        )

    count = strokes + 1 - strokes % 2
    begin = answered = clock.now()
    for number in range(count + 1):
        # From the first one on, not from the last: what a bus takes must not add up. A late reply shortens none.
        due = begin + duration * min(max(number - 0.5, 0.0), count - 1.0)
        lasts = duration * (0.5 if number in (1, count) else 1.0) if number else 0.0
        clock.sleep(max(due - clock.now(), answered + _LEAST_OF_ONE * lasts - clock.now(), 0.0))
        wanted = vectors[number % 2] if number < count else 0j
        state = power.sampled_command(wanted.real, wanted.imag)
        answered = clock.now()
        yield sample(state)
    clock.sleep(duration)
    yield sample(power.sample())
