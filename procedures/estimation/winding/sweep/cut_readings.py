"""Inductance readings that stand at an end of the bridge's range while the rotor turns on."""

from collections.abc import Sequence

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from procedures.estimation.fitting.noise import white_noise

#: So many equal readings at an extreme may be an end of the range.
_LEAST = 3
#: Where equal readings are a crest that the steps made flat, those twice as far beyond it lie so many steps below it at most.
_PARABOLA, _DEVIATIONS = 9.0, 4.0
#: Readings that scatter about an end stay within so many deviations of the largest; a hand that slows at a crest bends it so much less.
_SCATTER, _SLOWER = 6.0, 12.0
#: Readings on crests leave less than this share of their squares beside a parabola each; scatter leaves half and more.
_ON_CRESTS = 0.2


def cut_off(values: FloatArray, resolution: float) -> tuple[Finding, ...]:
    """Return that readings (H, (n,)), one after the other, are cut off at their largest or smallest value, where they are.

    Equal readings at an extreme are a flat crest or a cut one: beside a flat one the next readings lie near it, as on a parabola.
    Where the end lies before what scatters, readings within the scatter count as equal.
    """
    noise = white_noise(values, resolution)
    near = resolution + _SCATTER * noise
    lost = 0
    for sign in (1.0, -1.0):
        risen = sign * values
        equal = max(0.5 * resolution, 1e-12 * float(abs(np.max(risen))))
        lost += _flat(risen, equal, _PARABOLA * resolution + _DEVIATIONS * noise) or _flat(risen, near, _SLOWER * near)
    if not lost:
        return ()
    figures: dict[str, float | str] = {"channel": "inductance", "lost": lost / values.size}
    return (Finding(Cause.CLIPPED, Answer.WITHHELD, figures=figures),)


def _flat(risen: FloatArray, near: float, least: float) -> int:
    """Return how many readings lie this near the largest (H), where those twice as far out lie at least so much lower (H); else 0."""
    end = float(np.max(risen))
    at = risen >= end - near
    edges = np.flatnonzero(np.diff(np.concatenate(([0], at.astype(int), [0]))))
    tops = [(int(b), int(a)) for b, a in zip(edges[::2], edges[1::2], strict=True) if a - b >= _LEAST]
    drops = [
        end - risen[place]
        for begin, after in tops
        for place in (begin - (after - begin - 1), after - 1 + (after - begin - 1))
        if 0 <= place < risen.size
    ]
    cut = bool(drops) and float(np.median(drops)) > least and not _curved([risen[b:a] for b, a in tops])
    return int(np.sum(at)) if cut else 0


def _curved(tops: Sequence[FloatArray]) -> bool:
    """Return whether readings within tops (H) lie on a crest each, where those of a range's end scatter: a hand may slow down there."""
    whole = left = 0.0
    for whole_top in tops:
        # At its ends it bends in any case.
        top = whole_top[1:-1]
        if top.size > _LEAST:
            x = np.linspace(-1.0, 1.0, top.size)
            crest = np.polyfit(x, top, 2)
            whole += float(np.sum((top - np.mean(top)) ** 2))
            left += (
                float(np.sum((top - np.polyval(crest, x)) ** 2)) if crest[0] < 0.0 else float(np.var(top) * top.size)
            )
    return left < _ON_CRESTS * whole
