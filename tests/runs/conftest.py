"""Whole runs through the command line."""

import io
import json
from contextlib import redirect_stdout

import pytest

from bench.cli.main import main


@pytest.fixture
def motorbench(tmp_path, capsys):
    """Run the command line in process with `--json` and return the exit status and the one object it printed."""

    def run(*arguments: str) -> tuple[int, dict]:
        with pytest.raises(SystemExit) as stopped:
            main([*arguments, "--runs", str(tmp_path / "runs"), "--json"])
        return stopped.value.code, json.loads(capsys.readouterr().out)

    return run


@pytest.fixture(scope="session")
def motorbench_once(tmp_path_factory):
    """As `motorbench`, each command once for all tests, which only read what it gave and kept."""
    kept = {}

    def run(*arguments: str) -> tuple[int, dict]:
        if arguments not in kept:
            runs, printed = tmp_path_factory.mktemp("runs"), io.StringIO()
            with redirect_stdout(printed), pytest.raises(SystemExit) as stopped:
                main([*arguments, "--runs", str(runs), "--json"])
            kept[arguments] = stopped.value.code, json.loads(printed.getvalue())
        return kept[arguments]

    return run
