"""Whole runs through the command line."""

import json

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
