"""Temperature coefficient of the magnets, from one quantity at two temperatures."""

from collections.abc import Sequence
from typing import Any

from GTC.lib import UncertainReal

from drivers.interfaces.text import text
from procedures.core.procedure import Procedure
from procedures.techniques.temperature.settings import COLD

#: Two temperatures nearer than this (K) tell nothing of the coefficient.
_APART = 5.0


def coefficient_between(
    procedure: Procedure[Any], sizes: Sequence[UncertainReal], temperatures: Sequence[UncertainReal], lag: float
) -> UncertainReal | None:
    """Return the coefficient (1/K, relative to 25 °C) of a quantity that goes with the flux linkage, at two temperatures (°C).

    The magnets of a motor that was warmed by its current may be cooler than its winding, by up to the share `lag` of the rise. None, and
    a notice, where the temperatures are too near each other.
    """
    (first, second), (cold, warm) = sizes, temperatures
    rise = float(warm.x) - float(cold.x)
    if rise < _APART:
        procedure.notice(
            "temperatures-alike",
            text(
                "the winding was at {cold:.1f} °C and then at {warm:.1f} °C: too little apart for the magnets' coefficient; warm longer "
                "(warming_time)",
                cold=float(cold.x),
                warm=float(warm.x),
            ),
        )
        return None
    magnets = warm - procedure.bench.uncertainties.one_sided(
        "magnets cooler than the winding that warms them", 0.0, lag * rise
    )
    coefficient: UncertainReal = (second - first) / (first * (magnets - COLD) - second * (cold - COLD))
    return coefficient
