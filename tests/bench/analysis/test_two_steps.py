"""Steps of one motor in several files: what is to be done is said, and each file is served by itself."""

import numpy as np
import pytest

from bench.analysis.step_response import analyze_step_response
from bench.captures import CaptureError


def step_file(path, resistance, seed):
    time = 2e-6 * np.arange(4000) - 1e-3
    random = np.random.default_rng(seed)
    current = np.where(time > 0.0, 1.0 / resistance * (1.0 - np.exp(-time * resistance / 5e-4)), 0.0)
    columns = [time, np.where(time > 0.0, 1.0, 0.0), current]
    columns[1:] = [each + 2e-3 * random.standard_normal(time.size) for each in columns[1:]]
    np.savetxt(
        path,
        np.column_stack(columns),
        delimiter=",",
        fmt="%.7g",
        header="time (s),voltage (V),current (A)",
        comments="",
    )
    return path


def test_two_whole_steps_together(tmp_path):
    files = [step_file(tmp_path / f"{name}.csv", 0.5, seed) for seed, name in enumerate(("one", "two"))]
    with pytest.raises(CaptureError, match=r"each of the 2 files has a voltage and a current.*one after the other"):
        analyze_step_response(files)
    for path in files:
        assert analyze_step_response(path)["parameters"]["loop_resistance"]["value"] == pytest.approx(0.5, rel=0.01)
