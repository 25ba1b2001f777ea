"""Voltages and currents that a bench hardly has: a probe's factor of 100, or mA under a heading in A."""

from pathlib import Path

import numpy as np
import pytest

from bench.analysis import analyze_back_emf, analyze_step_response

TIME = (np.arange(2000) - 400) * 1e-5


@pytest.mark.parametrize(("factor", "told"), [(1.0, False), (40.0, False), (1000.0, True), (1e-5, True)])
def test_a_step_s_current_beyond_benches_is_asked_about(tmp_path: Path, factor: float, told: bool) -> None:
    random = np.random.default_rng(1)
    volts = np.where(TIME >= 0, 10.0, 0.0) + random.normal(0.0, 0.01, TIME.size)
    amperes = 10.0 * -np.expm1(-np.maximum(TIME, 0.0) / 1e-3) + random.normal(0.0, 0.01, TIME.size)
    path = tmp_path / "step.csv"
    np.savetxt(
        path, np.column_stack((TIME, volts, factor * amperes)), delimiter=",", header="t (s),u (V),i (A)", comments=""
    )
    warnings = {each["id"] for each in analyze_step_response(path)["warnings"]}
    assert ("unusual-current" in warnings) is told


@pytest.mark.parametrize(("factor", "told"), [(1.0, False), (0.01, True), (1e4, True)])
def test_a_back_emf_beyond_oscilloscopes_is_asked_about(tmp_path: Path, factor: float, told: bool) -> None:
    volts = 2.0 * np.sin(2.0 * np.pi * 200.0 * TIME) + np.random.default_rng(1).normal(0.0, 0.01, TIME.size)
    path = tmp_path / "emf.csv"
    np.savetxt(path, np.column_stack((TIME, factor * volts)), delimiter=",", header="t (s),CH1 (V)", comments="")
    warnings = {each["id"] for each in analyze_back_emf(path, coupling={"": "dc"})["warnings"]}
    assert ("unusual-voltage" in warnings) is told
