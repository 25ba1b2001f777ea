"""A rotor held off d and q, against the inductance matrix itself."""

import math

import numpy as np
import pytest

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.winding.misalignment import Held, excess

LD, LQ = 1e-3, 2.5e-3


def held(rotor: float) -> Held:
    """What is read with the d axis at an electrical angle (rad) from phase A: along its axis, and by two lines."""
    mean, half = 0.5 * (LD + LQ), 0.5 * (LQ - LD)
    matrix = np.array(
        [
            [mean - half * math.cos(2 * rotor), -half * math.sin(2 * rotor)],
            [-half * math.sin(2 * rotor), mean + half * math.cos(2 * rotor)],
        ]
    )

    def line(axis: float) -> float:
        along = np.array([math.cos(axis), math.sin(axis)])
        return 2.0 * float(along @ matrix @ along)

    # The line A to B lies 30° behind phase A's axis, C to A as far before it.
    return Held(1.5 * matrix[0, 0], line(-math.pi / 6) - line(math.pi / 6))


@pytest.mark.parametrize(("off_d", "off_q"), [(0.0, 0.0), (0.05, -0.12), (-0.2, 0.1)])
def test_takes_off_what_the_angles_add(off_d: float, off_q: float) -> None:
    d, q = held(off_d), held(math.pi / 2 + off_q)
    found = excess(d, q)
    assert (d.reading - found.d) / 1.5 == pytest.approx(LD, rel=1e-6)
    assert (q.reading - found.q) / 1.5 == pytest.approx(LQ, rel=1e-6)
    assert abs(found.angle_d) == pytest.approx(abs(off_d), abs=1e-6)
    assert abs(found.angle_q) == pytest.approx(abs(off_q), abs=1e-6)


def test_says_what_it_cannot_tell() -> None:
    d, q = held(0.0), held(math.pi / 2)
    with pytest.raises(EstimationError, match="no saliency"):
        excess(q, d)
    with pytest.raises(EstimationError, match="align it again"):
        excess(d._replace(difference=2.0 * d.reading), q)
