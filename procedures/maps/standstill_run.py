"""The strokes of a map at standstill: as long as the currents take, and no longer than the rotor stays quiet."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import stdev

from drivers.interfaces.text import Text
from procedures.core.bench import Bench
from procedures.estimation.flux.stroke_train import StrokeTrain
from procedures.techniques.maps.stroke_records import StrokePlan, StrokeRecorder

#: A stroke lasts too short where its first half leaves more than this share of the current, and longer than it need below the second.
_UNSETTLED, _SETTLED = 0.01, 0.001
_LONGER, _SHORTER = 1.5, 0.85
#: What a standing rotor's voltages have not settled by counts so many times: it is taken as lasting all of a stroke.
_WEIGHTY = 3.0
#: So many samples without current tell the noise of the drive's currents; a difference of two is told from it beyond so many deviations.
_IDLE, _CLEAR = 8, 5.0
#: A rotor counts as standing where it turns less than this (rad, electrical) in a stroke; it is waited for so long (s), looked at so often.
_STANDS, _PATIENCE, _LOOK = 0.003, 5.0, 0.05
#: A current's torque per q current grows by less than this factor to the next location's.
_MORE = 1.3


@dataclass(frozen=True)
class StrokePace:
    """The timing of strokes: `strokes` in a train, `shortest` and `longest` (s) of one, `quiet` (rad, electrical) that the rotor
    may swing by, `rest` (s) between trains; above `rated_current` (A) the motor rests until the mean square is the rated one's.
    """

    strokes: int
    shortest: float
    longest: float
    quiet: float
    rest: float
    rated_current: float


@dataclass
class TakenStrokes:
    """Trains of strokes in the order of their locations, the locations (A) that were left out, by why, and why it ended early.

    `voltage_gain` (relative) is the limit of the gain of the trains' voltages.
    """

    trains: list[StrokeTrain] = field(default_factory=list)
    too_light: list[complex] = field(default_factory=list)
    too_slow: list[complex] = field(default_factory=list)
    duration: float = 0.0
    voltage_gain: float = 0.0
    ended: Text | None = None

    @property
    def swing(self) -> float:
        """The largest swing (rad, electrical) of the rotor."""
        return max((train.swing for train in self.trains), default=0.0)


def take_strokes(
    bench: Bench,
    recorder: StrokeRecorder,
    locations: Sequence[complex],
    pace: StrokePace,
    progress: Callable[[TakenStrokes, int], None],
    kept: Callable[[], None],
    taken: TakenStrokes,
) -> None:
    """Put trains at locations (A, i_q ≥ 0, the smallest first) into `taken` while the inverter regulates: between ± i_q, along d ± i_d.

    A location whose torque would swing the rotor by more than what is quiet is left out. `kept` is called for each train that counts.
    """
    taken.duration = pace.shortest
    turning, noise = 0.0, _CLEAR * _noise(bench)
    for number, location in enumerate(locations):
        other = location.conjugate() if location.imag else -location
        train = None
        while train is None and taken.duration <= pace.longest:
            if _MORE * turning * abs(location.imag) * taken.duration**2 > pace.quiet:
                break
            train = recorder.take(StrokePlan(location, other, taken.duration, pace.strokes))
            _rest(bench, location, taken.duration, pace)
            unsettled = max(abs(train.current[1] - train.current[3]) - noise, 0.0) / abs(location)
            if train.still:
                unsettled = max(unsettled, _WEIGHTY * train.moving)
            missed = max(unsettled, (abs(train.current[1] - location) - noise) / abs(location) - _UNSETTLED)
            if location.imag:
                turning = max(turning, train.swing / (abs(location.imag) * taken.duration**2))
            if missed > _UNSETTLED:
                taken.duration *= _LONGER
                train = None
            elif unsettled < _SETTLED:
                taken.duration = max(taken.duration * _SHORTER, pace.shortest)
        if train is None or train.swing > pace.quiet * _LONGER:
            slow = taken.duration > pace.longest
            taken.duration = min(taken.duration, pace.longest)
            (taken.too_slow if slow else taken.too_light).append(location)
        else:
            taken.trains.append(train)
            taken.voltage_gain = recorder.accuracy
            kept()
        progress(taken, len(locations) - number - 1)


def _noise(bench: Bench) -> float:
    """Return the standard deviation (A) of a difference of two currents that the drive says."""
    taken = [bench.inverter.measure_dq() for _ in range(_IDLE)]
    return math.hypot(
        *(stdev(values) for values in ([each.d_current for each in taken], [each.q_current for each in taken]))
    )


def _rest(bench: Bench, location: complex, duration: float, pace: StrokePace) -> None:
    """Let the motor cool and the rotor come to rest."""
    hot = max((abs(location) / pace.rated_current) ** 2 - 1.0, 0.0)
    bench.clock.sleep(pace.rest + hot * duration * (pace.strokes - 1))
    end = bench.clock.now() + _PATIENCE
    while bench.clock.now() < end and abs(bench.inverter.measure_dq().electrical_speed) * duration > _STANDS:
        bench.clock.sleep(_LOOK)
