"""Locations about the largest torque per ampere: where they lie, and what they teach."""

from dataclasses import replace

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
    assert len(points) == 8
    apart = np.hypot(*(points[:, None] - measured.points[None]).transpose(2, 0, 1)).min(axis=1)
    assert np.all(apart > 0.09 * np.hypot(*points.T))
    angles = np.degrees(np.arctan2(points[:, 1], points[:, 0])) - 90.0
    for share in MTPA_SHARES:
        (found,) = maximum_torque_per_ampere(measured, [share * largest], 1.0)
        off = np.abs(angles[np.isclose(np.hypot(*points.T), share * largest)] - found.angle.value)
        # Where there is room for one on one side only, another lies farther from another largest torque.
        assert np.all(np.isclose(off, 8.0, atol=0.01) | np.isclose(off, 16.0, atol=0.01))
        # The largest current's arc may be full without them.
        assert share == 1.0 or np.count_nonzero(off < 9.0) >= 1


def test_none_where_the_torque_grows_to_the_edge() -> None:
    motor = MOTORS["bridged IPMSM"]
    whole = exact_map(motor, 80)
    # Of positive i_d alone the torque's maximum is outside.
    kept = whole.points[:, 0] >= 0.0
    part = type(whole)(whole.points[kept], whole.flux[kept], np.eye(2 * kept.sum()) * 1e-12, True)
    assert about_mtpa(part, 8).shape == (0, 2)


@pytest.mark.parametrize(("locations", "later"), [(12, 0), (24, 2), (51, 6), (113, 8)])
def test_most_locations_are_read_first(locations: int, later: int) -> None:
    assert held_back(locations) == later


@pytest.mark.parametrize("count", [20, 30, 45, 60, 92])
def test_the_others_are_sparser_beside_the_d_axis_alone(count: int) -> None:
    points = grid_locations(10.0, count)
    rows = [np.sort(points[points[:, 1] == i_q, 0]) for i_q in np.unique(points[:, 1])]
    beside, next_to_it = (float(np.max(np.diff(row))) for row in rows[1:3])
    assert count - 2 <= len(points) <= count
    assert 1.2 * next_to_it < beside < 2.0 * next_to_it


def test_their_readings_begin_and_end_without_current_and_have_both_signs() -> None:
    points = grid_locations(10.0, 20)
    points = points[points[:, 1] > 0.0][:8]
    one = further_readings(points, np.random.default_rng(1), both_sides=False)
    assert not one[0].i_q
    assert not one[-1].i_q
    loaded = [each for each in one if each.i_q]
    # The two of the largest currents come at both speeds.
    twice = [each for each in loaded if replace(each, direction=-each.direction) in loaded]
    assert len(loaded) == len(points) + 2
    assert [abs(complex(each.i_d, each.i_q)) for each in twice] == pytest.approx([np.max(np.hypot(*points.T))] * 4)
    assert all(each.i_q * each.direction > 0.0 for each in loaded if each not in twice)
    assert {np.sign(each.i_q) for each in loaded} == {1.0, -1.0}
    assert {each.direction for each in loaded} == {1, -1}
    both = further_readings(points, np.random.default_rng(1), both_sides=True)
    assert sum(bool(each.i_q) for each in both) == 2 * len(points) + 2
    assert further_readings(points[:0], np.random.default_rng(1), both_sides=False) == []
