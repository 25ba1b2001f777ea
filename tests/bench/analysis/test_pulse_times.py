"""Coast-downs whose speeds were read off the times between pulses."""

from pathlib import Path

import numpy as np
import pytest

from bench.analysis.coast_down import analyze_coast_down
from bench.analysis.pulse_times import at_middles, over_turns, pulse_intervals, with_missing_tooth
from tests.studies.coast_loggers import Coast, counted, hall_edges, missing_tooth, pulse_a_turn


@pytest.fixture
def coast() -> Coast:
    return Coast.drawn(np.random.default_rng([7, 4]))


def edges(coast: Coast, pulses: int) -> np.ndarray:
    return coast.when(2.0 * np.pi / pulses * np.arange(1e6))


@pytest.mark.parametrize("rows", [1, 2, 6])
@pytest.mark.parametrize("ends", [True, False])
def test_the_interval_of_a_speed_is_found(coast: Coast, rows: int, ends: bool) -> None:
    passed = edges(coast, 8)
    speeds = rows * 2.0 * np.pi / 8.0 / (passed[rows:] - passed[:-rows])
    time = passed[rows:] if ends else passed[:-rows]
    found = pulse_intervals(time, speeds)
    assert found is not None
    assert found[0] == (rows if ends else -rows)
    assert found[1] == pytest.approx(rows * 2.0 * np.pi / 8.0, rel=1e-6)
    middles, kept = at_middles(time, found[0])
    truth = np.interp(middles, coast.time, coast.speed)
    assert speeds[kept] == pytest.approx(truth, rel=5e-3)


def test_speeds_of_an_instant_are_left_alone(coast: Coast) -> None:
    passed = edges(coast, 8)
    assert pulse_intervals(passed, np.interp(passed, coast.time, coast.speed)) is None
    middles = 0.5 * (passed[1:] + passed[:-1])
    assert pulse_intervals(middles, 2.0 * np.pi / 8.0 / np.diff(passed)) is None
    even = np.linspace(0.0, coast.time[-1], 2000)
    assert pulse_intervals(even, np.interp(even, coast.time, coast.speed)) is None
    assert pulse_intervals(even[:3], np.ones(3)) is None
    assert pulse_intervals(even, np.zeros(even.size)) is None


def test_turns_are_whole_ones_of_what_are_parts_of_a_turn(coast: Coast) -> None:
    passed = edges(coast, 24)
    speeds = 2.0 * np.pi / 24.0 / np.diff(passed)
    made = over_turns(passed[1:], speeds, 1, 2.0 * np.pi / 24.0)
    assert made is not None
    middles, means = made
    # The first row's own interval began before the record.
    turns = passed[1::24]
    assert middles == pytest.approx(0.5 * (turns[1:] + turns[:-1]))
    assert means == pytest.approx(2.0 * np.pi / np.diff(turns))
    assert over_turns(passed[1:], speeds, 1, 0.7 * 2.0 * np.pi) is None
    assert over_turns(passed[1:60], speeds[:59], 1, 2.0 * np.pi / 24.0) is None


@pytest.mark.parametrize(
    ("logger", "widest"), [(pulse_a_turn, 0.01), (hall_edges, 0.01), (counted, 0.3)], ids=["turn", "edges", "counted"]
)
def test_what_a_logger_of_pulses_writes_is_held(coast: Coast, tmp_path: Path, logger, widest: float) -> None:
    path = tmp_path / "coast.csv"
    path.write_text("\n".join(("time (s),speed (rpm)", *logger(coast, np.random.default_rng(3)))))
    found = analyze_coast_down(path, inertia=coast.inertia)
    low, high = found["parameters"]["coulomb_friction"]["coverage_interval"]
    assert low <= coast.coulomb <= high
    assert high - low < 2.0 * widest * coast.coulomb
    said = any("mean over a time between pulses" in each for each in found["assumptions"])
    assert said == (logger is not counted)


@pytest.mark.parametrize("teeth", [12, 24])
def test_a_tooth_that_is_missing_is_put_in(coast: Coast, tmp_path: Path, teeth: int) -> None:
    path = tmp_path / "coast.csv"
    path.write_text("\n".join(("time (s),speed (rpm)", *missing_tooth(teeth)(coast, np.random.default_rng(3)))))
    found = analyze_coast_down(path, inertia=coast.inertia)
    low, high = found["parameters"]["coulomb_friction"]["coverage_interval"]
    assert low <= coast.coulomb <= high
    assert high - low < 0.05 * coast.coulomb
    assert any(f"one of {teeth} teeth is missing" in each for each in found["assumptions"])


def test_even_teeth_lack_none(coast: Coast) -> None:
    passed = edges(coast, 24)
    speeds = 2.0 * np.pi / 24.0 / np.diff(passed)
    assert with_missing_tooth(passed[1:], speeds) is None
