"""pytest as another team runs it: their folder, motorbench's plug-in, a process of its own."""

import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from tests.studies.forked import Forked

_PATIENCE = 300.0


def _pytest(folder: str, *words: str) -> None:
    sys.path.insert(0, folder)
    raise SystemExit(pytest.main(list(words)))


def own_pytest(folder: Path, *paths: Path) -> subprocess.CompletedProcess[str]:
    """Return how pytest has ended with the tests of these paths, in a project's folder, and what it said."""
    # An installation that is older than the entry point gets the plugin by name.
    installed = any(point.value == "motorbench.pytest_plugin" for point in entry_points(group="pytest11"))
    by_name = [] if installed else ["-p", "motorbench.pytest_plugin"]
    without = [word for plugin in ("cacheprovider", "xdist", "benchmark") for word in ("-p", f"no:{plugin}")]
    # What this process has loaded before is not its project's fault.
    loaded = ("-W", "ignore::pytest.PytestAssertRewriteWarning")
    words = ("-q", *loaded, *without, *by_name, f"--rootdir={folder}", *map(str, paths))
    process = Forked(_pytest, str(folder), *words, folder=folder)
    try:
        output, errors = process.communicate(_PATIENCE)
        assert process.returncode is not None
        return subprocess.CompletedProcess(words, process.returncode, output, errors)
    finally:
        process.close()
