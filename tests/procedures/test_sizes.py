"""Intervals that tell nothing of a motor's size."""

import pytest

from procedures.plausibility.sizes import too_uncertain


@pytest.mark.parametrize(
    ("name", "value", "half", "given"),
    [
        ("inertia", 1e-5, 0.9e-5, True),
        ("inertia", 1e-5, 1.1e-5, False),
        ("inertia", 0.0, 1e-6, False),
        ("inertia_with_load", 1e-4, 0.2, False),
        # A motor may hardly have any friction: a small figure with a wide interval says how little it is.
        ("viscous_friction", 1e-6, 9e-6, True),
        ("viscous_friction", -1e-6, 9e-6, True),
        ("viscous_friction", 1e-6, 7.5e-5, True),
        ("coulomb_friction", 0.0, 0.0, True),
        ("coulomb_friction", 9e-3, 0.2, True),
        # So wide that nothing is left of a reading.
        ("coulomb_friction", 9e-3, 190.0, False),
        ("viscous_friction", 2e-5, 1.0, False),
        # What is zero of a sound motor.
        ("resistance_unbalance", 1e-3, 1.0, True),
        ("hall_faults", 0.0, 0.5, True),
    ],
)
def test_what_is_known_no_better_than_itself_is_not_given(name: str, value: float, half: float, given: bool) -> None:
    why = too_uncertain(name, value, (value - half, value + half), "SI")
    assert (why is None) is given
    if why is not None:
        assert f"between {value - half:.3g} and {value + half:.3g} SI" in str(why)
