"""Records whose times are a thousand times too long or too short for what they show."""

from pathlib import Path

import numpy as np
import pytest

from bench.analysis.back_emf import analyze_back_emf
from bench.analysis.coast_down import analyze_coast_down
from bench.analysis.step_response import analyze_step_response


def written(path: Path, heading: str, *columns: np.ndarray) -> Path:
    rows = "\n".join(",".join(f"{x:.9g}" for x in row) for row in zip(*columns, strict=True))
    path.write_text(f"{heading}\n{rows}\n", encoding="utf-8")
    return path


def ids(found: dict) -> set[str]:
    return {warning["id"] for warning in found["warnings"]}


@pytest.mark.parametrize(
    ("tau", "unit", "said"),
    [
        (1e-3, 1.0, set()),
        (2e-4, 1e3, {"long-time-constant"}),
        (1e-3, 1e-3, {"short-time-constant"}),
    ],
)
def test_a_time_constant_that_no_winding_has_is_asked_about(tmp_path: Path, tau: float, unit: float, said: set) -> None:
    random = np.random.default_rng(1)
    time = np.linspace(-0.2, 0.8, 2001) * 10.0 * tau
    on = np.maximum(time, 0.0)
    v = np.where(time > 0.0, 2.0, 0.0) + random.normal(0.0, 0.004, time.size)
    i = 1.0 * -np.expm1(-on / tau) + random.normal(0.0, 0.002, time.size)
    found = analyze_step_response(written(tmp_path / "step.csv", "t (s),u (V),i (A)", unit * time, v, i))
    assert ids(found) - {"E10"} == said


@pytest.mark.parametrize(("unit", "told"), [(1.0, False), (1e3, True), (1e-3, True)])
def test_a_frequency_at_which_nobody_turns_gives_no_figure(tmp_path: Path, unit: float, told: bool) -> None:
    time = np.linspace(0.0, 0.1, 4001)
    noise = np.random.default_rng(2).normal(0.0, 0.01, time.size)
    path = written(tmp_path / "emf.csv", "t (s),u (V)", unit * time, 2.0 * np.sin(2.0 * np.pi * 100.0 * time) + noise)
    found = analyze_back_emf(path)
    assert ("unlikely-frequency" in ids(found)) == told
    assert (set(found["parameters"]) == set()) == told
    assert {row["cause"] for row in found["withheld"].values()} == ({"unlikely-frequency"} if told else set())


def test_a_slow_turn_that_the_tachometer_confirms_gives_its_figures(tmp_path: Path) -> None:
    time = np.linspace(0.0, 20.0, 4001)
    noise = np.random.default_rng(2).normal(0.0, 0.01, time.size)
    path = written(tmp_path / "emf.csv", "t (s),u (V)", time, 2.0 * np.sin(2.0 * np.pi * 0.5 * time) + noise)
    for rpm, given in ((7.5, True), (None, False)):
        found = analyze_back_emf(path, coupling={"": "dc"}, pole_pairs=4, speed_rpm=rpm)
        assert ("flux_linkage" in found["parameters"]) == given


@pytest.mark.parametrize(("unit", "told"), [(1.0, False), (1e3, True), (1e-3, True)])
def test_a_coast_that_no_shaft_takes_is_asked_about(tmp_path: Path, unit: float, told: bool) -> None:
    time = np.linspace(0.0, 8.0, 1601)
    speed = 220.0 * np.exp(-0.2 * time) - 20.0 * -np.expm1(-0.2 * time)
    noise = np.random.default_rng(3).normal(0.0, 0.05, time.size)
    path = written(tmp_path / "coast.csv", "t (s),speed (rad/s)", unit * time, speed + noise)
    assert ("unlikely-coast" in ids(analyze_coast_down(path))) == told
