"""What a user waits for: `uv run pytest tests/benchmarks/test_command_line.py --benchmark-enable -n 0`."""

import json
import os
import resource
import subprocess
import sys

import pytest


@pytest.fixture
def command(tmp_path):
    """Run the command line in a process of its own, with compiled bytecode, and return what it printed."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}

    def run(*arguments: str) -> str:
        done = subprocess.run(
            [sys.executable, "-m", "bench", *arguments],
            capture_output=True,
            text=True,
            check=True,
            cwd=tmp_path,
            env=environment,
        )
        return done.stdout

    return run


def test_help(benchmark, command):
    assert "demo" in benchmark(command, "--help")


def test_demo_from_start_to_end(benchmark, command):
    given = json.loads(benchmark.pedantic(command, args=("demo", "--json"), rounds=3, warmup_rounds=1))
    assert given["status"] == "completed"
    benchmark.extra_info["bench time over wall time"] = round(given["bench_time"] / given["wall_time"])
    benchmark.extra_info["peak memory, MB"] = round(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)
