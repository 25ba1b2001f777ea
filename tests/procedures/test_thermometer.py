"""Which temperatures of a winding are no surprise."""

import pytest

from procedures.core.budget import Uncertainties
from procedures.techniques.temperature.thermometer import Thermometer


def usual(*before: float, warmed: bool = False, limit: float | None = None) -> tuple[float, float]:
    thermometer = Thermometer(Uncertainties())
    for celsius in before:
        thermometer.take(celsius, 1.0, 0.0)
    if warmed:
        thermometer.warmed()
    return thermometer.usual(limit)


def test_a_winding_that_nothing_warmed_is_as_before_or_as_a_room() -> None:
    assert usual() == (5.0, 45.0)
    assert usual(22.0) == (12.0, 32.0)
    # One that was hot cools down to the room's temperature.
    assert usual(77.0) == (5.0, 87.0)


@pytest.mark.parametrize(("limit", "highest"), [(None, 155.0), (80.0, 80.0)])
def test_a_current_warms_it_up_to_its_limit_and_cools_nothing(limit: float | None, highest: float) -> None:
    assert usual(22.0, warmed=True, limit=limit) == (12.0, highest)
