"""In which unit a number that is typed at the panel is taken."""

import pytest

from bench.panel.typed_scale import completed, value_of


@pytest.mark.parametrize(
    ("typed", "value"),
    [
        ("30", 0.03),
        ("３０．５", 0.0305),
        ("30 m", 0.03),
        ("３０ｍ", 0.03),
        ("30 毫", 0.03),
        ("30 欧", 30.0),
        ("30 毫欧", 0.03),
    ],
)
def test_a_number_without_its_unit_is_in_the_one_that_is_chosen(typed: str, value: float) -> None:
    assert value_of(completed(typed, "mΩ", "Ω"), "Ω") == value
