"""Ranges of possible and of usual values of motors: a figure outside them may have a wrong unit or factor."""

from collections.abc import Mapping

from drivers.interfaces.text import Text, text

#: The cause that a figure is not given for where no motor has such a size, and the warning's that hardly any has it.
IMPLAUSIBLE, UNUSUAL = "implausible-size", "unusual-size"
#: The cause that a figure is not given for whose interval is so wide that it tells nothing of the motor.
TOO_UNCERTAIN = "too-uncertain"
#: Half-width of the interval over the value, at most, of what no motor is without. A friction that cannot be told from zero says how much
#: it is at most, unless that is so much that no reading of it is left.
_MOST = 1.0
_MOST_FRICTION = {
    "coulomb_friction": 30.0,
    "coulomb_deceleration": 30.0,
    "viscous_friction": 100.0,
    "viscous_rate": 100.0,
}

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
    "inertia_with_load": (1e-13, 1e7),
    "coulomb_friction": (0.0, 1e6),
    "viscous_friction": (0.0, 1e6),
    "coulomb_deceleration": (0.0, 1e6),
    "viscous_rate": (0.0, 1e4),
}
#: What motors on a bench have, from micro motors to direct drives of some 100 kW: outside it, a unit is as likely off by a thousand.
_USUAL: Mapping[str, tuple[float, float]] = {
    "stator_resistance": (1e-4, 1e3),
    "loop_resistance": (1e-4, 2e3),
    "d_axis_inductance": (3e-7, 0.5),
    "q_axis_inductance": (3e-7, 0.5),
    "loop_inductance": (3e-7, 1.0),
    "inductance": (3e-7, 0.5),
    "flux_linkage": (5e-6, 5.0),
    "inertia": (1e-10, 1e2),
    "coulomb_friction": (0.0, 1e2),
    "viscous_friction": (0.0, 1e1),
}


def size_beyond(name: str, value: float) -> tuple[float, float] | None:
    """Return the least and the largest size (SI) that a motor's parameter has, where a value above 0 lies outside; else None."""
    least, most = _SIZES.get(name, (0.0, float("inf")))
    return (least, most) if value > most or 0.0 < value < least else None


def size_unusual(name: str, value: float) -> tuple[float, float] | None:
    """Return the least and the largest size (SI) that a motor on a bench usually has, where a value above 0 lies outside; else None."""
    least, most = _USUAL.get(name, (0.0, float("inf")))
    return (least, most) if value > most or 0.0 < value < least else None


def too_uncertain(name: str, value: float, interval: tuple[float, float], unit: str) -> Text | None:
    """Return why the figure of a motor's size is not given: half the width of its 95 % interval exceeds the value itself. None where it
    does not, and for parameters that may be zero; frictions, which may, have a wider limit.
    """
    least, _ = _SIZES.get(name, (0.0, 0.0))
    low, high = interval
    most = _MOST_FRICTION.get(name, _MOST if least > 0.0 else None)
    if most is None or 0.5 * (high - low) <= most * abs(value):
        return None
    return text(
        "the readings only show that it lies between {low:.3g} and {high:.3g} {unit}, and a figure with an interval wider than "
        "±{most:.0%} of itself is not given. If another warning names a cause, remove that; otherwise read more often or longer, or "
        "use a larger signal",
        low=low,
        high=high,
        unit=unit,
        most=most,
    )
