"""Records whose times are a thousand times too long or too short for what they show."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.analysis.back_emf import analyze_back_emf
from bench.analysis.coast_down import analyze_coast_down
from bench.analysis.step_response import analyze_step_response
from bench.captures import CaptureError, CapturePart


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


@pytest.mark.parametrize(
    ("frequency", "said", "given"), [(700.0, True, False), (900.0, True, True), (40.0, False, True)]
)
def test_a_frequency_that_may_be_another_folded_back_is_asked_about(
    tmp_path: Path, frequency: float, said: bool, given: bool
) -> None:
    time = np.arange(4000) / 1000.0
    noise = np.random.default_rng(2).normal(0.0, 0.01, time.size)
    wave = 2.0 * np.sin(2.0 * np.pi * frequency * time) + noise
    path = written(tmp_path / "emf.csv", "t (s),u (V)", time, wave)
    found = analyze_back_emf(path, coupling={"": "dc"})
    told = ids(found) | {row["cause"] for row in found["withheld"].values()}
    assert ("few-samples" in told, "flux_linkage" in found["parameters"]) == (said, given)


def test_few_samples_suffice_where_the_tachometer_confirms_the_frequency(tmp_path: Path) -> None:
    time = np.arange(4000) / 1000.0
    noise = np.random.default_rng(2).normal(0.0, 0.01, time.size)
    path = written(tmp_path / "emf.csv", "t (s),u (V)", time, 2.0 * np.sin(2.0 * np.pi * 300.0 * time) + noise)
    for rpm, given in ((4500.0, True), (10500.0, False)):
        found = analyze_back_emf(path, coupling={"": "dc"}, pole_pairs=4, speed_rpm=rpm)
        assert ("flux_linkage" in found["parameters"]) == given


def test_an_order_beyond_the_sampling_is_refused_with_the_highest_one(tmp_path: Path) -> None:
    time = np.arange(4000) / 1000.0
    noise = np.random.default_rng(2).normal(0.0, 0.01, time.size)
    path = written(tmp_path / "emf.csv", "t (s),u (V)", time, 2.0 * np.sin(2.0 * np.pi * 40.0 * time) + noise)
    with pytest.raises(CaptureError, match=r"order 13 of 40 Hz .* orders up to 11"):
        analyze_back_emf(path, harmonics=(1, 5, 13))
    assert "flux_linkage" in analyze_back_emf(path, harmonics=(1, 5, 11))["parameters"]


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


@pytest.mark.parametrize(("heading", "options"), [("t,Van", CapturePart()), ("", CapturePart()), ("t (s),Van", None)])
def test_a_frequency_that_is_usual_in_ms_too_needs_the_unit_of_time(
    heading: str, options: CapturePart | None, tmp_path: Path
) -> None:
    time = np.linspace(0.0, 2.0, 4001)
    noise = np.random.default_rng(3).normal(0.0, 0.01, time.size)
    path = written(tmp_path / "emf.csv", heading or "# none", time, 2.0 * np.sin(2.0 * np.pi * 5.0 * time) + noise)

    def analyzed(**more: Any) -> dict:
        return analyze_back_emf(path, coupling={"": "dc"}, connection="neutral", **more)

    found = analyzed()
    if options is None:
        assert found["parameters"]["flux_linkage"]["value"] == pytest.approx(2.0 / (2.0 * np.pi * 5.0), rel=0.01)
        with pytest.raises(CaptureError, match="states its unit itself"):
            analyzed(selection=CapturePart(time_unit="ms"))
        return
    assert {row["cause"] for row in found["withheld"].values()} == {"time-unit-open"}
    assert "flux_linkage" in found["withheld"]
    assert "5e+03 Hz for times in ms" in found["withheld"]["flux_linkage"]["message"]
    for unit, frequency in (("s", 5.0), ("ms", 5e3)):
        found = analyzed(selection=CapturePart(time_unit=unit))
        assert not found["withheld"]
        assert found["parameters"]["flux_linkage"]["value"] == pytest.approx(2.0 / (2.0 * np.pi * frequency), rel=0.01)
    assert "flux_linkage" in analyzed(pole_pairs=5, speed_rpm=60.0)["parameters"]


def test_a_frequency_that_only_seconds_explain_needs_no_unit(tmp_path: Path) -> None:
    time = np.linspace(0.0, 0.1, 4001)
    noise = np.random.default_rng(2).normal(0.0, 0.01, time.size)
    path = written(tmp_path / "emf.csv", "t,u", time, 2.0 * np.sin(2.0 * np.pi * 100.0 * time) + noise)
    found = analyze_back_emf(path, coupling={"": "dc"}, connection="line")
    assert "flux_linkage" in found["parameters"]
    assert "time taken to be in s" in found["assumptions"]


@pytest.mark.parametrize(("stretch", "given"), [(1.0, True), (1e3, False)])
def test_steps_and_coast_downs_of_open_time(stretch: float, given: bool, tmp_path: Path) -> None:
    random = np.random.default_rng(4)
    time = np.linspace(0.0, 4.0, 400)
    speed = 3000.0 - 700.0 * time + random.normal(0.0, 0.5, time.size)
    path = written(tmp_path / "coast.csv", "time,speed (rpm)", stretch * time, speed)
    found = analyze_coast_down(path, inertia=1e-3)
    assert ("coulomb_friction" in found["parameters"]) == given
    assert ("coulomb_deceleration" in found["parameters"]) == given
    time = np.linspace(-0.002, 0.008, 2001)
    v = np.where(time > 0.0, 2.0, 0.0) + random.normal(0.0, 0.004, time.size)
    i = -np.expm1(-np.maximum(time, 0.0) / 1e-3) + random.normal(0.0, 0.002, time.size)
    found = analyze_step_response(written(tmp_path / "step.csv", "t,u (V),i (A)", stretch * time, v, i))
    assert ("loop_inductance" in found["parameters"]) == given
    assert "loop_resistance" in found["parameters"]


def test_a_light_rotor_that_turns_for_minutes_is_asked_about(tmp_path: Path) -> None:
    time = np.linspace(0.0, 800.0, 400)
    speed = 2865.0 - 3.2 * time + np.random.default_rng(4).normal(0.0, 0.5, time.size)
    path = written(tmp_path / "coast.csv", "time (s),speed (rpm)", time, speed)
    assert "unlikely-coast" in ids(analyze_coast_down(path, inertia=6e-5))
    assert "unlikely-coast" not in ids(analyze_coast_down(path, inertia=2.0))
    assert "unusual-size" in ids(analyze_coast_down(path, inertia=2000.0))


def test_a_flux_linkage_that_hardly_any_motor_has_is_asked_about(tmp_path: Path) -> None:
    time = np.linspace(0.0, 0.1, 4001)
    wave = np.sin(2.0 * np.pi * 100.0 * time) + np.random.default_rng(2).normal(0.0, 0.01, time.size)
    for volts, asked in ((10.0, False), (1e4, True)):
        found = analyze_back_emf(
            written(tmp_path / "emf.csv", "t (s),u (V)", time, volts * wave), coupling={"": "dc"}, connection="neutral"
        )
        assert ("unusual-size" in ids(found)) == asked
        assert "flux_linkage" in found["parameters"]
