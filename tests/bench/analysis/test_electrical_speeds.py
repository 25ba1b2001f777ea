"""Logs of controllers, whose speed is often an electrical one, in units that are not the shaft's."""

from pathlib import Path

import numpy as np
import pytest

from bench.analysis import analyze_coast_down
from bench.captures import CaptureError, CapturePart

PAIRS, COULOMB, VISCOUS = 7, 50.0, 0.2


def _coast() -> tuple[np.ndarray, np.ndarray]:
    """Return time (s) and speed of the shaft (rad/s)."""
    time = np.arange(0.0, 5.0, 0.01)
    return time, (500.0 + COULOMB / VISCOUS) * np.exp(-VISCOUS * time) - COULOMB / VISCOUS


def _table(path: Path, heading: str, *columns: np.ndarray, sep: str = ",") -> Path:
    rows = (
        sep.join(f"{value:.7g}" if value < 1e6 else f"{value:.0f}" for value in row)
        for row in zip(*columns, strict=True)
    )
    path.write_text("\n".join((heading, *rows)) + "\n")
    return path


def _is_held(found: dict[str, dict[str, object]]) -> None:
    for name, truth in (("coulomb_deceleration", COULOMB), ("viscous_rate", VISCOUS)):
        value = found[name]["value"]
        assert isinstance(value, float)
        assert value == pytest.approx(truth, rel=0.02)


def test_the_log_of_a_vesc(tmp_path: Path) -> None:
    time, speed = _coast()
    erpm = np.round(speed * 30 / np.pi * PAIRS + 20 * np.random.default_rng(3).standard_normal(speed.size))
    file = _table(
        tmp_path / "log.csv",
        "ms_today;input_voltage;temp_mos_max;erpm;duty_cycle",
        np.round(36_000_000 + 1000 * time), np.full(time.size, 48.1), np.full(time.size, 31.2), erpm, np.zeros(time.size),
        sep=";",
    )  # fmt: skip
    with pytest.raises(CaptureError, match="--pole-pairs"):
        analyze_coast_down(file, selection=CapturePart(time_column="ms_today", time_unit="ms"))
    made = analyze_coast_down(file, pole_pairs=PAIRS, selection=CapturePart(time_column="ms_today", time_unit="ms"))
    _is_held(made["parameters"])
    assert any("7 pole pairs" in line for line in made["assumptions"])


@pytest.mark.parametrize("unit", ["turn/s", "turns/s", "rev/s", "r/s", "rps"])
def test_turns_a_second(tmp_path: Path, unit: str) -> None:
    time, speed = _coast()
    noise = 0.02 * np.random.default_rng(4).standard_normal(time.size)
    file = _table(tmp_path / "log.csv", f"time (s),vel_estimate ({unit})", time, speed / (2 * np.pi) + noise)
    _is_held(analyze_coast_down(file)["parameters"])


@pytest.mark.parametrize(("unit", "factor"), [("Hz", 1.0), ("kHz", 1e-3)])
def test_periods_a_second(tmp_path: Path, unit: str, factor: float) -> None:
    time, speed = _coast()
    periods = factor * (speed * PAIRS / (2 * np.pi) + 0.05 * np.random.default_rng(5).standard_normal(time.size))
    file = _table(tmp_path / "log.csv", f"time (s),f ({unit})", time, periods)
    with pytest.raises(CaptureError, match="turns or electrical periods"):
        analyze_coast_down(file)
    with pytest.raises(CaptureError, match="Type --pole-pairs as well"):
        analyze_coast_down(file, electrical=True)
    made = analyze_coast_down(file, electrical=True, pole_pairs=PAIRS)
    _is_held(made["parameters"])
    assert not any("not known" in line for line in made["assumptions"])


def test_pole_pairs_do_not_change_the_shafts_own_speed(tmp_path: Path) -> None:
    time, speed = _coast()
    file = _table(tmp_path / "log.csv", "time (s),speed (rad/s)", time, speed)
    with pytest.raises(CaptureError, match="does not depend on the pole pairs"):
        analyze_coast_down(file, pole_pairs=PAIRS)
    with pytest.raises(CaptureError, match="radians a second"):
        analyze_coast_down(_table(tmp_path / "open.csv", "time (s),speed (1/s)", time, speed))
