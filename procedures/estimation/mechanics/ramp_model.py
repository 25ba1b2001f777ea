"""Speeds of ramps by J·dω/dt = T − Tc − B·ω − c·ω², with what else may act on shaft and sensor, and their fit."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from procedures.estimation.fitting.first_order import Decay
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.nonlinear import IntArray, Minimum, minimise, minimise_each
from procedures.estimation.mechanics.ramp_motion import RampMotion, Trajectory
from procedures.estimation.mechanics.ramp_terms import Terms
from procedures.estimation.mechanics.turning import Run

#: Speeds count as no better than this share of the top one, which is what integration and files leave.
_EXACT = 1e-6
#: Below such a slope, in standard uncertainties of the readings, a parameter is not determined.
_SAYS_NOTHING = 1e-140
#: A transient of the speed's filter is no larger than so many times what the change of acceleration leaves it behind by.
_BEHIND = 2.0
_WHAT = "inertia, Coulomb, viscous and quadratic friction"
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
    """All ramps with shared J, Tc, B, c (over J where `unit_torque`, as a coast-down alone tells), one initial speed a ramp, and terms.

    Where terms hold the values of several fits, so do parameters (m, k): each fit is a row of them, and of all that is made of them.
    """

    def __init__(self, runs: Sequence[Run], *, unit_torque: bool) -> None:
        self.runs, self.unit_torque = runs, unit_torque
        self._shared = 3 if unit_torque else 4
        self._noisy = [k for k, run in enumerate(runs) if run.torque_noise > 0]
        self._first = self._shared
        self._errors = self._shared + len(runs)
        self.edges = np.cumsum([0, *(run.time.size for run in runs)])
        self.measured = np.concatenate([run.speed for run in runs])
        self.spread = np.concatenate([np.full(run.speed.size, noise_of(run)) for run in runs])
        self.top = max(float(np.max(np.abs(run.speed))) for run in runs)
        #: By ramp, for how long (s) the shaft has turned in the ramps up to each reading.
        before = np.cumsum([0.0, *(float(run.time[-1]) for run in runs[:-1])])
        self.turned = [begun + run.time for begun, run in zip(before, runs, strict=True)]
        self._motions = [RampMotion(run, self.top) for run in runs]
        self._lay_out(Terms())

    def _lay_out(self, terms: Terms) -> None:
        self.terms = terms
        #: By ramp, what its motion changes by with the parameters where it was found last: their values, their places, and the change.
        self._last: list[tuple[FloatArray, list[int], FloatArray] | None] = [None] * len(self.runs)
        at = self._errors + len(self._noisy)
        self.stribeck_place = at
        at += terms.stribeck is not None
        self.drift_place = at
        at += terms.drift is not None
        self._torque_filter = at
        at += terms.torque_filter
        self._filtered = [k for k, run in enumerate(self.runs) if terms.filters_speed or run.speed_filter]
        self._transients = at
        at += len(self._filtered)
        self._added = at
        self.size = at + len(terms.added)
        self._filters = {k: self._filter_of(k) for k in self._filtered}
        largest = [np.asarray(self._largest_transient(k)) for k in self._filtered]
        #: What is known of parameters: derivatives (…, k, r) of the rows that say so.
        self._known = np.zeros((*terms.several, self.size, len(self._noisy) + len(self._filtered)))
        for row, k in enumerate(self._noisy):
            self._known[..., self._errors + row, row] = 1.0 / self.runs[k].torque_noise
        for row, most in enumerate(largest):
            self._known[..., self._transients + row, len(self._noisy) + row] = 1.0 / most

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
        further = copy.copy(self)
        further._motions = [copy.copy(motion) for motion in self._motions]
        further._lay_out(terms)
        return further

    def with_late_scatter(self, solved: Solved) -> tuple["RampModel", Solved]:
        """Return the model whose speeds count with what the torque's scatter becomes where its filter is undone, and the fit by it."""
        further = copy.copy(self)
        inertia, late = self.inertia(solved.values), abs(self.amount("torque_filter", solved.values))
        further.spread = np.concatenate(
            [np.full(run.speed.size, np.hypot(noise_of(run), late * _scatter(run) / inertia)) for run in self.runs]
        )
        n, less = self.measured.size, self.spread / further.spread
        residuals, slopes = solved.residuals.copy(), solved.slopes.copy()
        residuals[:n] *= less
        slopes[:, :n] *= less
        covariance = np.asarray(np.linalg.inv(slopes @ slopes.T), dtype=np.float64)
        return further, replace(
            solved, residuals=residuals, slopes=slopes, covariance=covariance, cost=float(residuals @ residuals)
        )

    def _of(self, rows: IntArray) -> "RampModel":
        """Return the model of some (m,) of several fits."""
        further = self.with_terms(self.terms.of(rows))
        further._last = [None if last is None else (last[0][rows], last[1], last[2][rows]) for last in self._last]
        for motion in further._motions:
            motion.near = motion.near[rows] if motion.near.ndim > 1 else motion.near
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
        torque: FloatArray = run.driven
        if k in self._noisy:
            torque = torque + p[..., self._errors + self._noisy.index(k), None]
        law, amount = self.terms.stribeck, p[..., self.stribeck_place, None] if self.terms.stribeck else np.zeros(1)
        free, drift = torque - coulomb, self.terms.drift
        if drift is not None:
            gone = p[..., self.drift_place, None] * drift.fall(self.turned[k], np.ones_like(run.speed))
            if drift.top:
                viscous = viscous - gone
            else:
                free = free + gone

        def accelerating(speed: FloatArray) -> tuple[FloatArray, FloatArray]:
            slope = quadratic * np.abs(speed)
            braking = speed * (viscous + slope)
            slope *= 2.0
            slope += viscous
            if law is not None:
                value, change = law.shape(speed)
                braking += amount * value
                slope += amount * change
            slope /= inertia
            return (free - braking) / inertia, slope

        last, change = self._last[k], None
        if last is not None:
            values, places, moved = last
            change = ((p[..., places] - values)[..., None, :] @ moved)[..., 0, :]
        self._last[k] = None
        at = self._motions[k].trajectory(accelerating, p[..., self._first + k], self._extra(k, p), change)
        return at if k not in self._filtered else at._replace(read=self._read(k, at, p))

    def later(self, k: int, at: Trajectory, inertia: FloatArray | float) -> FloatArray:
        """Return by how much a ramp's speed grows (…, n) for each second that the torque's reading is behind."""
        risen = (self.runs[k].driven - self.runs[k].driven[0]) / inertia
        return np.asarray(risen + at.caused(-at.rate * risen))

    def evaluate(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return whitened residuals (…, n) and their derivatives (…, k, n) by the parameters, the rows of what is known last."""
        speeds, slopes = self._speeds_and_slopes(p, self._known.shape[-1])
        n = self.measured.size
        residuals = np.empty((*p.shape[:-1], slopes.shape[-1]))
        residuals[..., :n] = (self.measured - speeds) / self.spread
        residuals[..., n:] = -(p[..., None, :] @ self._known)[..., 0, :]
        slopes[..., :n] /= -self.spread
        slopes[..., n:] = -self._known
        return residuals, slopes

    def model(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the speeds (…, n) of all ramps as read, and their derivatives (…, k, n) by the parameters."""
        return self._speeds_and_slopes(p, 0)

    def _speeds_and_slopes(self, p: FloatArray, spare: int) -> tuple[FloatArray, FloatArray]:
        """Return what `model` does, the derivatives with `spare` places more."""
        several, n = p.shape[:-1], self.measured.size
        speeds, slopes = np.empty((*several, n)), np.zeros((*several, p.shape[-1], n + spare))
        inertia, _ = self._friction(p)
        nowhere = np.zeros(several, dtype=bool)
        for k in range(len(self.runs)):
            part, at = self.part(k), self.trajectory(k, p)
            speeds[..., part] = at.read
            nowhere |= at.far
            moved, places, driving, starts = self._moved(k, at, inertia)
            self._last[k] = p[..., places], places, moved
            if k in self._filtered:
                moved = self._filter(k, moved, driving - at.rate[..., :1] * starts)
                slopes[..., self._transients + self._filtered.index(k), part] = self._fading(k)
            slopes[..., places, part] = moved
        for row, shape in enumerate(self.terms.added):
            speeds += p[..., self._added + row, None] * shape
            slopes[..., self._added + row, :n] = shape
        if nowhere.any():
            speeds[nowhere], slopes[nowhere] = _NOWHERE, 0.0
        return speeds, slopes

    def _moved(
        self, k: int, at: Trajectory, inertia: FloatArray
    ) -> tuple[FloatArray, list[int], FloatArray, FloatArray]:
        """Return by how much a ramp's speed grows (…, j, n) with some parameters, these parameters' places (j,), and by how much its
        acceleration (…, j) and its speed (j,) do at first.
        """
        places = list(range(self._shared))
        if k in self._noisy:
            places.append(self._errors + self._noisy.index(k))
        if self.terms.stribeck is not None:
            places.append(self.stribeck_place)
        if self.terms.drift is not None:
            places.append(self.drift_place)
        places.append(self._first + k)
        driving = np.empty((*at.speed.shape[:-1], len(places), at.speed.shape[-1]))
        row = self._shared
        np.multiply(at.speed, np.abs(at.speed), out=driving[..., row - 1, :])
        driving[..., row - 2, :] = at.speed
        driving[..., row - 3, :] = 1.0
        if not self.unit_torque:
            driving[..., 0, :] = at.acceleration
        if k in self._noisy:
            driving[..., row, :] = -1.0
            row += 1
        if self.terms.stribeck is not None:
            driving[..., row, :] = self.terms.stribeck.friction(at.speed)
            row += 1
        if self.terms.drift is not None:
            driving[..., row, :] = -self.terms.drift.fall(self.turned[k], at.speed)
        driving[..., -1, :] = 0.0
        driving /= -inertia[..., None]
        starts = np.zeros(len(places))
        starts[-1] = 1.0
        moved, first = at.caused(driving, starts), driving[..., 0]
        if self.terms.torque_filter:
            more = self.later(k, at, inertia)
            moved, places = np.concatenate((moved, more[..., None, :]), axis=-2), [*places, self._torque_filter]
            first = np.concatenate((first, np.zeros_like(first[..., :1])), axis=-1)
            starts = np.append(starts, 0.0)
        return moved, places, first, starts

    def solve(self, start: FloatArray, *, least: float = 1e-9, rounds: int = 100) -> Solved:
        """Fit from a start, in no more `rounds`, until one would change χ² by `least`.

        Raises EstimationError where the record does not determine the parameters apart.
        """
        self._check_size()
        scale = self.scale(start)
        minimum = minimise(self.evaluate, start, scale, least=least, floor=1.0, rounds=rounds)
        if not _converged(minimum):
            raise EstimationError(f"the fit of {_WHAT} does not converge; {self._suspected()}")
        solved = self._solved(minimum)
        if solved is None:
            raise EstimationError(f"the record does not determine {_WHAT} apart; take a longer or livelier one")
        return solved

    def solve_each(self, start: FloatArray, *, least: float, rounds: int) -> list[Solved | None]:
        """Fit several models side by side as `solve` does one, all from one start; None where it would raise."""
        self._check_size()
        scale, model = self.scale(start), self
        among = np.arange(len(self._known))

        def evaluate(p: FloatArray, places: IntArray) -> tuple[FloatArray, FloatArray]:
            nonlocal model, among
            if places.size < among.size:
                model, among = model._of(np.searchsorted(among, places)), places
            return model.evaluate(p)

        starts = np.tile(start, (len(self._known), 1))
        minima = minimise_each(evaluate, starts, scale, least=least, floor=1.0, rounds=rounds)
        return [self._solved(each) if _converged(each) else None for each in minima]

    def _check_size(self) -> None:
        if self.measured.size <= self.size:
            raise EstimationError(f"{self.measured.size} speeds do not suffice; sample the ramps faster")

    def _solved(self, minimum: Minimum) -> Solved | None:
        """Return a fit from where it ended; None where that does not determine the parameters apart."""
        # By what each says: one that the readings hardly show is determined by what is known of it.
        said = np.linalg.norm(minimum.slopes, axis=1)
        said[said == 0.0] = 1.0
        r = np.linalg.qr((minimum.slopes / said[:, None]).T, mode="r")
        sizes = np.linalg.svd(r, compute_uv=False)
        if not sizes[-1] > 1e-9 * sizes[0]:
            return None
        # What a fit at the edge of its numbers says next to nothing of is not determined either.
        if float(np.min(said)) < _SAYS_NOTHING:
            return None
        inverse = np.linalg.inv(r) / said[:, None]
        left = minimum.residuals[: self.measured.size] * self.spread
        return Solved(
            minimum.values,
            minimum.residuals,
            -minimum.slopes,
            inverse @ inverse.T,
            float(minimum.residuals @ minimum.residuals),
            self.measured - left,
        )

    def amount(self, term: Literal["stribeck", "drift", "torque_filter"], p: FloatArray) -> float:
        """Return a term's amplitude (N·m) or time constant (s)."""
        places = {"stribeck": self.stribeck_place, "drift": self.drift_place, "torque_filter": self._torque_filter}
        return float(p[places[term]])

    def drifted(self, p: FloatArray) -> float:
        """Return by what share of itself friction has grown, at half the top speed, when the ramps end; 0 where none drifts."""
        if self.terms.drift is None:
            return 0.0
        half = 0.5 * self.top
        whole = float(p[self._shared - 3 : self._shared] @ np.array([1.0, half, half**2]))
        return -self.amount("drift", p) * (0.5 if self.terms.drift.top else 1.0) / whole

    def without(self, solved: Solved, fifth: int) -> tuple["RampModel", FloatArray]:
        """Return the model of the ramps without a fifth of each, and without what is added to their speeds; and where to begin its fit."""
        kept, turned, start = [], [], solved.values[: self._added].copy()
        for k, run in enumerate(self.runs):
            inside = np.ones(run.time.size, dtype=bool)
            inside[fifth * run.time.size // 5 : (fifth + 1) * run.time.size // 5] = False
            shaft = run.speed - sum(
                (solved.values[self._added + row] * shape[self.part(k)] for row, shape in enumerate(self.terms.added)),
                np.zeros(run.time.size),
            )
            kept.append(replace(run, time=run.time[inside], speed=shaft[inside], driven=run.driven[inside]))
            turned.append(self.turned[k][inside])
            if fifth == 0:
                start[self._first + k] = kept[-1].speed[0]
        further = RampModel(kept, unit_torque=self.unit_torque)
        further.turned = turned
        further._lay_out(replace(self.terms, added=()))
        return further, start

    def lags(self, solved: Solved) -> bool:
        """Tell whether the speed's filter is behind as one is: early where a drive began, late where it let go."""
        for row, k in enumerate(self._filtered):
            behind, run = float(solved.values[self._transients + row]), self.runs[k]
            slack = 3.0 * float(np.sqrt(solved.covariance[self._transients + row, self._transients + row]))
            largest = float(self._largest_transient(k))
            ahead = behind if run.speed[-1] > run.speed[0] else -behind
            # A torque behind a filter shows too little acceleration at first, and the speed is further behind than that gives.
            late = largest if run.varies and (self.terms.torque_filter or run.torque_filter) else 0.0
            if ahead < -slack - late or abs(behind) > 2.0 * largest + slack:
                return False
        return True

    def inertia(self, p: FloatArray) -> float:
        """Return the inertia (kg·m²), 1 where torques are those over it."""
        return 1.0 if self.unit_torque else float(p[0])

    def _suspected(self) -> str:
        """Return what to look at where no motion fits the records."""
        lagging = [number for number, run in enumerate(self.runs, 1) if run.varies]
        if not lagging:
            return "check that the record shows what it should"
        return (
            f"the torque of ramp {lagging[0]} keeps changing, as behind a slow filter: shorten the torque transducer's"
        )

    def _friction(self, p: FloatArray) -> tuple[FloatArray, tuple[FloatArray, FloatArray, FloatArray]]:
        """Return inertia and frictions, each (…, 1)."""
        at = self._shared
        inertia = np.ones(1) if self.unit_torque else p[..., :1]
        return inertia, (p[..., at - 3 : at - 2], p[..., at - 2 : at - 1], p[..., at - 1 : at])

    def _extra(self, k: int, p: FloatArray) -> FloatArray | float:
        """Return what the torque's filter adds to the integral of the acceleration."""
        run = self.runs[k]
        if not (run.torque_filter or self.terms.torque_filter):
            return 0.0
        late = run.torque_filter + (p[..., self._torque_filter, None] if self.terms.torque_filter else 0.0)
        return np.asarray(late * (run.driven - run.driven[0]) / self._friction(p)[0])

    def _filter_time(self, k: int) -> float | FloatArray:
        return self.runs[k].speed_filter or self.terms.speed_filter

    def _largest_transient(self, k: int) -> float | FloatArray:
        """Return how large a transient of the speed's filter may be (rad/s), of each of several fits (m,)."""
        run, tau = self.runs[k], self._filter_time(k)
        rates = [abs(float(each.speed[-1] - each.speed[0])) / float(each.time[-1]) for each in self.runs]
        most = np.maximum(_BEHIND * 2.0 * max(rates) * tau, 10.0 * noise_of(run))
        return most[..., 0] if np.ndim(most) else float(most)

    def _read(self, k: int, at: Trajectory, p: FloatArray) -> FloatArray:
        read = self._filter(k, at.speed, at.acceleration[..., 0])
        return np.asarray(read + p[..., self._transients + self._filtered.index(k), None] * self._fading(k))

    def _fading(self, k: int) -> FloatArray:
        return self._filters[k][1]

    def _filter(self, k: int, values: FloatArray, rising: FloatArray) -> FloatArray:
        """Return values (…, n) behind the filter, which has followed them as they rose at first."""
        tau, passed = self._filter_time(k), self._filters[k][0]
        if not isinstance(tau, np.ndarray):
            return passed.respond(values / tau, values[..., 0] - tau * rising)
        each = tau if values.ndim == tau.ndim else tau[..., None, :]
        return passed.respond(values / each, values[..., 0] - each[..., 0] * rising)

    def _filter_of(self, k: int) -> tuple[Decay, FloatArray]:
        """Return a ramp's filter, and how its transient fades (…, n)."""
        time, tau = self.runs[k].time, self._filter_time(k)
        steps = np.diff(time)
        return Decay(steps, steps / tau), np.exp(-time / tau)


def _converged(minimum: Minimum) -> bool:
    return minimum.settled and bool(np.all(np.isfinite(minimum.values)))


def noise_of(run: Run) -> float:
    """Return the standard deviation (rad/s) that a ramp's speeds count with."""
    return max(run.noise, _EXACT * float(np.max(np.abs(run.speed))))


def _scatter(run: Run) -> float:
    """Return by how much one torque of a course scatters (N·m); a mean over some of them is off by less, and for as long."""
    return run.torque_noise * float(np.sqrt(run.readings)) if run.varies else 0.0
