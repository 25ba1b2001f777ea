import math
from dataclasses import dataclass

import pytest

from reports.tables.comparison import compare


@dataclass(frozen=True)
class F:
    value: float
    uncertainty: float
    unit: str = "Ω"


def test_differences_beyond_their_uncertainties_disagree() -> None:
    first = {"r": F(1.0, 0.01), "l": F(2.0, 0.0, "H"), "only": F(1.0, 0.1)}
    second = {"r": F(1.05, 0.02), "l": F(2.0, 0.0, "H")}
    resistance, inductance = compare(first, second)
    assert resistance.difference == pytest.approx(0.05)
    assert resistance.normalised_error == pytest.approx(0.05 / (2.0 * math.hypot(0.01, 0.02)))
    assert resistance.disagree
    assert math.isnan(inductance.normalised_error)
    assert not inductance.disagree


def test_within_their_uncertainties_they_agree() -> None:
    (found,) = compare({"r": F(1.0, 0.02)}, {"r": F(1.05, 0.02)})
    assert not found.disagree


def test_exact_figures_that_differ_disagree_and_other_units_are_not_compared() -> None:
    (found,) = compare({"r": F(4.0, 0.0), "l": F(1.0, 0.0, "H")}, {"r": F(5.0, 0.0), "l": F(1.0, 0.0, "mH")})
    assert found.disagree
