"""Tests of ramps for effects beyond inertia and friction, and the terms that explain them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Cause, Score, score_test
from procedures.estimation.fitting.noise import undithered
from procedures.estimation.mechanics.ramp_model import RampModel, Solved, noise_of
from procedures.estimation.mechanics.ramp_terms import FrictionDrift, Stribeck, Terms
from procedures.estimation.mechanics.turning import Run

#: Speeds of the Stribeck term that are looked for, shares of the top speed, and those that are fitted, by both laws.
_STRIBECK_SEEN = (0.03, 0.1, 0.25)
_STRIBECK_FITTED, _POWERS = (0.02, 0.035, 0.06, 0.1, 0.16, 0.25, 0.35, 0.5, 0.7), (1.0, 2.0)
_FILTERS_SEEN, _FILTERS_FITTED = 3, 12
#: A filter is fitted from this share of the shortest that is looked for, so that one as short is between two that are tried.
_SHORTER = 0.65
#: A filter is fitted with time constants up to this share of the longest ramp: by a bench's longest, slow beside a light shaft's ramps.
_FILTER_FITTED = 0.8
#: Time constants of friction that drifts which are looked for, and those that are fitted, shares of the time that the shaft turns: with
#: the longest it drifts in as good as a straight line.
_DRIFT_SEEN, _DRIFT_FITTED = (0.3, 3.0), (0.08, 0.15, 0.27, 0.5, 0.9, 1.6, 5.0)
#: So much of the square by which a drift is seen is taken for chance.
_CHANCE_OF_DRIFT = 4.0
#: Orders of the shaft's angle that are looked for, and how often chance alone may find one of them.
_ORDERS, _CHANCE = 120, 1e-3
#: From this order on it is cogging, below it a coupling or an encoder that runs out.
_COGGING = 4
#: Powers of the speed that an encoder's run-out is shown with: a mean or a filter of its reading fades and turns it as the shaft is
#: faster, which shows where the run-out is seen by so many standard deviations.
_FADING, _FADES = (1, 2, 3), 12.0


@dataclass(frozen=True)
class Look:
    """Evaluation of the directions: `causes` (m,) by name, and their `score`."""

    causes: tuple[Cause, ...]
    score: Score

    def clearest(self, cause: Cause | None = None) -> float:
        """Return the score farthest from chance, of a cause or of all; 0 where none was looked for."""
        z = [value for name, value in zip(self.causes, self.score.z, strict=True) if cause in (None, name)]
        return float(max(z, key=abs)) if z else 0.0

    def growth(self) -> FloatArray:
        """Return by what each estimate's variance grows (k,) for what is not seen clearly enough to be in the model.

        Friction that grows at low speed is averaged over elsewhere, and adds nothing here. Of friction that drifts a small part counts many
        times, so only what is beyond most of chance adds.
        """
        drifts = [k for k, cause in enumerate(self.causes) if cause is Cause.FRICTION_DRIFT]
        others = [k for k, cause in enumerate(self.causes) if cause is not Cause.STRIBECK and k not in drifts]
        plain = self._of(others).growth()
        return np.maximum(plain, self._of(drifts).growth(chance=_CHANCE_OF_DRIFT)) if drifts else plain

    def _of(self, places: Sequence[int]) -> Score:
        return replace(self.score, z=self.score.z[places], bias=self.score.bias[places])


@dataclass(frozen=True)
class Periodic:
    """Something that comes again so many times (`order`) a turn, its size `falling` with the speed or growing with it.

    `between` two readings the shaft turns by so much (rad) on average: an order of more than half a period there may be another one.
    """

    order: int
    falling: bool
    score: float
    shapes: tuple[FloatArray, ...]
    between: float

    @property
    def cause(self) -> Cause:
        """Likely cause."""
        return Cause.COGGING if self.order >= _COGGING else Cause.ECCENTRICITY


def look(model: RampModel, solved: Solved) -> Look:
    """Test the fit for what its model does not hold."""
    causes: list[Cause] = []
    directions: list[FloatArray] = []
    at = [model.trajectory(k, solved.values) for k in range(len(model.runs))]
    inertia = model.inertia(solved.values)

    def add(cause: Cause, shapes: dict[int, FloatArray]) -> None:
        whole = np.zeros(solved.residuals.size)
        for k, shape in shapes.items():
            whole[model.part(k)] = shape
        whole[: model.spread.size] /= model.spread
        causes.append(cause)
        directions.append(whole)

    if model.terms.stribeck is None:
        for share in _STRIBECK_SEEN:
            law = Stribeck(share * model.top, 1.0)
            shapes = {k: each.caused(-law.friction(each.speed) / inertia) for k, each in enumerate(at)}
            add(Cause.STRIBECK, shapes)
    for drift in _drifts(model):
        for share in _DRIFT_SEEN:
            law_of_time = replace(drift, time=share * drift.end)
            falls = [law_of_time.fall(model.turned[k], each.speed) for k, each in enumerate(at)]
            shapes = {k: each.caused(fall / inertia) for k, (each, fall) in enumerate(zip(at, falls, strict=True))}
            add(Cause.FRICTION_DRIFT, shapes)
    for k, run in enumerate(model.runs):
        if not (run.speed_filter or model.terms.filters_speed):
            for tau in filter_times(run, _FILTERS_SEEN):
                add(Cause.SPEED_FILTER, {k: np.exp(-run.time / tau)})
        if run.varies and not model.terms.torque_filter:
            add(Cause.TORQUE_FILTER, {k: model.later(k, at[k], inertia)})
    if not directions:
        return Look((), Score(np.zeros(0), np.zeros((0, model.size))))
    # Speeds that stay in one step of the readings share its rounding error.
    coarse = max((undithered(noise_of(run), run.resolution) / noise_of(run)) ** 2 * _stay(run) for run in model.runs)
    return Look(tuple(causes), score_test(solved.residuals, solved.slopes, np.array(directions), variance=1.0 + coarse))


def _stay(run: Run) -> float:
    """Return how many speeds in a row are one step of the readings, on average."""
    return run.speed.size / (1.0 + np.count_nonzero(np.diff(run.speed)))


def filter_times(run: Run, count: int, longest: float = 0.25) -> FloatArray:
    """Return time constants (s) from three readings to a share of a ramp, a quarter unless another is the `longest`."""
    shortest = 3.0 * float(run.time[-1]) / run.time.size
    return np.geomspace(shortest, max(longest * float(run.time[-1]), 2.0 * shortest), count)


@dataclass(frozen=True)
class Family:
    """Terms that stand for one cause; `grid` (m,) are values of what is no parameter of the fit, a speed or a time, one where none is."""

    cause: Cause
    grid: FloatArray
    terms: Terms
    law: Stribeck | FrictionDrift | None = None
    shapes: tuple[FloatArray, ...] = ()

    def at(self, value: float | FloatArray) -> Terms:
        """Return the terms at a value of the grid, or between; at several values (m, 1) those of so many fits."""
        if isinstance(self.law, Stribeck):
            return replace(self.terms, stribeck=replace(self.law, speed=value))
        if isinstance(self.law, FrictionDrift):
            return replace(self.terms, drift=replace(self.law, time=value))
        if self.cause is Cause.SPEED_FILTER:
            return replace(self.terms, speed_filter=value)
        if self.cause is Cause.TORQUE_FILTER:
            return replace(self.terms, torque_filter=True)
        return replace(self.terms, added=(*self.terms.added, *self.shapes))


def families(model: RampModel, found: Periodic | None) -> Iterator[Family]:
    """Give for each cause that is not in the model yet the terms that may stand for it."""
    terms, one = model.terms, np.ones(1)
    if terms.stribeck is None:
        for power in _POWERS:
            yield Family(Cause.STRIBECK, model.top * np.array(_STRIBECK_FITTED), terms, Stribeck(model.top, power))
    for law in _drifts(model):
        yield Family(Cause.FRICTION_DRIFT, law.end * np.array(_DRIFT_FITTED), terms, law)
    free = [run for run in model.runs if not run.speed_filter]
    if free and not terms.filters_speed:
        longest = max(filter_times(run, 2, _FILTER_FITTED)[1] for run in free)
        shortest = _SHORTER * min(filter_times(run, 2)[0] for run in free)
        yield Family(Cause.SPEED_FILTER, np.geomspace(shortest, longest, _FILTERS_FITTED), terms)
    if not terms.torque_filter and any(run.varies for run in model.runs):
        yield Family(Cause.TORQUE_FILTER, one, terms)
    if found is not None:
        yield Family(found.cause, one, terms, shapes=found.shapes)


def _drifts(model: RampModel) -> list[FrictionDrift]:
    """Return the laws of friction that drifts; none where one is in the model, or where the shaft passes each speed only once."""
    if model.terms.drift is not None or len(model.runs) < 2:
        return []
    end = float(model.turned[-1][-1])
    return [FrictionDrift(end, end, top) for top in (0.0, model.top)]


def periodic(model: RampModel, solved: Solved) -> Periodic | None:
    """Return what comes again with the shaft's angle more than chance has it, where anything does.

    A torque that comes again so many times a turn moves the speed by as much less as the shaft is faster; a sensor that is not centred
    by as much more.
    """
    count = len(model.runs)
    power = np.zeros((2, _ORDERS))
    for k, run in enumerate(model.runs):
        part = model.part(k)
        speed = solved.speeds[part]
        angle = _angle(run, speed)
        weights = np.array(_weights(speed))
        left = (weights * solved.residuals[part]).astype(complex)
        turn, power_of = np.exp(1j * angle), np.ones(angle.size, complex)
        sums = np.empty_like(power, complex)
        for order in range(_ORDERS):
            power_of *= turn
            sums[:, order] = left @ power_of
        power += np.abs(sums) ** 2 / (0.5 * np.sum(weights**2, axis=1, keepdims=True))
    limit = float(special.chdtri(2 * count, _CHANCE / power.size))
    row, place = divmod(int(np.argmax(power)), _ORDERS)
    score = float(power[row, place])
    if score <= limit:
        return None
    order = place + 1
    fading = _FADING if row and order < _COGGING and score > _FADES**2 else (1,)
    shapes = []
    for multiple, grown in [*((order, grown) for grown in fading), (2 * order, 1)]:
        for k, run in enumerate(model.runs):
            part = model.part(k)
            speed = solved.speeds[part]
            turning = np.exp(1j * multiple * _angle(run, speed)) * _weights(speed)[row] ** grown * noise_of(run)
            for shape in (turning.real, turning.imag):
                whole = np.zeros(model.measured.size)
                whole[part] = shape
                shapes.append(whole)
    turned = sum(float(_angle(run, solved.speeds[model.part(k)])[-1]) for k, run in enumerate(model.runs))
    return Periodic(order, row == 0, float(np.sqrt(score)), tuple(shapes), abs(turned) / model.measured.size)


def _weights(speed: FloatArray) -> tuple[FloatArray, FloatArray]:
    largest = float(np.max(np.abs(speed)))
    return 0.05 * largest / np.maximum(np.abs(speed), 0.02 * largest), np.abs(speed) / largest


def _angle(run: Run, speed: FloatArray) -> FloatArray:
    return np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(run.time)))


def scatter_of_parts(model: RampModel, solved: Solved) -> float:
    """Return how probable it is by chance that the residuals' sums over fifths of each ramp are as large."""
    rows = []
    for k in range(len(model.runs)):
        for places in np.array_split(np.arange(model.edges[k], model.edges[k + 1]), 5):
            row = np.zeros(solved.residuals.size)
            row[places] = 1.0 / np.sqrt(max(places.size, 1))
            rows.append(row)
    sums = np.array(rows)
    across = sums - sums @ solved.slopes.T @ solved.covariance @ solved.slopes
    sizes, directions = np.linalg.eigh(across @ across.T)
    told = sizes > 1e-3
    components = directions[:, told].T @ across @ solved.residuals
    freedom = max(int(np.count_nonzero(told)), 1)
    return float(special.chdtrc(float(freedom), float(np.sum(components**2 / sizes[told]))))


def excess(
    values: Sequence[FloatArray], variances: Sequence[FloatArray], at: FloatArray, own: FloatArray
) -> FloatArray:
    """Return how far estimates (k,) from parts of the record lie off, beyond what their variances allow for."""
    off = [np.square(v - at) - np.maximum(u - own, 0.0) for v, u in zip(values, variances, strict=True)]
    return np.sqrt(np.maximum(np.max(off, axis=0), 0.0)) if off else np.zeros_like(at)
