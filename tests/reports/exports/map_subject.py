"""A map whose law is known in closed form, as a run's findings hold it."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Targets that are written from a map.
MAPS = ("motulator-map", "mathworks-lut", "c-tables", "flux-map-csv")
#: Largest current (A) and pole pairs.
REACH, PAIRS = 25.0, 4.0


def law(i_d: ArrayLike, i_q: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Saturating flux linkages (V·s) with a cross term; they conserve energy."""
    d, q = np.asarray(i_d, dtype=float), np.asarray(i_q, dtype=float)
    shared = 1.0 + (q / 40.0) ** 2
    psi_d = 0.016 + 2.5e-4 * d - 2e-6 * d**2 - 1e-6 * q**2
    psi_q = 4e-4 * q / np.sqrt(shared) - 2e-6 * d * q
    return psi_d, psi_q


def findings(uncertainty: float = 2e-5, low: float = -REACH, high: float = REACH) -> dict[str, object]:
    """Return them with d-axis currents from `low` to `high` (A)."""
    axis = np.linspace(-REACH, REACH, 25)
    along = np.linspace(low, high, 25)
    d, q = np.meshgrid(along, axis, indexing="ij")
    psi_d, psi_q = law(d, q)
    near = np.hypot(d, q) <= REACH * 1.001
    half = near & (q >= 0.0)
    columns = (d[half], q[half], psi_d[half], psi_q[half])
    names = ("id_A", "iq_A", "psi_d_Vs", "psi_q_Vs")
    table = {name: values.tolist() for name, values in zip(names, columns, strict=True)}
    spread = np.full(int(np.count_nonzero(half)), uncertainty).tolist()
    return {
        "tables": {"flux_map.csv": {**table, "u_psi_d_Vs": spread, "u_psi_q_Vs": spread}},
        "symmetric": True,
        "pole_pairs": PAIRS,
        "resistance": {"time": [0.0, 1.0], "resistance": [0.044, 0.046]},
        "grid": {
            "i_d": along.tolist(),
            "i_q": axis.tolist(),
            "psi_d": psi_d.tolist(),
            "psi_q": psi_q.tolist(),
            "measured": near.tolist(),
        },
        "d_axis_saturation": {
            "inductance": {"value": 2.5e-4},
            "scale": {"value": -2e-6, "standard_uncertainty": 1e-7, "coverage_interval": [-2.2e-6, -1.8e-6]},
            "lowest_current": -REACH,
        },
    }
