"""Speeds of ramps by J·dω/dt = T − Tc − B·ω − c·ω², with what else may act on shaft and sensor, and their fit."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from procedures.estimation.fitting.first_order import Decay
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.nonlinear import minimise
from procedures.estimation.mechanics.ramp_motion import RampMotion, TooFarError, Trajectory
from procedures.estimation.mechanics.ramp_terms import Terms
from procedures.estimation.mechanics.turning import Run

#: Speeds count as no better than this share of the top one, which is what integration and files leave.
_EXACT = 1e-6
#: A transient of the speed's filter is no larger than so many times what the change of acceleration leaves it behind by.
_BEHIND = 2.0
#: What stands for the speeds where there is no motion.
_NOWHERE = 1e100


@dataclass(frozen=True)
class Solved:
    """A fit of ramps: `values` (k,), whitened `residuals` (n,) and `slopes` (k, n) of the model, both with the rows of what is known;
    `covariance` (k, k), `cost` = Σr², `speeds` (rad/s) as fitted.
    """

    values: FloatArray
    residuals: FloatArray
    slopes: FloatArray
    covariance: FloatArray
    cost: float
    speeds: FloatArray


class RampModel:
    """All ramps with shared J, Tc, B, c (over J where `unit_torque`, as a coast-down alone tells), one initial speed a ramp, and terms."""

    def __init__(self, runs: Sequence[Run], *, unit_torque: bool, terms: Terms | None = None) -> None:
        self.runs, self.unit_torque = runs, unit_torque
        self.terms = terms = terms or Terms()
        self._shared = 3 if unit_torque else 4
        self._noisy = [k for k, run in enumerate(runs) if run.torque_noise > 0]
        self._first = self._shared
        at = self._errors = self._shared + len(runs)
        at += len(self._noisy)
        self.stribeck_place = at
        at += terms.stribeck is not None
        self._torque_filter = at
        at += terms.torque_filter
        self._filtered = [k for k, run in enumerate(runs) if terms.speed_filter or run.speed_filter]
        self._transients = at
        at += len(self._filtered)
        self._added = at
        self.size = at + len(terms.added)
        self.edges = np.cumsum([0, *(run.time.size for run in runs)])
        self.measured = np.concatenate([run.speed for run in runs])
        self.spread = np.concatenate([np.full(run.speed.size, noise_of(run)) for run in runs])
        self.top = max(float(np.max(np.abs(run.speed))) for run in runs)
        self._motions = [RampMotion(run, self.top) for run in runs]
        #: By ramp, what its motion changes by with the parameters where it was found last: their values, their places, and the change.
        self._last: list[tuple[FloatArray, list[int], FloatArray] | None] = [None] * len(runs)
        self._known = np.zeros((self.size, len(self._noisy) + len(self._filtered)))
        for row, k in enumerate(self._noisy):
            self._known[self._errors + row, row] = 1.0 / runs[k].torque_noise
        for row, k in enumerate(self._filtered):
            self._known[self._transients + row, len(self._noisy) + row] = 1.0 / self._largest_transient(k)
        self._fading = {k: np.exp(-runs[k].time / self._filter_time(k)) for k in self._filtered}
        self._filters = {k: self._filter_of(k) for k in self._filtered}

    def part(self, k: int) -> slice:
        """Return where a ramp's readings stand among all."""
        return slice(int(self.edges[k]), int(self.edges[k + 1]))

    def start(self, shared: FloatArray) -> FloatArray:
        """Return where to begin from inertia and friction (k,) without the quadratic part."""
        values = np.zeros(self.size)
        values[: shared.size] = shared
        values[self._first : self._errors] = [run.speed[0] for run in self.runs]
        return values

    def with_terms(self, terms: Terms) -> "RampModel":
        """Return the model of the same ramps with other terms, its speeds sought from these."""
        further = RampModel(self.runs, unit_torque=self.unit_torque, terms=terms)
        for own, motion in zip(further._motions, self._motions, strict=True):
            own.near = motion.near
        return further

    def scale(self, start: FloatArray) -> FloatArray:
        """Return a typical change of each parameter (k,)."""
        inertia = 1.0 if self.unit_torque else abs(float(start[0]))
        acting = inertia * max(float(np.ptp(run.speed) / run.time[-1]) for run in self.runs)
        scale = np.full(self.size, 0.01 * self.top)
        scale[: self._shared] = np.array([inertia, acting, acting / self.top, acting / self.top**2])[-self._shared :]
        scale[self._errors : self.stribeck_place] = [self.runs[k].torque_noise for k in self._noisy]
        scale[self.stribeck_place : self._torque_filter] = acting
        scale[self._torque_filter : self._transients] = 0.01 * max(float(run.time[-1]) for run in self.runs)
        scale[self._added :] = np.median(self.spread)
        return scale

    def trajectory(self, k: int, p: FloatArray) -> Trajectory:
        """Return a ramp's speed, shaft's and as read."""
        run = self.runs[k]
        inertia, (coulomb, viscous, quadratic) = self._friction(p)
        torque = run.driven + (p[self._errors + self._noisy.index(k)] if k in self._noisy else 0.0)
        law, amount = self.terms.stribeck, p[self.stribeck_place] if self.terms.stribeck else 0.0

        def accelerating(speed: FloatArray) -> tuple[FloatArray, FloatArray]:
            square = quadratic * np.abs(speed)
            braking, slope = coulomb + speed * (viscous + square), viscous + 2.0 * square
            if law is not None:
                value, change = law.shape(speed)
                braking, slope = braking + amount * value, slope + amount * change
            return (torque - braking) / inertia, slope / inertia

        last, change = self._last[k], None
        if last is not None:
            values, places, moved = last
            change = (p[places] - values) @ moved
        self._last[k] = None
        at = self._motions[k].trajectory(accelerating, float(p[self._first + k]), self._extra(k, p), change)
        return at._replace(read=self._read(k, at.speed, float(at.acceleration[0]), p))

    def later(self, k: int, at: Trajectory, inertia: float) -> FloatArray:
        """Return by how much a ramp's speed grows (n,) for each second that the torque's reading is behind."""
        risen = (self.runs[k].driven - self.runs[k].driven[0]) / inertia
        return np.asarray(risen + at.caused(-at.rate * risen))

    def evaluate(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return whitened residuals and their derivatives (k, n) by the parameters, the rows of what is known last."""
        try:
            speeds, slopes = self.model(p)
        except TooFarError:
            speeds, slopes = np.full(self.measured.size, _NOWHERE), np.zeros((p.size, self.measured.size))
        return (
            np.append((self.measured - speeds) / self.spread, -(p @ self._known)),
            np.hstack((slopes / -self.spread, -self._known)),
        )

    def model(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the speeds (n,) of all ramps as read, and their derivatives (k, n) by the parameters."""
        speeds, slopes = np.empty(self.measured.size), np.zeros((p.size, self.measured.size))
        inertia, _ = self._friction(p)
        for k in range(len(self.runs)):
            part, at = self.part(k), self.trajectory(k, p)
            speeds[part] = at.read
            torques = [-at.acceleration, -np.ones_like(at.speed), -at.speed, -at.speed * np.abs(at.speed)]
            torques, places = torques[-self._shared :], list(range(self._shared))
            if k in self._noisy:
                torques.append(np.ones_like(at.speed))
                places.append(self._errors + self._noisy.index(k))
            if self.terms.stribeck is not None:
                torques.append(-self.terms.stribeck.shape(at.speed)[0])
                places.append(self.stribeck_place)
            torques.append(np.zeros_like(at.speed))
            places.append(self._first + k)
            starts = np.zeros(len(torques))
            starts[-1] = 1.0
            driving = np.array(torques) / inertia
            moved = at.caused(driving, starts)
            if self.terms.torque_filter:
                more = self.later(k, at, inertia)
                moved, places = np.vstack((moved, more)), [*places, self._torque_filter]
                driving, starts = np.vstack((driving, np.zeros_like(more))), np.append(starts, 0.0)
            self._last[k] = p[places], places, moved
            if k in self._filtered:
                moved = self._filter(k, moved, driving[:, 0] - at.rate[0] * starts)
                slopes[self._transients + self._filtered.index(k), part] = self._fading[k]
            slopes[places, part] = moved
        for row, shape in enumerate(self.terms.added):
            speeds += p[self._added + row] * shape
            slopes[self._added + row] = shape
        return speeds, slopes

    def solve(self, start: FloatArray, *, least: float = 1e-9, rounds: int = 100) -> Solved:
        """Fit from a start, in no more `rounds`, until one would change χ² by `least`.

        Raises EstimationError where the record does not determine the parameters apart.
        """
        what = "inertia, Coulomb, viscous and quadratic friction"
        if self.measured.size <= self.size:
            raise EstimationError(f"{self.measured.size} speeds do not suffice; sample the ramps faster")
        scale = self.scale(start)
        solution = minimise(self.evaluate, start, scale, least=least, floor=1.0, rounds=rounds)
        if not (solution.settled and np.all(np.isfinite(solution.values))):
            raise EstimationError(f"the fit of {what} does not converge; {self._suspected()}")
        residuals, slopes = self.evaluate(solution.values)
        # By what each says: one that the readings hardly show is determined by what is known of it.
        said = np.linalg.norm(slopes, axis=1)
        said[said == 0.0] = 1.0
        r = np.linalg.qr((slopes / said[:, None]).T, mode="r")
        sizes = np.linalg.svd(r, compute_uv=False)
        if not sizes[-1] > 1e-9 * sizes[0]:
            raise EstimationError(f"the record does not determine {what} apart; take a longer or livelier one")
        inverse = np.linalg.inv(r) / said[:, None]
        left = residuals[: self.measured.size] * self.spread
        return Solved(
            solution.values, residuals, -slopes, inverse @ inverse.T, float(residuals @ residuals), self.measured - left
        )

    def amount(self, term: Literal["stribeck", "torque_filter"], p: FloatArray) -> float:
        """Return a term's amplitude (N·m) or time constant (s)."""
        return float(p[self.stribeck_place if term == "stribeck" else self._torque_filter])

    def without(self, solved: Solved, fifth: int) -> "RampModel":
        """Return the model of the ramps without a fifth of each, and without what is added to their speeds."""
        kept = []
        for k, run in enumerate(self.runs):
            inside = np.ones(run.time.size, dtype=bool)
            inside[fifth * run.time.size // 5 : (fifth + 1) * run.time.size // 5] = False
            shaft = run.speed - sum(
                (solved.values[self._added + row] * shape[self.part(k)] for row, shape in enumerate(self.terms.added)),
                np.zeros(run.time.size),
            )
            kept.append(replace(run, time=run.time[inside], speed=shaft[inside], driven=run.driven[inside]))
        return RampModel(kept, unit_torque=self.unit_torque, terms=replace(self.terms, added=()))

    def lags(self, solved: Solved) -> bool:
        """Tell whether the speed's filter is behind as one is: early where a drive began, late where it let go."""
        for row, k in enumerate(self._filtered):
            behind, run = float(solved.values[self._transients + row]), self.runs[k]
            slack = 3.0 * float(np.sqrt(solved.covariance[self._transients + row, self._transients + row]))
            rising = run.speed[-1] > run.speed[0]
            if (behind if rising else -behind) < -slack or abs(behind) > 2.0 * self._largest_transient(k) + slack:
                return False
        return True

    def inertia(self, p: FloatArray) -> float:
        """Return the inertia (kg·m²), 1 where torques are those over it."""
        return self._friction(p)[0]

    def _suspected(self) -> str:
        """Return what to look at where no motion fits the records."""
        lagging = [number for number, run in enumerate(self.runs, 1) if run.varies]
        if not lagging:
            return "check that the record shows what it should"
        return (
            f"the torque of ramp {lagging[0]} keeps changing, as behind a slow filter: shorten the torque transducer's"
        )

    def _friction(self, p: FloatArray) -> tuple[float, tuple[float, float, float]]:
        shared = p[: self._shared]
        inertia = 1.0 if self.unit_torque else float(shared[0])
        return inertia, (float(shared[-3]), float(shared[-2]), float(shared[-1]))

    def _extra(self, k: int, p: FloatArray) -> FloatArray | float:
        """Return what the torque's filter adds to the integral of the acceleration."""
        run = self.runs[k]
        late = run.torque_filter + (float(p[self._torque_filter]) if self.terms.torque_filter else 0.0)
        return np.asarray(late * (run.driven - run.driven[0]) / self._friction(p)[0]) if late else 0.0

    def _filter_time(self, k: int) -> float:
        return self.runs[k].speed_filter or self.terms.speed_filter

    def _largest_transient(self, k: int) -> float:
        run = self.runs[k]
        rates = [abs(float(each.speed[-1] - each.speed[0])) / float(each.time[-1]) for each in self.runs]
        return max(_BEHIND * 2.0 * max(rates) * self._filter_time(k), 10.0 * noise_of(run))

    def _read(self, k: int, speed: FloatArray, acceleration: float, p: FloatArray) -> FloatArray:
        if k not in self._filtered:
            return speed
        read = self._filter(k, speed, np.asarray(acceleration))
        return np.asarray(read + p[self._transients + self._filtered.index(k)] * self._fading[k])

    def _filter(self, k: int, values: FloatArray, rising: FloatArray) -> FloatArray:
        """Return values (…, n) behind the filter, which has followed them as they rose at first."""
        tau = self._filter_time(k)
        return self._filters[k].respond(values / tau, values[..., 0] - tau * rising)

    def _filter_of(self, k: int) -> Decay:
        steps = np.diff(self.runs[k].time)
        return Decay(steps, steps / self._filter_time(k))


def noise_of(run: Run) -> float:
    """Return the standard deviation (rad/s) that a ramp's speeds count with."""
    return max(run.noise, _EXACT * float(np.max(np.abs(run.speed))))
