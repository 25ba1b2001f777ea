"""The intervals of a map's flux linkages, as the figures that are derived from it have theirs."""

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.expanded import half_width
from procedures.estimation.flux.flux_map import MeasuredFluxMap


def half_widths(flux_map: MeasuredFluxMap, coverage: float = 0.95) -> NDArray[np.float64]:
    """The half-widths (m, 2) in V·s of the coverage intervals of the flux linkages."""
    noise, freedom = flux_map.scatter.ravel(), flux_map.degrees_of_freedom
    limits = np.array(list(flux_map.shared.values())).reshape(-1, noise.size)
    made = [
        half_width(np.abs(limits[:, k]).tolist(), [(noise[k], freedom)] if noise[k] > 0.0 else [], coverage)
        for k in range(noise.size)
    ]
    return np.array(made).reshape(-1, 2)
