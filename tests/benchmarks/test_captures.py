"""A deep record of an oscilloscope, from the file to its channels."""

from pathlib import Path
from time import process_time

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from bench.captures.reading import read_capture

ROWS = 500_000


@pytest.fixture(scope="module")
def deep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("captures") / "deep.csv"
    time = np.arange(ROWS) * 1e-7
    volts = [np.round(12.0 * np.cos(2.0 * np.pi * (50.0 * time - k / 3.0)), 2) for k in range(3)]
    table = np.column_stack([time, *volts])
    heading = "Time (s),CH1 (V),CH2 (V),CH3 (V)"
    np.savetxt(path, table, fmt=["%.7e", *["%.2f"] * 3], delimiter=",", header=heading, comments="")
    return path


def test_a_deep_record_against_plain_numpy(benchmark: BenchmarkFixture, deep: Path) -> None:
    begin = process_time()
    table = np.loadtxt(deep, delimiter=",", skiprows=1)
    alone = process_time() - begin
    begin = process_time()
    capture = benchmark.pedantic(read_capture, (deep,), rounds=1)
    benchmark.extra_info["times numpy"] = (process_time() - begin) / alone
    assert np.array_equal(capture.channels[2].values, table[:, 3])
