"""Sizes that no motor has: a figure outside them is of another unit or factor than its record says."""

from collections.abc import Mapping

#: From the smallest watch motors and micro motors to the largest generators, and a factor of ten or more to spare on either side: a
#: limit is for what cannot be, not for what is rare.
_RESISTANCE, _INDUCTANCE, _FLUX = (1e-7, 1e5), (1e-9, 1e2), (1e-7, 1e3)
_SIZES: Mapping[str, tuple[float, float]] = {
    "stator_resistance": _RESISTANCE,
    "loop_resistance": _RESISTANCE,
    "d_axis_inductance": _INDUCTANCE,
    "q_axis_inductance": _INDUCTANCE,
    "loop_inductance": _INDUCTANCE,
    "inductance": _INDUCTANCE,
    "flux_linkage": _FLUX,
    "back_emf_constant_mechanical": (1e-7, 1e5),
    "torque_constant": (1e-7, 1e5),
    "inertia": (1e-13, 1e7),
    "coulomb_friction": (0.0, 1e6),
    "viscous_friction": (0.0, 1e6),
    "coulomb_deceleration": (0.0, 1e6),
    "viscous_rate": (0.0, 1e4),
}


def size_beyond(name: str, value: float) -> tuple[float, float] | None:
    """Return the least and the largest size (SI) that a motor's parameter has, where a value above 0 lies outside; else None."""
    least, most = _SIZES.get(name, (0.0, float("inf")))
    return (least, most) if value > most or 0.0 < value < least else None
