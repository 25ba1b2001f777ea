"""Checks by repeated readings whether several sessions measured the same motor on the same bench."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.flux.flux_map import GainLimits
from procedures.estimation.flux.map_fit import fit_map
from procedures.estimation.flux.readings import FluxReadings

#: So unlikely a difference is one where it is more than this share of the largest flux linkage; magnets and gains that moved are known to
#: a part of it only.
_APART, _SEEN_SHARE = 1e-6, 5e-3
#: Two gains within their limits differ by no more than the sum, and this many standard uncertainties.
_BEYOND = 3.5
#: Noise that is taken where none is stated, in shares of the largest voltage; their ratio alone counts.
_NOISE = 5e-4


@dataclass(frozen=True)
class BrokenTie:
    """A disagreement between sessions: the largest difference of flux linkage at a repeated current, as a share of the largest
    flux linkage, and the largest relative difference of a gain.
    """

    share: float
    gain: float


def broken_tie(
    readings: FluxReadings, *, symmetric: bool, gains: GainLimits, wanted: FloatArray | None = None
) -> BrokenTie | None:
    """Return by how much sessions contradict each other where chance, temperatures, the angle's zero and gains within twice their limits
    do not explain it; None where they do, and where there is one session.

    Raises EstimationError where the readings do not determine a map.
    """
    if not np.any(readings.session):
        return None
    if not readings.noise_stated:
        noise = np.full(readings.time.size, _NOISE * float(np.max(np.abs(readings.voltage))))
        readings = replace(readings, voltage_noise=noise)
    tied, free = (
        fit_map(readings, symmetric=symmetric, gains=gains, wanted=wanted, unsure=True, apart=apart)
        for apart in (False, True)
    )
    share = float(np.max(np.hypot(*free.apart.T), initial=0.0)) / tied.map.full_scale
    largest, beyond = 0.0, False
    grown = np.sqrt(max(tied.variance_ratio, 1e-12))
    for session in tied.sessions[1:]:
        for gain, limit in ((session.voltage_gain, gains.voltage), (session.current_gain, gains.current)):
            largest = max(largest, abs(gain.value), key=abs)
            beyond = beyond or (abs(gain.value) > 2.0 * limit + _BEYOND * grown * gain.uncertainty)
    more = tied.degrees_of_freedom - free.degrees_of_freedom
    gained = (tied.cost - free.cost) / max(more, 1) / max(free.variance_ratio, 1e-12)
    apart = float(fdtrc(max(more, 1), free.degrees_of_freedom, max(gained, 0.0))) < _APART
    return BrokenTie(share, largest) if beyond or (apart and share > _SEEN_SHARE) else None
