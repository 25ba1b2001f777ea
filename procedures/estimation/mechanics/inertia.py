"""Inertia and friction from ramps of speed (§3.5, erratum E6)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import Number, estimate_of, same_length, series
from procedures.estimation.fitting.fit import EstimationError, Fit, FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.mechanics.ramp_fit import explain
from procedures.estimation.mechanics.turning import Run, SpeedRamp, turning

SHARED = ("inertia", "coulomb_friction", "viscous_friction")
#: What a fan and the air take: torque over the square of speed (N·m·s²).
QUADRATIC = "quadratic_friction"


class TwoPoint(NamedTuple):
    """Inertia (kg·m²) and no-load torque (N·m) by the note's two points on each ramp."""

    inertia: float
    no_load_torque: float


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


def _integral(time: FloatArray, values: FloatArray) -> FloatArray:
    return np.append(0.0, np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time)))


def _fit(runs: Sequence[Run], start: FloatArray, names: tuple[str, ...], *, unit_torque: bool) -> Fit:
    fit = explain(runs, start, unit_torque=unit_torque)
    alone = unit_torque and len(runs) == 1
    firsts = ("initial_speed",) if alone else tuple(f"initial_speed_{k + 1}" for k in range(len(runs)))
    # The quadratic friction stands last, behind the initial speeds, which turn the way the shaft does.
    count = len(names)
    order = np.array([*range(count - 1), *range(count, count + len(runs)), count - 1])
    signs = np.concatenate((np.ones(count - 1), [run.sign for run in runs], [1.0]))
    forwards = np.concatenate([np.full(run.speed.size, run.sign) for run in runs])
    left = forwards * (np.concatenate([run.speed for run in runs]) - fit.speeds)
    return Fit(
        (*names[:-1], *firsts, names[-1]),
        fit.values[order] * signs,
        fit.covariance[np.ix_(order, order)] * np.outer(signs, signs),
        float(fit.freedom),
        left,
        float(np.sqrt(np.mean(left**2))),
        misfit=fit.misfit,
    )


def fit_ramps(ramps: Sequence[SpeedRamp]) -> Fit:
    """Fit `inertia` (kg·m²), `coulomb_friction` (N·m), `viscous_friction` (N·m·s/rad) to whole ramps together.

    Exact solution of J·dω/dt = T − Tc·sign(ω) − B·ω − c·ω·|ω|; also `initial_speed_1` … one a ramp, and `quadratic_friction` (N·m·s²).
    Standstill at the ends and wild readings are left out; what else the ramps show (Stribeck, filters, cogging) stands in `misfit`.
    Needs a driven ramp and one with another torque, as a coast-down. A torque given as a series enters by its mean where it
    only scatters, else straight between its points; its scatter is part of the uncertainty.
    Raises EstimationError where the ramps do not determine all three.
    """
    if not ramps:
        raise EstimationError("there is no ramp to fit; record one driven ramp and one coast-down")
    runs = [turning(ramp, k + 1) for k, ramp in enumerate(ramps)]
    if not any(np.any(run.driven) for run in runs):
        raise EstimationError(
            "no ramp has a driving torque, so inertia and friction cannot be told apart; add a driven ramp"
        )
    rows, data = [], []
    for k, run in enumerate(runs):
        own = np.zeros((run.time.size, len(runs)))
        own[:, k] = 1.0
        rows.append(np.column_stack((_integral(run.time, run.driven), -run.time, -_integral(run.time, run.speed), own)))
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
    return _fit(runs, np.array([1.0, solution[1], solution[2]]) / solution[0], (*SHARED, QUADRATIC), unit_torque=False)


def fitted_speeds(ramps: Sequence[SpeedRamp], fit: Fit) -> list[tuple[FloatArray, FloatArray]]:
    """Return for each ramp that was fitted the times (s) and the fitted speeds (rad/s) of the part that turns."""
    found, taken = [], 0
    for k, ramp in enumerate(ramps):
        run = turning(ramp, k + 1)
        left = fit.residuals[taken : taken + run.speed.size]
        taken += run.speed.size
        found.append((run.begin + run.time, run.sign * run.speed - left))
    return found


def fit_coast_downs(ramps: Sequence[SpeedRamp]) -> Fit:
    """Fit `coulomb_deceleration` = Tc/J (rad/s²), `viscous_rate` = B/J (1/s) and initial speeds to coast-downs in the order they were made.

    Also `quadratic_rate` = c/J (1/rad). From two on, friction that drifts as they go on is told. Where the whole interval of a
    friction is negative, or the Coulomb friction beside friction that grows at low speed, both are withheld: no bearing drives. Raises
    EstimationError where a speed does not fall.
    """
    runs = [turning(ramp, k + 1) for k, ramp in enumerate(ramps)]
    rows = []
    for k, run in enumerate(runs):
        edge = max(1, run.speed.size // 10)
        if np.mean(run.speed[-edge:]) >= np.mean(run.speed[:edge]):
            raise EstimationError("the speed does not fall; cut the record to the coast-down")
        own = np.zeros((run.time.size, len(runs)))
        own[:, k] = 1.0
        rows.append(np.column_stack((-run.time, -_integral(run.time, run.speed), own)))
    design = np.vstack(rows)
    scale = np.sqrt(np.mean(design**2, axis=0))
    solution, *_ = np.linalg.lstsq(design / scale, np.concatenate([run.speed for run in runs]), rcond=None)
    names = ("coulomb_deceleration", "viscous_rate", "quadratic_rate")
    fit = _fit(runs, solution[:2] / scale[:2], names, unit_torque=True)
    below = [name for name in names[:2] if fit.interval(name)[1] < 0.0]
    if any(each.cause is Cause.STRIBECK for each in fit.misfit.findings) and fit.value(names[0]) < 0.0:
        # Friction at rest is at most a few times the Coulomb friction.
        below = [names[0]]
    if below and not fit.misfit.withholding(below[0]):
        figures: dict[str, float | str] = {"record": "coast", "below": below[0]}
        impossible = Misfit((Finding(Cause.UNEXPLAINED, Answer.WITHHELD, names[:2], figures=figures),))
        fit = replace(fit, misfit=Misfit.together((impossible, fit.misfit)))
    return fit


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
        off = estimate_of(tare["inertia"]) - estimate_of(coupled["inertia"])
        unknown = 2.0 * math.hypot(*(float(getattr(each["inertia"], "u", 0.0)) for each in (tare, coupled)))
        if off < unknown:
            raise EstimationError(
                f"the inertia of dynamometer and coupling alone is not told from that of the coupled set: their difference is known "
                f"to {unknown:.2g} kg·m² only. Something disturbs torque or speed (see the plots of the "
                "ramps): a sensor out of centre, vibration, a filter; or the motor's inertia is too small for this dynamometer"
            )
        raise EstimationError(
            f"the inertia of dynamometer and coupling, {estimate_of(tare['inertia']):g} kg·m², is not below that of the coupled set, "
            f"{estimate_of(coupled['inertia']):g} kg·m²; check that the motor was coupled for the second run only"
        )
    return {name: coupled[name] - tare[name] for name in SHARED}
