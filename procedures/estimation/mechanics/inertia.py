"""Inertia and friction from ramps of speed (§3.5, erratum E6)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from procedures.estimation.fitting.checks import Number, estimate_of, increasing, same_length, series
from procedures.estimation.fitting.first_order import respond, response_and_slope
from procedures.estimation.fitting.fit import EstimationError, Fit, FloatArray
from procedures.estimation.fitting.noise import undithered, white_noise
from procedures.estimation.fitting.nonlinear import Solution, solve

SHARED = ("inertia", "coulomb_friction", "viscous_friction")


class TwoPoint(NamedTuple):
    """Inertia (kg·m²) and no-load torque (N·m) by the note's two points on each ramp."""

    inertia: float
    no_load_torque: float


@dataclass(frozen=True)
class SpeedRamp:
    """One ramp: `time` (s), `speed` (rad/s, mechanical), shape (n,), and the driving `torque` (N·m): one value, or (n,).

    A coast-down has torque 0. `speed_resolution` (rad/s) is one step of the readings.
    """

    time: NDArray[np.float64]
    speed: NDArray[np.float64]
    torque: float | NDArray[np.float64] = 0.0
    speed_resolution: float = 0.0


@dataclass(frozen=True)
class _Run:
    """The part of a ramp that turns, in one direction: `driven` is the torque, `torque_noise` its level's uncertainty.

    `time` runs from 0; the part begins at `begin` (s) of the ramp.
    """

    begin: float
    time: FloatArray
    speed: FloatArray
    driven: FloatArray
    sign: float
    torque_noise: float
    resolution: float


def two_point(
    t1: float, w1: float, t2: float, w2: float, torque: float, t3: float, w3: float, t4: float, w4: float
) -> TwoPoint:
    """Solve J·Δω/Δt = Tm − T0 (accelerating) and J·Δω/Δt = −T0 (coasting) for J and T0 (§3.5; s, rad/s, N·m).

    Biased with viscous friction unless both ramps cover the same speeds (erratum E6). Raises EstimationError where the
    points contradict an acceleration followed by a coast-down.
    """
    if not all(np.isfinite(x) for x in (t1, w1, t2, w2, torque, t3, w3, t4, w4)):
        raise EstimationError("a point of the ramps is missing; take both points of both ramps")
    if t2 <= t1 or t4 <= t3:
        raise EstimationError("the second point of a ramp must be later than the first; check the times")
    driven, coasting = (w2 - w1) / (t2 - t1), (w4 - w3) / (t4 - t3)
    if torque == 0 or (driven - coasting) * np.sign(torque) <= 0:
        raise EstimationError(
            f"the driven ramp ({driven:g} rad/s²) is not steeper than the coast-down ({coasting:g} rad/s²) by the torque's "
            f"action ({torque:g} N·m); check the sign of the torque and the ramps"
        )
    inertia = torque / (driven - coasting)
    return TwoPoint(float(inertia), float(-inertia * coasting))


def _turning(ramp: SpeedRamp, number: int) -> _Run:
    """Cut standstill off both ends and check that the rest turns one way."""
    time = series(f"time of ramp {number}", ramp.time, least=5)
    speed = series(f"speed of ramp {number}", ramp.speed, least=5)
    same_length(time=time, speed=speed)
    increasing(time)
    top = float(np.max(np.abs(speed)))
    if top == 0 or np.ptp(speed) <= max(3 * ramp.speed_resolution, 1e-9 * top):
        raise EstimationError(f"the speed of ramp {number} does not change; record while it accelerates or coasts")
    sign = float(np.sign(speed[np.argmax(np.abs(speed))]))
    noise = white_noise(speed, ramp.speed_resolution)
    turning = sign * speed > max(0.02 * top, 5 * noise)
    # The longest stretch that turns: what lies outside is standstill, where friction holds instead of braking.
    edges = np.flatnonzero(np.diff(np.concatenate(([0], turning.astype(np.int8), [0]))))
    begins, ends = edges[::2], edges[1::2]
    longest = int(np.argmax(ends - begins)) if begins.size else 0
    part = slice(int(begins[longest]), int(ends[longest])) if begins.size else slice(0, 0)
    if part.stop - part.start < 5:
        raise EstimationError(f"ramp {number} has fewer than 5 points that turn; sample faster or ramp more slowly")
    torque = np.asarray(ramp.torque, dtype=np.float64)
    torque_noise = 0.0
    if torque.ndim:
        torque = series(f"torque of ramp {number}", torque)
        same_length(time=time, torque=torque)
        torque = torque[part]
        scatter = white_noise(torque)
        torque_noise = scatter / np.sqrt(torque.size)
        if np.std(torque) <= 1.3 * scatter:
            torque = np.full_like(torque, np.mean(torque))
    elif not np.isfinite(torque):
        raise EstimationError(f"the torque of ramp {number} is not a number; enter it, or 0 for a coast-down")
    else:
        torque = np.full(part.stop - part.start, float(torque))
    begin = float(time[part][0])
    return _Run(begin, time[part] - begin, speed[part], torque, sign, torque_noise, ramp.speed_resolution)


def _integral(time: FloatArray, values: FloatArray) -> FloatArray:
    return np.append(0.0, np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time)))


def _solve_runs(
    runs: Sequence[_Run], start: FloatArray, names: tuple[str, ...], unit_torque: bool
) -> tuple[Solution, FloatArray, FloatArray]:
    """Fit all ramps: shared J, Tc, B (Tc/J, B/J with `unit_torque`), one initial speed a ramp, one torque error a noisy ramp."""
    shared = 2 if unit_torque else 3
    noisy = [k for k, run in enumerate(runs) if run.torque_noise > 0]
    spread = [max(white_noise(r.speed, r.resolution), 1e-9 * float(np.max(np.abs(r.speed)))) for r in runs]
    measured = np.concatenate([run.speed for run in runs])
    sizes = np.concatenate([np.full(run.speed.size, s) for run, s in zip(runs, spread, strict=True)])
    points = measured.size

    def model(p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the speeds of all ramps and their derivatives (k, n) by the parameters."""
        inertia, coulomb, viscous = (1.0, p[0], p[1]) if unit_torque else (p[0], p[1], p[2])
        speeds, slopes, at = np.empty(points), np.zeros((p.size, points)), 0
        for k, run in enumerate(runs):
            part = slice(at, at + run.time.size)
            at = part.stop
            error = p[shared + len(runs) + noisy.index(k)] if k in noisy else 0.0
            drive = (run.driven + error - coulomb * run.sign) / inertia
            speeds[part], by_rate = response_and_slope(run.time, drive, viscous / inertia, p[shared + k])
            by_torque = respond(run.time, np.full_like(drive, 1.0 / inertia), viscous / inertia)
            left = np.exp(-viscous / inertia * run.time)
            if not unit_torque:
                slopes[0, part] = -(speeds[part] - p[shared + k] * left + viscous / inertia * by_rate) / inertia
            slopes[shared - 2, part] = -run.sign * by_torque
            slopes[shared - 1, part] = by_rate / inertia
            slopes[shared + k, part] = left
            if k in noisy:
                slopes[shared + len(runs) + noisy.index(k), part] = by_torque
        return speeds, slopes

    def evaluate(p: FloatArray) -> tuple[FloatArray, FloatArray]:
        speeds, slopes = model(p)
        # What the readings tell of a torque's level beside the speeds.
        known = np.zeros((p.size, len(noisy)))
        known[shared + len(runs) :] = np.diag([1.0 / runs[k].torque_noise for k in noisy])
        return np.append((measured - speeds) / sizes, p @ known), np.hstack((-slopes / sizes, known))

    begin = np.concatenate((start, [run.speed[0] for run in runs], np.zeros(len(noisy))))
    size = float(np.max(np.abs(start[: shared - 1]))) or 1.0
    top = max(float(np.max(np.abs(run.speed))) for run in runs)
    scale = np.concatenate(
        (
            [abs(start[0]) or size] if not unit_torque else [],
            [abs(start[-2]) or size, max(abs(start[-1]), 0.05 * abs(start[-2]) / top)],
            [0.01 * top] * len(runs),
            [runs[k].torque_noise for k in noisy],
        )
    )
    solution = solve(evaluate, begin, scale, (*names, "initial speeds"))
    left = measured - model(solution.values)[0]
    freedom = points - shared - len(runs)
    if freedom < 1:
        raise EstimationError(f"{points} speeds do not suffice; sample the ramps faster")
    covariance = max(1.0, solution.cost / freedom) * solution.covariance
    position = 0
    for run, s in zip(runs, spread, strict=True):
        # Speeds that jump in steps larger than their noise may be off for a good part of the ramp.
        rows = np.zeros(solution.gain.shape[1])
        rows[position : position + run.speed.size] = undithered(s, run.resolution) / s / np.sqrt(_steps(run))
        covariance = covariance + np.outer(solution.gain @ rows, solution.gain @ rows)
        position += run.speed.size
    return solution, covariance, left


def _steps(run: _Run) -> float:
    """Return how many steps of the readings the ramp crosses: over each, the rounding error runs through its range."""
    return max(float(np.ptp(run.speed)) / run.resolution, 1.0) if run.resolution > 0 else 1.0


def _fit(runs: Sequence[_Run], start: FloatArray, names: tuple[str, ...], unit_torque: bool) -> Fit:
    solution, covariance, left = _solve_runs(runs, start, names, unit_torque)
    count = len(names) + len(runs)
    every = names + (("initial_speed",) if unit_torque else tuple(f"initial_speed_{k + 1}" for k in range(len(runs))))
    return Fit(
        every,
        solution.values[:count],
        covariance[:count, :count],
        float(left.size - count),
        left,
        float(np.sqrt(np.mean(left**2))),
    )


def fit_ramps(ramps: Sequence[SpeedRamp]) -> Fit:
    """Fit `inertia` (kg·m²), `coulomb_friction` (N·m), `viscous_friction` (N·m·s/rad) to whole ramps together.

    Exact solution of J·dω/dt = T − Tc·sign(ω) − B·ω; also `initial_speed_1` … one a ramp. Standstill at the ends is left out.
    Needs a driven ramp and one with another torque, as a coast-down. A torque given as a series enters by its mean where it
    only scatters, else straight between its points; its scatter is part of the uncertainty.
    Raises EstimationError where the ramps do not determine all three.
    """
    if not ramps:
        raise EstimationError("there is no ramp to fit; record one driven ramp and one coast-down")
    runs = [_turning(ramp, k + 1) for k, ramp in enumerate(ramps)]
    if not any(np.any(run.driven) for run in runs):
        raise EstimationError(
            "no ramp has a driving torque, so inertia and friction cannot be told apart; add a driven ramp"
        )
    rows, data = [], []
    for k, run in enumerate(runs):
        own = np.zeros((run.time.size, len(runs)))
        own[:, k] = 1.0
        rows.append(
            np.column_stack(
                (_integral(run.time, run.driven), -run.sign * run.time, -_integral(run.time, run.speed), own)
            )
        )
        data.append(run.speed)
    design = np.vstack(rows)
    scale = np.sqrt(np.mean(design**2, axis=0))
    solution, _, rank, s = np.linalg.lstsq(design / scale, np.concatenate(data), rcond=None)
    solution = solution / scale
    if rank < design.shape[1] or s[-1] < 1e-7 * s[0]:
        raise EstimationError(
            "the ramps do not tell torque and friction apart; add a coast-down, or ramps at another torque"
        )
    if not solution[0] > 0:
        raise EstimationError(
            "the speed falls as the torque drives: the torque's sign is reversed, or ramps are interchanged"
        )
    return _fit(runs, np.array([1.0, solution[1], solution[2]]) / solution[0], SHARED, False)


def fitted_speeds(ramps: Sequence[SpeedRamp], fit: Fit) -> list[tuple[FloatArray, FloatArray]]:
    """Return for each ramp that was fitted the times (s) and the fitted speeds (rad/s) of the part that turns."""
    found, taken = [], 0
    for k, ramp in enumerate(ramps):
        run = _turning(ramp, k + 1)
        left = fit.residuals[taken : taken + run.speed.size]
        taken += run.speed.size
        found.append((run.begin + run.time, run.speed - left))
    return found


def fit_coast_down(time: ArrayLike, speed: ArrayLike, *, speed_resolution: float = 0.0) -> Fit:
    """Fit `coulomb_deceleration` = Tc/J (rad/s²), `viscous_rate` = B/J (1/s) and `initial_speed` to a coast-down (s, rad/s).

    Raises EstimationError where the speed does not fall.
    """
    ramp = SpeedRamp(np.asarray(time, dtype=np.float64), np.asarray(speed, dtype=np.float64), 0.0, speed_resolution)
    run = _turning(ramp, 1)
    edge = max(1, run.speed.size // 10)
    if run.sign * (np.mean(run.speed[-edge:]) - np.mean(run.speed[:edge])) >= 0:
        raise EstimationError("the speed does not fall; cut the record to the coast-down")
    design = np.column_stack((-run.sign * run.time, -_integral(run.time, run.speed), np.ones_like(run.time)))
    scale = np.sqrt(np.mean(design**2, axis=0))
    solution, *_ = np.linalg.lstsq(design / scale, run.speed, rcond=None)
    return _fit([run], solution[:2] / scale[:2], ("coulomb_deceleration", "viscous_rate"), True)


def torque_from_power(power: ArrayLike, speed: ArrayLike) -> float:
    """Return the constant torque (N·m) behind shaft power (W) over mechanical speed (rad/s), both of shape (n,) (erratum E5).

    Fast readings count most, for at low speed the power says little of it. Raises EstimationError where nothing turns.
    """
    p, w = series("power", power), series("speed", speed)
    same_length(power=p, speed=w)
    if not np.any(w):
        raise EstimationError("the shaft stands still, so its power says nothing of the torque; record while it turns")
    return float(p @ w) / float(w @ w)


def subtract_tare(coupled: Mapping[str, Number], tare: Mapping[str, Number]) -> dict[str, Number]:
    """Return inertia and friction (by the names in `SHARED`) of the motor alone, `tare` being the dynamometer and the coupling.

    Raises EstimationError where the tare's inertia is not below that of the coupled set.
    """
    if not tare["inertia"] < coupled["inertia"]:
        raise EstimationError(
            f"the inertia of dynamometer and coupling, {estimate_of(tare['inertia']):g} kg·m², is not below that of the coupled set, "
            f"{estimate_of(coupled['inertia']):g} kg·m²; check that the motor was coupled for the second run only"
        )
    return {name: coupled[name] - tare[name] for name in SHARED}
