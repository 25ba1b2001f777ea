"""Detects a channel with a dead zone about zero, by the corners that it causes in the voltage of a turning machine."""

from collections.abc import Sequence

import numpy as np

from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from procedures.estimation.fitting.noise import undithered

#: Readings within this share of the amplitude about zero are looked at, beside a polynomial of this degree for each direction.
_WINDOW, _DEGREE = 0.2, 5
#: Half-widths of the zone that are tried, share of the window.
_WIDTHS = (0.03, 0.1, 0.3, 0.6)
#: It is seen beyond so many standard deviations, and told from this share of the fundamental on.
_SEEN, _LEAST = 5.0, 1e-3
#: What is lost on either side is a square wave's size, and so much of it the fundamental's.
_TO_FUNDAMENTAL = 4.0 / np.pi
#: So many readings in the window for each unknown.
_READINGS = 4


def find_dead_zone(
    values: FloatArray,
    residuals: FloatArray,
    amplitudes: FloatArray,
    channels: Sequence[DigitizedChannel],
    shared: FloatArray,
) -> tuple[FloatArray, tuple[Finding, ...]]:
    """Return the uncertainty of each channel's fundamental (C,), V, because of a dead zone about zero, and the findings.

    `values` (C, n), V, are readings and `residuals` what a waveform of low orders leaves of them; `amplitudes` (C,) are the fundamentals'.
    So many readings as `shared` (C,) says share one rounding
    error. A zone that is the same for both polarities makes odd orders only, as a winding does, but its corners lie at two
    voltages: about zero, within a few degrees, no winding's waveform bends twice.
    """
    lost, scores = np.zeros(len(channels)), np.zeros(len(channels))
    for c in range(len(channels)):
        lost[c], scores[c] = _lost(
            values[c], residuals[c], float(amplitudes[c]), channels[c].resolution, float(shared[c])
        )
    if not lost.any():
        return lost, ()
    shares = lost / amplitudes
    worst = int(np.argmax(shares))
    figures: dict[str, float | str] = {
        "channel": channels[worst].name,
        "share": float(shares[worst]),
        "record": "emf-dead-zone",
    }
    return lost, (Finding(Cause.DISTORTION, Answer.WIDENED, ("flux_linkage",), float(scores[worst]), figures),)


def _lost(
    values: FloatArray, residuals: FloatArray, amplitude: float, resolution: float, shared: float
) -> tuple[float, float]:
    """Return what a dead zone takes of the fundamental (V), and how far beyond chance it is seen; 0 where it is not."""
    course = values - residuals
    window = _WINDOW * amplitude
    inside = np.flatnonzero(np.abs(course) < window)
    inside = inside[(inside > 0) & (inside < course.size - 1)]
    if inside.size / shared < _READINGS * (2 * _DEGREE + 3):
        return 0.0, 0.0
    at, left = course[inside] / window, residuals[inside]
    rising = course[inside + 1] > course[inside - 1]
    powers = np.vander(at, _DEGREE + 1)
    smooth, _ = np.linalg.qr(np.hstack((powers * rising[:, None], powers * ~rising[:, None])))
    zones = np.clip(at[:, None] / np.array(_WIDTHS), -1.0, 1.0)
    zones -= smooth @ (smooth.T @ zones)
    left = left - smooth @ (smooth.T @ left)
    squares, along = np.einsum("nk,nk->k", zones, zones), left @ zones
    best = int(np.argmax(np.where(along < 0.0, along**2 / squares, 0.0)))
    size = -float(along[best] / squares[best])
    rest = left + size * zones[:, best]
    freedom = inside.size / shared - smooth.shape[1] - 1
    noise = float(np.sqrt(rest @ rest / (shared * freedom)))
    spread = noise * float(np.sqrt(shared / squares[best]))
    lost = _TO_FUNDAMENTAL * size
    if size < _SEEN * spread or lost < _LEAST * amplitude or size < 2.0 * undithered(noise, resolution):
        return 0.0, 0.0
    return lost, size / spread
