"""Motion of a shaft whose drag has no closed form, or that feels its cogging while it turns."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.integration.swing_equations import Shaft
from sim_instruments.physics.motion.motion import Drag

_TOLERANCE = 1e-10


class BearingDrag:
    """J·ω' = torque − friction(ω) from a start on, turning one way, for at most `horizon` s.

    `end` is when (s) the speed has fallen to `last` (then it has `stopped`) or risen to `limit` (rad/s, along the way), else the
    horizon's end.
    """

    def __init__(
        self,
        start: float,
        angle: float,
        speed: float,
        torque: float,
        shaft: Shaft,
        *,
        way: float,
        last: float,
        limit: float,
        horizon: float,
    ) -> None:
        self.start = start
        self._torque, self._shaft = torque, shaft
        grip = way * shaft.static_friction

        def slope(_: float, state: FloatArray) -> list[float]:
            turning = float(state[1])
            drag = shaft.friction(turning) if turning * way > 0.0 else grip
            return [turning, (torque - drag) / shaft.inertia]

        def falls(_: float, state: FloatArray) -> float:
            return way * float(state[1]) - last

        def rises(_: float, state: FloatArray) -> float:
            return way * float(state[1]) - limit

        # solve_ivp reads what kind of event a function is from its attributes.
        for event, direction in ((falls, -1.0), (rises, 1.0)):
            event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
        events = [falls, rises] if math.isfinite(limit) else [falls]
        scale = max(abs(speed), 1.0)
        # Not every bench has such a shaft, and loading it takes as long as much of a bench.
        from scipy.integrate import solve_ivp

        solution = solve_ivp(
            slope,
            (0.0, horizon),
            [angle, speed],
            method="DOP853",
            dense_output=True,
            events=events,
            rtol=_TOLERANCE,
            atol=_TOLERANCE * scale,
        )
        if not solution.success or solution.sol is None:
            raise RuntimeError(f"the coasting shaft could not be integrated from {start:.6g} s on: {solution.message}")
        self._dense, self._span = solution.sol, float(solution.t[-1])
        self.stopped = solution.status == 1 and way * float(solution.y[1, -1]) < 0.5 * (last + min(limit, abs(speed)))
        self.end = start + self._span

    def angle(self, times: FloatArray) -> FloatArray:
        """Return the angle (rad) at the times."""
        return np.asarray(self._states(times)[0], dtype=np.float64)

    def speed(self, times: FloatArray) -> FloatArray:
        """Return the speed (rad/s) at the times."""
        return np.asarray(self._states(times)[1], dtype=np.float64)

    def acceleration(self, times: FloatArray) -> FloatArray:
        """Return the acceleration (rad/s²) at the times."""
        speed = self.speed(times)
        return (self._torque - self._shaft.frictions(speed)) / self._shaft.inertia

    def time_of_speed(self, speed: float) -> float:
        """Return the time (s) at which a speed (rad/s) is reached, infinite where it is not within the motion."""

        def over(passed: float) -> float:
            return float(self._dense(passed)[1]) - speed

        if over(0.0) == 0.0:
            return self.start
        if over(0.0) * over(self._span) > 0.0:
            return math.inf
        return self.start + float(brentq(over, 0.0, self._span, xtol=1e-12))

    def _states(self, times: FloatArray) -> FloatArray:
        return self._dense(np.clip(times - self.start, 0.0, self._span))


@dataclass(frozen=True)
class CoggingWaves:
    """Torque −`torque`·sin(`order`·θ + `phase`) (N·m, periods a turn, rad) on an inertia (kg·m²)."""

    torque: float
    order: int
    phase: float
    inertia: float

    @property
    def swing(self) -> float:
        """By how much (rad²/s²) the square of the speed swings either way."""
        return 2.0 * self.torque / (self.order * self.inertia)

    @property
    def slowest(self) -> float:
        """The mean speed (rad/s) below which a shaft does not come over the next wave."""
        return math.sqrt(self.swing)

    def mean_square(self, angle: float, speed: float) -> float:
        """Return the square of the speed (rad²/s²) about which it swings, for a speed at an angle."""
        return max(speed**2 - self.swing * math.cos(self.order * angle + self.phase), 0.0)


@dataclass(frozen=True)
class Cogged:
    """A motion over the waves of a cogging torque: energy goes back and forth between them and the inertia.

    `mean` is the motion without them, whose friction takes its energy over many waves.
    """

    mean: Drag | BearingDrag
    cogging: CoggingWaves

    def angle(self, times: FloatArray) -> FloatArray:
        """Return the angle (rad) at the times."""
        angle, square = self.mean.angle(times), self._square(times)
        cogging = self.cogging
        turned = np.sin(cogging.order * angle + cogging.phase) * cogging.swing / (2.0 * cogging.order * square)
        # What cannot climb a wave stays within it.
        most = 1.0 / cogging.order
        result: FloatArray = angle + np.sign(self.mean.speed(times)) * np.clip(turned, -most, most)
        return result

    def speed(self, times: FloatArray) -> FloatArray:
        """Return the speed (rad/s) at the times."""
        square, cogging = self._square(times), self.cogging
        wave = np.cos(cogging.order * self.angle(times) + cogging.phase)
        return np.sign(self.mean.speed(times)) * np.sqrt(np.maximum(square + cogging.swing * wave, 1e-4 * square))

    def acceleration(self, times: FloatArray) -> FloatArray:
        """Return the acceleration (rad/s²) at the times."""
        cogging = self.cogging
        wave = np.sin(cogging.order * self.angle(times) + cogging.phase)
        return self.mean.acceleration(times) - cogging.torque / cogging.inertia * wave

    def time_of_speed(self, speed: float) -> float:
        """Return the time (s) at which a speed (rad/s) is reached on the mean, infinite where it is not within the motion."""
        return self.mean.time_of_speed(speed)

    def _square(self, times: FloatArray) -> FloatArray:
        return np.maximum(self.mean.speed(times) ** 2, 1e-12)
