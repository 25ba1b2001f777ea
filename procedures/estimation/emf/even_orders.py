"""Detects a non-linear channel by harmonics of even order in the voltages of a turning machine, which no winding causes."""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import special

from procedures.estimation.emf.folding import PARTS, Folded, flux_waves
from procedures.estimation.emf.harmonics import HarmonicModel
from procedures.estimation.emf.record import DigitizedChannel, usable
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from procedures.estimation.fitting.noise import undithered

#: Even orders that are looked at, and the odd ones of a machine that would leak into them.
_EVEN, _ODD = (2, 4, 6, 8, 10, 12), (9, 11, 13, 15, 17)
#: They are seen where chance gives them once in so many records, and told from this share of the fundamental on.
_CHANCE, _LEAST = 1e-5, 1e-3
#: A channel whose two polarities have unequal gains moves the fundamental by 2.3 times all its even orders: less than twice the standard
#: uncertainty.
_TO_FUNDAMENTAL = 1.4


def find_bend(
    t: FloatArray,
    kept: Sequence[int],
    model: HarmonicModel,
    channels: Sequence[DigitizedChannel],
    shared: FloatArray,
    whole: NDArray[np.bool_],
) -> tuple[FloatArray, tuple[Finding, ...]]:
    """Return the uncertainty of the fundamental flux (C,), V·s/rad, because of a non-linear channel, and the findings.

    Half a turn of a pair of poles later a winding sees the same flux reversed, so that even orders come from probe, amplifier or
    converter; what these do to the fundamental, which does not show, is of their size. So many readings as `shared` (C,) says share one
    rounding error. `whole` (C,) are channels all of whose readings
    are the record's own: where the model stands for one side's, even orders are its doing.
    """
    nothing = np.zeros(len(channels)), ()
    course = np.array([0.0, *model.course[1:]])
    odd = tuple(order for order in _ODD if order not in kept)
    orders = usable(t, (*kept, *(order for order in _EVEN if order not in kept), *odd), course)
    even = [place for place, order in enumerate(orders) if order in _EVEN and order not in kept]
    if not even:
        return nothing
    speed = float(model.speed(np.array([model.middle]))[0])
    # Two turns, over which half orders close as well.
    folded, basis = Folded.over(t, model.residuals, model, 2), flux_waves(orders, 2)
    # Readings at few places of a turn cannot tell an even order from an odd one beyond them.
    places = int(np.count_nonzero(folded.counts.reshape(2, PARTS).sum(axis=0)))
    size = 1 + basis.shape[0]
    if places < 2 * size:
        return nothing
    normal, along = folded.products(basis)
    inverse = np.linalg.inv(normal)
    values = along @ inverse
    squares = np.einsum("cn,cn->c", model.residuals, model.residuals) - np.sum(values * along, axis=1)
    noise = np.sqrt(np.maximum(squares, 0.0) / (t.size - size))
    # Nothing that repeats itself lies at half orders: what is there has leaked, or is the alias of an order beyond the sampling.
    halves = folded.left(values, basis) @ _half_waves() * (2.0 / t.size)
    leaked = np.mean(np.abs(halves) ** 2, axis=1) / 2.0
    count = len(orders)
    chosen = [1 + part * count + place for part in (0, 1) for place in even]
    volts = np.array(orders)[even] * speed
    sizes = values[:, chosen] * np.tile(volts, 2)
    spread = np.hypot(
        np.sqrt(np.diag(inverse))[chosen] * np.tile(volts, 2) * (noise * np.sqrt(shared))[:, None],
        np.sqrt(leaked)[:, None],
    )
    amplitudes = np.abs(model.flux[:, list(kept).index(1)]) * speed
    steps = [undithered(float(n), c.resolution) for n, c in zip(noise, channels, strict=True)]
    power = np.sum((sizes / spread) ** 2, axis=1)
    beyond = np.sqrt(np.maximum(np.sum(sizes**2 - spread**2, axis=1), 0.0))
    limit = float(special.chdtri(len(chosen), _CHANCE / len(channels)))
    bent = whole & (power > limit) & (beyond > np.maximum(_LEAST * amplitudes, 2.0 * np.array(steps)))
    if not bent.any():
        return nothing
    worst = int(np.argmax(np.where(bent, beyond / amplitudes, 0.0)))
    figures: dict[str, float | str] = {
        "channel": channels[worst].name,
        "share": float(beyond[worst] / amplitudes[worst]),
    }
    finding = Finding(Cause.DISTORTION, Answer.WIDENED, ("flux_linkage",), float(np.sqrt(power[worst])), figures)
    return _TO_FUNDAMENTAL * np.where(bent, beyond, 0.0) / speed, (finding,)


@cache
def _half_waves() -> NDArray[np.complex128]:
    """Return the waves that lie half an order above each even one, (2P, E)."""
    centre = (np.arange(2 * PARTS) + 0.5) * (2.0 * np.pi / PARTS)
    return np.asarray(np.exp(-1j * np.outer(centre, np.array(_EVEN) + 0.5)), dtype=np.complex128)
