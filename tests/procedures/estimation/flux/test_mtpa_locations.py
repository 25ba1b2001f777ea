"""Locations about the largest torque per ampere: where they lie, and what they teach."""

import numpy as np
import pytest

from procedures.estimation.flux.mtpa import maximum_torque_per_ampere
from procedures.estimation.flux.mtpa_locations import MTPA_SHARES, about_mtpa, held_back
from procedures.estimation.flux.plan import further_readings, grid_locations
from tests.procedures.estimation.flux.test_derived import MOTORS, exact_map


def test_they_lie_on_both_sides_of_it_and_apart_from_the_others() -> None:
    measured = exact_map(MOTORS["bridged IPMSM"], 43)
    points = about_mtpa(measured, 8)
    largest = measured.largest_current
    assert 6 <= len(points) <= 8
    assert np.min(np.hypot(*(points[:, None] - measured.points[None]).transpose(2, 0, 1))) > 0.03 * largest
    angles = np.degrees(np.arctan2(points[:, 1], points[:, 0])) - 90.0
    for share in MTPA_SHARES:
        (found,) = maximum_torque_per_ampere(measured, [share * largest], 1.0)
        off = angles[np.isclose(np.hypot(*points.T), share * largest)] - found.angle.value
        assert np.abs(off) == pytest.approx(8.0, abs=0.01)
        assert np.sum(off) == pytest.approx(0.0, abs=8.01)


def test_none_where_the_torque_grows_to_the_edge() -> None:
    motor = MOTORS["bridged IPMSM"]
    whole = exact_map(motor, 80)
    # Of positive i_d alone the torque's maximum is outside.
    kept = whole.points[:, 0] >= 0.0
    part = type(whole)(whole.points[kept], whole.flux[kept], np.eye(2 * kept.sum()) * 1e-12, True)
    assert about_mtpa(part, 8).shape == (0, 2)


@pytest.mark.parametrize(("locations", "later"), [(12, 0), (24, 2), (51, 4), (113, 8)])
def test_most_locations_are_read_first(locations: int, later: int) -> None:
    assert held_back(locations) == later


def test_their_readings_begin_and_end_without_current_and_have_both_signs() -> None:
    points = grid_locations(10.0, 20)
    points = points[points[:, 1] > 0.0][:8]
    one = further_readings(points, np.random.default_rng(1), both_sides=False)
    assert not one[0].i_q
    assert not one[-1].i_q
    loaded = [each for each in one if each.i_q]
    assert len(loaded) == len(points)
    assert {np.sign(each.i_q) for each in loaded} == {1.0, -1.0}
    assert {each.direction for each in loaded} == {1, -1}
    both = further_readings(points, np.random.default_rng(1), both_sides=True)
    assert sum(bool(each.i_q) for each in both) == 2 * len(points)
    assert further_readings(points[:0], np.random.default_rng(1), both_sides=False) == []
