"""Friction that grows at low speed: the estimates of ramps averaged over its laws and sizes, each as likely as the record has it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.mechanics.ramp_model import RampModel, Solved
from procedures.estimation.mechanics.ramp_terms import Stribeck

#: Laws exp(−(ω/ω_s)^n) where none is fitted: ω_s as shares of the top speed, evenly spread over their logarithm. By SKF's formula ω_s of
#: small bearings is 20 to 130 rad/s, which is any share of a top speed; above these shares it is Coulomb and viscous friction. n is 1.4
#: by SKF. Sources: SKF, Rolling bearings, "Effect of lubrication on sliding friction" (one source); of the law's form also Andersson,
#: Söderberg and Björklund, Tribology International 40 (2007) 580.
_SPEEDS, _POWERS = tuple(np.geomspace(0.02, 0.4, 7)), (1.0, 1.4, 2.0)
#: By SKF the coefficient of sliding friction is 0.05 in a full film and 0.15 without one, so that friction at rest is at most three times
#: the Coulomb friction. Of what is smaller nothing is known, not even the order of magnitude: the logarithm of a size is as likely
#: anywhere from a thousandth on, which no ramp shows.
_AT_REST, _LEAST = 2.0, 1e-3
#: Sizes of a law and of the air's friction that the sums are made of, and how far from the most likely one they go.
_SIZES, _AIR, _REACH = 41, 25, 5.0


@dataclass(frozen=True)
class StribeckLaw:
    """A law's friction in a fit of ramps, as a normal distribution.

    `amount` ± `spread` (N·m, rad/s² where torques are those over inertia); `values` (k,) of the shared estimates at that amount,
    `slope` (k,) what they change by for each N·m, `covariance` (k, k) of them at a known amount; `cost` is χ², `width` the part of the
    logarithm of the speeds that the law stands for.
    """

    amount: float
    spread: float
    values: FloatArray
    slope: FloatArray
    covariance: FloatArray
    cost: float
    width: float = 1.0


def unseen(model: RampModel, solved: Solved, shared: int) -> list[StribeckLaw]:
    """Return the laws of a fit without such friction, its first `shared` estimates changed by as little of it as to be linear."""
    at = [model.trajectory(k, solved.values) for k in range(len(model.runs))]
    laws = [Stribeck(share * model.top, power) for share in _SPEEDS for power in _POWERS]
    directions = np.zeros((len(laws), solved.residuals.size))
    for k, each in enumerate(at):
        torques = np.array([law.friction(each.speed) for law in laws])
        directions[:, model.part(k)] = -each.caused(torques / model.inertia(solved.values))
    directions[:, : model.spread.size] /= model.spread
    slopes = -directions @ solved.slopes.T @ solved.covariance
    across = directions + slopes @ solved.slopes
    seen = np.maximum(np.einsum("mn,mn->m", across, across), 1e-300)
    amounts = across @ solved.residuals / seen
    values, covariance = solved.values[:shared], solved.covariance[:shared, :shared]
    return [
        StribeckLaw(a, s**-0.5, values + a * slope, slope, covariance, -s * a**2)
        for a, s, slope in zip(amounts, seen, slopes[:, :shared], strict=True)
    ]


def fitted(model: RampModel, solved: Solved, shared: int, width: float) -> StribeckLaw:
    """Return the law of a fit with such friction in its model."""
    own = solved.covariance[model.stribeck_place]
    spread = float(np.sqrt(own[model.stribeck_place]))
    slope = own[:shared] / spread**2
    covariance = solved.covariance[:shared, :shared] - np.outer(slope, slope) * spread**2
    amount = model.amount("stribeck", solved.values)
    return StribeckLaw(amount, spread, solved.values[:shared], slope, covariance, solved.cost, width)


def average(laws: Sequence[StribeckLaw], coulomb: float, air: float) -> tuple[FloatArray, FloatArray]:
    """Return means (k,) and variances (k,) of the shared estimates, the last of them the quadratic friction.

    No friction of the air drives: a law is as likely as what it leaves of quadratic friction may be one. Its size is as unknown as the
    law's, up to `air`; the law's goes up to a multiple of `coulomb` (N·m).
    """
    amount, spread = np.array([law.amount for law in laws]), np.array([law.spread for law in laws])
    covariance = np.array([law.covariance for law in laws])
    most, least = _AT_REST * coulomb, _LEAST * coulomb
    low = np.minimum(np.maximum(least, amount - _REACH * spread), 0.5 * most)
    high = np.maximum(np.minimum(most, amount + _REACH * spread), 2.0 * low)
    sizes = low[:, None] * (high / low)[:, None] ** np.linspace(0.0, 1.0, _SIZES)
    # The smallest stands for none.
    sizes[low <= least, 0] = 0.0
    away = sizes - amount[:, None]
    values = (
        np.array([law.values for law in laws])[:, None]
        + away[..., None] * np.array([law.slope for law in laws])[:, None]
    )
    own = np.sqrt(np.maximum(np.diagonal(covariance, axis1=-2, axis2=-1), 1e-300))
    chance = -0.5 * (away / spread[:, None]) ** 2 + _of_air(values[..., -1], own[:, -1], air)
    # And as likely as there are other estimates that fit as well.
    volume = 0.5 * np.linalg.slogdet(covariance / (own[:, None, :] * own[:, :, None]))[1] + np.sum(
        np.log(own[:, :-1]), axis=1
    )
    stands_for = np.array([law.width for law in laws]) * np.log(high / low) / _SIZES
    logarithms = chance + (volume + np.log(stands_for) - 0.5 * np.array([law.cost for law in laws]))[:, None]
    weights = np.exp(logarithms - np.max(logarithms))
    weights /= np.sum(weights)
    mean = np.einsum("ls,lsk->k", weights, values)
    centred = (values - mean) ** 2 + own[:, None] ** 2
    return mean, np.einsum("ls,lsk->k", weights, centred)


def _of_air(quadratic: FloatArray, spread: FloatArray, most: float) -> FloatArray:
    """Return the logarithm of how likely (l, n) friction of the air is with estimates of it (l, n), any order of magnitude being so."""
    edges = np.append(0.0, np.geomspace(_LEAST, 1.0, _AIR)) * most / spread[:, None]
    within = np.diff(special.ndtr(edges[:, None] - (quadratic / spread[:, None])[..., None]), axis=-1)
    return np.asarray(np.log(np.maximum((within @ (1.0 / np.diff(edges))[..., None])[..., 0], 1e-300)))
