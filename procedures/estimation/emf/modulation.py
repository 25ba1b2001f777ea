"""Detects a flux linkage that changes along the record of a turning machine's voltages, whatever the speed does."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import special

from procedures.estimation.emf.harmonics import HarmonicModel, waveform_basis
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding

#: So many parts of whole periods at most; from the second number on their course may be bent, else it is straight.
_PARTS, _BENT = 8, 4
#: Of what they differ by the share 1 − _CHANCE/χ² counts; it is told where chance does as much once in so many records, from this share on.
_CHANCE, _BY_CHANCE, _LEAST = 4.6, 1e-4, 1e-3
#: The truth may be at an end of the course: its distance from the mean is within so many standard uncertainties.
_WITHIN = 1.6


def find_modulation(
    t: FloatArray, values: FloatArray, orders: Sequence[int], model: HarmonicModel, whole: NDArray[np.bool_]
) -> tuple[float, tuple[Finding, ...]]:
    """Return the standard uncertainty, as a share, of a fundamental flux that changes along the record (C, n), V, and the finding.

    A machine has one flux linkage at all speeds: voltages that change otherwise than the speed come from an average of acquisitions at a
    speed that varies, from a gain or a time base that drifts, or from another wave near the fundamental. `whole` (C,) are channels all
    of whose readings are the record's own.
    """
    phase = model.phase(t)
    turns = float(phase[-1] - phase[0]) / (2.0 * np.pi)
    count = min(_PARTS, int(turns + 0.02))
    if count < 2 or not whole.any():
        return 0.0, ()
    part = np.minimum(((phase - phase[0]) / (phase[-1] - phase[0]) * count).astype(np.intp), count - 1)
    design = waveform_basis(model, orders, t)
    first = list(orders).index(1)
    flux, variance = np.empty((count, int(np.sum(whole))), dtype=np.complex128), np.empty((count, int(np.sum(whole))))
    middles = np.empty(count)
    for k in range(count):
        own = part == k
        rows, read = design[:, own], values[np.ix_(whole, own)]
        inverse = np.linalg.pinv(rows @ rows.T, hermitian=True)
        found = read @ rows.T @ inverse
        freedom = max(read.shape[1] - rows.shape[0], 1)
        variance[k] = np.sum((read - found @ rows) ** 2, axis=1) / freedom * inverse[1 + first, 1 + first]
        flux[k] = found[:, 1 + first] + 1j * found[:, 1 + first + len(orders)]
        middles[k] = np.mean(t[own])
    # What the phase gains on the model's, the speed does.
    turned = np.mean(np.unwrap(np.angle(flux / flux[0]), axis=0), axis=1)
    sizes = np.abs(flux) / (1.0 + np.gradient(turned, middles) / model.speed(middles))[:, None]
    means = np.mean(sizes, axis=0)
    course = np.mean(sizes / means, axis=1)
    noise = np.sqrt(np.sum(variance / means**2, axis=1)) / means.size
    x = model.place(middles)
    shapes = np.polynomial.legendre.legvander(x, 2 if count >= _BENT else 1)
    weighted = shapes / noise[:, None]
    inverse = np.linalg.pinv(weighted.T @ weighted, hermitian=True)
    bent = inverse @ weighted.T @ (course / noise)
    left = course - shapes @ bent
    beyond = count - shapes.shape[1]
    grown = max(1.0, float(np.sum((left / noise) ** 2)) / beyond) if beyond else 1.0
    chi = float(bent[1:] @ np.linalg.solve(inverse[1:, 1:], bent[1:])) / grown
    if chi <= _CHANCE:
        return 0.0, ()
    ends = np.polynomial.legendre.legval(np.linspace(-1.0, 1.0, 41), np.append(0.0, bent[1:]))
    most = float(np.max(np.abs(ends)))
    share = most / _WITHIN * (1.0 - _CHANCE / chi)
    if chi <= float(special.chdtri(shapes.shape[1] - 1, _BY_CHANCE)) or most < _LEAST:
        return share, ()
    figures: dict[str, float | str] = {"share": float(np.ptp(ends)), "record": "emf-modulated"}
    return share, (Finding(Cause.MODULATED, Answer.WIDENED, ("flux_linkage",), float(np.sqrt(chi)), figures),)
