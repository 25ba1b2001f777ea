"""A meter reads for an instant, or over all of the time to the next reading, while the shaft turns on: the file does not say."""

from pathlib import Path

import numpy as np
import pytest

from bench.analysis.rotor_sweep import analyze_rotor_sweep

READINGS, INTERVAL, RECORDS = 150, 0.4, 12


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_both_ends_of_what_a_meter_may_do_are_held(tmp_path: Path, share: float) -> None:
    random, held = np.random.default_rng(31), 0
    for _ in range(RECORDS):
        ld, lq = 1e-3, 1e-3 * random.uniform(1.2, 2.5)
        turn = 2 * np.pi * random.uniform(1.5, 4.0) / 60.0
        seen = np.sinc(turn * INTERVAL * share / np.pi)
        time = INTERVAL * np.arange(READINGS)
        swing = (lq - ld) * seen * np.cos(2.0 * (turn * time - random.uniform(0, np.pi)))
        line = ld + lq - swing + 1e-7 * random.standard_normal(READINGS)
        rows = [f"{t:.1f},{value:.9f}" for t, value in zip(time, line, strict=True)]
        file = tmp_path / "sweep.csv"
        file.write_text("time (s),L (H)\n" + "\n".join(rows) + "\n")
        found = analyze_rotor_sweep(file)["parameters"]
        for name, truth in (("d_axis_inductance", ld), ("q_axis_inductance", lq)):
            low, high = found[name]["coverage_interval"]
            held += low <= truth <= high
    assert held >= 0.9 * 2 * RECORDS
