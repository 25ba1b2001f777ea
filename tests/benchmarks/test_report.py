"""The report of a whole run: `uv run pytest tests/benchmarks/test_report.py --benchmark-enable -n 0`."""

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One run of every procedure on the virtual bench."""
    folder = tmp_path_factory.mktemp("report")
    command = [sys.executable, "-m", "bench", "demo", "--json", "--runs", str(folder)]
    subprocess.run(command, capture_output=True, check=True)
    return folder


@pytest.mark.parametrize("language", ["en", "zh", "both"])
def test_page_and_pdf_from_start_to_end(benchmark, runs: Path, language: str) -> None:
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}

    def report() -> None:
        command = [sys.executable, "-m", "bench", "report", "latest", "--runs", str(runs), "--language", language]
        subprocess.run(command, capture_output=True, check=True, env=environment)

    benchmark.pedantic(report, rounds=5, warmup_rounds=1)
    sizes = {path.suffix[1:]: path.stat().st_size // 1024 for path in runs.glob(f"*/report-{language}.*")}
    benchmark.extra_info["size, kB"] = sizes
    assert set(sizes) == {"html", "pdf"}
