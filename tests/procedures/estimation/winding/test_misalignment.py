"""A rotor held off d and q, against the inductance matrix itself."""

import math

import numpy as np
import pytest

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.winding.misalignment import Held, excess

LD, LQ = 1e-3, 2.5e-3
ANGULAR = 2.0 * math.pi * 1000.0


def held(resistance: float, rotor: float) -> Held:
    """What the bridge reads with the d axis at an electrical angle (rad) from phase A: two loops, solved as they are."""
    mean, half = 0.5 * (LD + LQ), 0.5 * (LQ - LD)
    matrix = np.array(
        [
            [mean - half * math.cos(2 * rotor), -half * math.sin(2 * rotor)],
            [-half * math.sin(2 * rotor), mean + half * math.cos(2 * rotor)],
        ]
    )
    admittance = np.linalg.inv(resistance * np.eye(2) + 1j * ANGULAR * matrix)
    impedance = 1.5 / admittance[0, 0]

    def line(axis: float) -> float:
        along = np.array([math.cos(axis), math.sin(axis)])
        return 2.0 * float(along @ matrix @ along)

    # The line A to B lies 30° behind phase A's axis, C to A as far before it.
    return Held(impedance.imag / ANGULAR, impedance.real, line(-math.pi / 6) - line(math.pi / 6))


@pytest.mark.parametrize("resistance", [0.01, 5.0, 60.0])
@pytest.mark.parametrize(("off_d", "off_q"), [(0.0, 0.0), (0.05, -0.12), (-0.2, 0.1)])
def test_takes_off_what_the_angles_add(resistance: float, off_d: float, off_q: float) -> None:
    d, q = held(resistance, off_d), held(resistance, math.pi / 2 + off_q)
    found = excess(d, q, ANGULAR)
    # The loop's own resistance rises a little with the angle, hence not exact.
    assert (d.reading - found.d) / 1.5 == pytest.approx(LD, rel=2e-3)
    assert (q.reading - found.q) / 1.5 == pytest.approx(LQ, rel=2e-3)
    assert abs(found.angle_d) == pytest.approx(abs(off_d), abs=2e-3)
    assert abs(found.angle_q) == pytest.approx(abs(off_q), abs=2e-3)


def test_says_what_it_cannot_tell() -> None:
    d, q = held(0.1, 0.0), held(0.1, math.pi / 2)
    with pytest.raises(EstimationError, match="no saliency"):
        excess(q, d, ANGULAR)
    with pytest.raises(EstimationError, match="align it again"):
        excess(d._replace(difference=2.0 * d.reading), q, ANGULAR)
