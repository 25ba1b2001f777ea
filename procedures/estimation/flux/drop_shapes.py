"""How the voltage that dead time and semiconductors take rises with the amplitude of the current."""

import numpy as np

from procedures.estimation.fitting.fit import FloatArray

#: Currents at which a leg's drop stops rising, in shares of the largest.
_KNEES = np.array([0.02, *np.arange(1, 20) / 20.0])
COUNT = _KNEES.size


def drop_shapes(amplitude: FloatArray, largest: float) -> FloatArray:
    """Return the fundamental (n, k) of what a leg takes that rises with the current up to 1 at a knee, for amplitudes (n,) in A.

    Whatever rises ever less with the current is a sum of such shapes, each with a weight that is not negative. Source: the describing
    function of a saturation (Gelb and Vander Velde, Multiple-Input Describing Functions).
    """
    share = amplitude[:, None] / (largest * _KNEES)
    x = 1.0 / np.maximum(share, 1.0)
    return np.asarray(share * (2.0 / np.pi) * (np.arcsin(x) + x * np.sqrt(1.0 - x**2)))
