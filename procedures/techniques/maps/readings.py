"""Readings of a motor in the rotor's frame at planned currents, while the dynamometer holds the speed."""

import math
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import DqReading, DynamometerReading
from drivers.interfaces.errors import LimitError, MeasurementError, ReportedError
from drivers.interfaces.text import Text, text
from procedures.core.bench import Bench
from procedures.core.nameplate import Nameplate
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.flux.plan import PlannedReading
from procedures.techniques.shaft.driven_shaft import holds, overspeed

#: After so many of its time constants a transducer's filter has forgotten the point before.
_FORGOTTEN = 5.0


@dataclass(frozen=True)
class MapPoint:
    """A planned reading with its results: the inverter's reading, the shaft's at its end, and the session of the run, from 0."""

    planned: PlannedReading
    reading: DqReading
    shaft: DynamometerReading
    session: int = 0


@dataclass
class MapReadings:
    """The points that were read, those at which the inverter had no voltage left, what the shaft did where the dynamometer did not hold
    it, why it ended before its plan did, and the session that reads now: points of earlier ones come first.
    """

    points: list[MapPoint] = field(default_factory=list)
    limited: list[PlannedReading] = field(default_factory=list)
    unheld: list[DynamometerReading] = field(default_factory=list)
    ended: Text | None = None
    session: int = 0

    @property
    def sessions(self) -> NDArray[np.intp]:
        """The session (n,) of each point."""
        return np.array([point.session for point in self.points], dtype=np.intp)

    def of_session(self, session: int) -> "MapReadings":
        """Return the points of one session."""
        return MapReadings([point for point in self.points if point.session == session], session=session)

    @property
    def planned(self) -> FloatArray:
        """The currents (n, 2) in A that were asked for."""
        return np.array([(point.planned.i_d, point.planned.i_q) for point in self.points]).reshape(-1, 2)

    def column(self, name: str) -> FloatArray:
        """Return a quantity of the inverter's readings (n,)."""
        return np.array([getattr(point.reading, name) for point in self.points])

    @property
    def torques(self) -> FloatArray:
        """The torque (n,) in N·m of the motor on the shaft, friction and tare in it."""
        return np.array([-point.shaft.torque for point in self.points])


@dataclass(frozen=True)
class Pace:
    """The timing of a reading: wait after a change (s), turns of the shaft that are averaged over, the longest of all (s).

    Where the current is above `rated_current` (A) the motor rests at no current, so that the mean square is the rated one's.
    """

    settling: float
    turns: int
    longest: float
    rated_current: float

    def rest(self, current: float, taken: float) -> float:
        """Return how long (s) the motor rests after a current (A) that flowed for a time (s)."""
        return taken * max((current / self.rated_current) ** 2 - 1.0, 0.0)


def read_points(
    bench: Bench,
    nameplate: Nameplate,
    planned: Sequence[PlannedReading],
    speed: float,
    pace: Pace,
    progress: Callable[[MapReadings, float], None],
    before: MapReadings | None = None,
) -> MapReadings:
    """Return readings at planned currents, the shaft held at ± `speed` (rad/s, mechanical).

    What stops it early (a limit, a fault that the inverter reports, the time) ends the list and not the readings that there are;
    `progress` hears of each, with the time (s) that is left as it seems. Readings that were taken `before` are the first of them, their
    time counts.
    """
    taken, begun = before or MapReadings(), bench.clock.now()
    first = next((point.reading.time for point in taken.points if point.session == taken.session), begun)
    try:
        with ExitStack() as running:
            direction = planned[0].direction
            running.enter_context(bench.dynamometer.driving_speed(direction * speed))
            running.enter_context(bench.inverter.driving_dq_current(0.0, 0.0))
            for number, point in enumerate(planned):
                if bench.clock.now() - first > pace.longest:
                    taken.ended = text("the allowed time of {longest:g} s had passed", longest=pace.longest)
                    break
                if point.direction != direction:
                    direction = point.direction
                    bench.inverter.set_dq_current(0.0, 0.0)
                    bench.dynamometer.set_speed(direction * speed)
                _read(bench, nameplate, point, speed, pace, taken)
                if taken.ended is None and taken.points:
                    taken.ended = _too_hot(taken.points[-1].reading, nameplate)
                if taken.ended is not None:
                    break
                progress(taken, (bench.clock.now() - begun) / (number + 1) * (len(planned) - number - 1))
    except (LimitError, ReportedError) as stopped:
        # Everything is off by now; what was read before stays true.
        taken.ended = stopped.text
    return taken


def _read(
    bench: Bench, nameplate: Nameplate, point: PlannedReading, speed: float, pace: Pace, taken: MapReadings
) -> None:
    begun = bench.clock.now()
    try:
        bench.inverter.set_dq_current(point.i_d, point.i_q)
        lag = _FORGOTTEN * taken.points[-1].shaft.torque_filter if taken.points else 0.0
        bench.clock.sleep(max(pace.settling, lag))
        reading = bench.inverter.measure_dq(pace.turns * 2.0 * math.pi / speed)
    except (MeasurementError, ReportedError) as error:
        # A motor that runs away from its dynamometer soon reaches a limit of the inverter.
        if holds(bench, shaft := _shaft(bench), speed):
            if isinstance(error, ReportedError):
                raise
            # The voltage does not carry this current: the next one may be carried.
            taken.limited.append(point)
        else:
            if isinstance(error, ReportedError):
                taken.unheld.append(shaft)
                raise
            _not_held(bench, nameplate, shaft, point.direction * speed, taken)
    else:
        if holds(bench, shaft := _shaft(bench), speed):
            taken.points.append(MapPoint(point, reading, shaft, taken.session))
        else:
            _not_held(bench, nameplate, shaft, point.direction * speed, taken)
    if taken.ended is not None:
        return
    rest = pace.rest(math.hypot(point.i_d, point.i_q), bench.clock.now() - begun)
    if rest > 0.0:
        bench.inverter.set_dq_current(0.0, 0.0)
        bench.clock.sleep(rest)


def _shaft(bench: Bench) -> DynamometerReading:
    """Return a reading of the shaft; one of nothing but zeros is that of a sensor that dropped out, and is taken once more."""
    read = bench.dynamometer.measure()
    return read if read.speed or read.torque else bench.dynamometer.measure()


def _not_held(bench: Bench, nameplate: Nameplate, shaft: DynamometerReading, speed: float, taken: MapReadings) -> None:
    """Leave out a reading whose speed (rad/s, signed) the dynamometer did not hold; a shaft that ran away ends the readings."""
    taken.unheld.append(shaft)
    taken.ended = overspeed(nameplate, shaft)
    if taken.ended is None:
        _catch(bench, speed)


def _catch(bench: Bench, speed: float) -> None:
    """Bring a shaft that ran away back to its speed (rad/s, signed), without current."""
    with suppress(MeasurementError):
        # Above the voltage of its bus the inverter is limited at no current too, until the dynamometer has the shaft again.
        bench.inverter.set_dq_current(0.0, 0.0)
    bench.dynamometer.set_speed(speed)
    bench.inverter.set_dq_current(0.0, 0.0)


def _too_hot(reading: DqReading, nameplate: Nameplate) -> Text | None:
    limit = nameplate.maximum_winding_temperature
    if limit is None or not reading.winding_temperature > limit:
        return None
    return text(
        "the winding is at {shown:.0f} °C, above the motor's largest of {limit:.0f} °C",
        shown=reading.winding_temperature,
        limit=limit,
    )
