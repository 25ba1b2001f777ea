"""The rest position of a shaft: by its encoder, and by moving it a little and letting go."""

import math

from drivers.interfaces import Clock, RotorActuator
from drivers.interfaces.text import text
from procedures.core.bench import ProcedureError

#: A shaft stands that has moved less than this (rad) from look to look.
_STILL = 5.0e-4
#: Times between looks (s): uneven, so that no swing looks the same each time.
_LOOKS = (0.17, 0.23, 0.29)
#: A shaft that still turns after this time (s) does not come to rest by itself.
_PATIENCE = 600.0
#: How far (rad) a shaft is turned to get it off an angle that it keeps by friction alone.
_NUDGE = math.radians(10.0)
#: The first distance (rad) tried in the search for the next rest, and how it grows. Half the distance of two rests is what
#: takes the shaft over: what is tried next lands before the next rest, and never near the one after that.
_FIRST, _GROWTH = math.radians(3.5), 1.8
#: The share of the distance of two rests that is gone once that is known: a shaft let go of near its rest swings less long.
_SHARE = 0.85
#: How much farther it is turned where it then went back.
_REPEAT = 1.15
#: No motor has more rests than this in the turns that are asked for.
_MOST = 500


class RestFinder:
    """Looks at and moves one shaft."""

    def __init__(self, actuator: RotorActuator, clock: Clock) -> None:
        self._actuator = actuator
        self._clock = clock

    def wait(self) -> float:
        """Return the angle (rad) at which the shaft stands once it does. Raises ProcedureError where it goes on turning."""
        deadline = self._clock.now() + _PATIENCE
        before, quiet, look = self._angle(), 0, 0
        while self._clock.now() < deadline:
            self._clock.sleep(_LOOKS[look % len(_LOOKS)])
            here = self._angle()
            quiet = quiet + 1 if abs(here - before) < _STILL else 0
            if quiet == 2:
                return here
            before, look = here, look + 1
        raise ProcedureError(
            text("the shaft has not come to rest within {seconds:.0f} s; check what turns it", seconds=_PATIENCE)
        )

    def nudge(self) -> float:
        """Turn the shaft a little, let go, and return the angle (rad) at which it then rests."""
        return self._release_at(_NUDGE)

    def mark(self, turns: int) -> list[float]:
        """Return the angles (rad) of the rests over so many turns, the first one once more at the end.

        Raises ProcedureError where the shaft finds no other rest within them.
        """
        start = here = self.wait()
        marks, pitch = [start], 0.0
        while len(marks) < _MOST:
            before = here
            here = self._next(before, pitch, 2.0 * math.pi * turns)
            pitch = here - before
            marks.append(here)
            # The mark made first has come round again: the turn is complete.
            if here - start > 2.0 * math.pi * turns - 0.5 * pitch:
                break
        return marks

    def _next(self, rest: float, pitch: float, farthest: float) -> float:
        """Return the angle of the rest after this one; `pitch` is the distance of the last two, 0 where nobody knows it."""
        distance, growth = (_SHARE * pitch, _REPEAT) if pitch else (_FIRST, _GROWTH)
        here = rest
        while distance < 1.1 * farthest:
            here = self._release_at(rest + distance - here)
            # What went back has found no rest, nor, with nothing known of them, what stayed where it was let go of.
            if here - rest > (0.5 * pitch or 1.05 * distance):
                return here
            distance *= growth
        raise ProcedureError(
            text("the shaft snaps in at no other position: does the holding current flow, and is the clutch open?")
        )

    def _release_at(self, distance: float) -> float:
        self._actuator.move_by(distance)
        return self.wait()

    def _angle(self) -> float:
        return self._actuator.angle().value
