"""Inductance readings that stand at an end of the bridge's range while the rotor turns on."""

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
    drops = [
        end - risen[place]
        for begin, after in zip(edges[::2], edges[1::2], strict=True)
        if after - begin >= _LEAST
        for place in (begin - (after - begin - 1), after - 1 + (after - begin - 1))
        if 0 <= place < risen.size
    ]
    return int(np.sum(at)) if drops and float(np.median(drops)) > least else 0
