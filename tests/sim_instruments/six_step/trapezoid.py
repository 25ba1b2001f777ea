"""A trapezoidal EMF by its harmonics."""

import math

from sim_instruments.six_step.drive import EmfHarmonic


def trapezoid(flat_width: float, highest_order: int) -> tuple[float, tuple[EmfHarmonic, ...]]:
    """Express a trapezoidal EMF as its fundamental relative to the flat top, and the harmonics relative to that.

    `flat_width` is the flat top's electrical width in rad, from 0 to π. Multiply the flat top's EMF constant by the
    first result to get `emf_constant`. Raises ValueError for a width outside that range.
    """
    if not 0 <= flat_width < math.pi:
        raise ValueError(f"flat_width is {flat_width:g} rad: 0 ≤ flat_width < π is allowed")
    ramp = (math.pi - flat_width) / 2

    def relative_to_top(order: int) -> float:
        # Centred on the peak, so a cosine series; sin(hπ/2) carries the sign.
        return 4 * math.sin(order * ramp) / (math.pi * order**2 * ramp) * math.sin(order * math.pi / 2)

    first = relative_to_top(1)
    orders = range(3, highest_order + 1, 2)
    return first, tuple(EmfHarmonic(order, relative_to_top(order) / first) for order in orders)
