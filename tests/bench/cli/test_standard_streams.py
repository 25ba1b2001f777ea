"""Standard streams that a caller closed, that know few characters, or whose disk is full."""

import os
import subprocess
import sys

import pytest

from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from tests.bench.eol.motor_records import motor_record

COMMAND = [sys.executable, "-m", "motorbench"]
MEASURE = ["run", "stator-resistance", "--station", "virtual", "--motor", "lg-400w", "--json"]


def run(*words: str, buffered: bool = True, **given: object) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONUNBUFFERED": "" if buffered else "1", **given.pop("environment", {})}
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **given}
    return subprocess.run([*COMMAND, *words], text=True, env=environment, timeout=60, check=False, **streams)


@pytest.mark.parametrize("buffered", [True, False])
def test_output_on_a_full_disk_is_said_to_be_incomplete(buffered):
    with open("/dev/full", "w") as full:
        done = run("export", "--list", buffered=buffered, stdout=full)
    assert done.returncode == 1
    assert done.stderr.startswith("motorbench: standard output: no space is left on the disk; what was to be printed")


def test_records_on_a_full_disk_are_said_to_be_incomplete(tmp_path):
    engine = open_database(str(tmp_path / "records.sqlite"))
    Records(engine).save(motor_record())
    engine.dispose()
    with open("/dev/full", "w") as full:
        done = run("eol", "export", "--format", "jsonl", buffered=False, stdout=full, cwd=tmp_path)
    assert done.returncode == 1
    assert done.stderr.startswith("motorbench: standard output: no space is left on the disk; what was to be printed")


def test_a_log_on_a_full_disk_stops_no_measurement(tmp_path):
    with open("/dev/full", "w") as full:
        done = run(*MEASURE, buffered=False, stderr=full, cwd=tmp_path)
    assert done.returncode == 0
    assert '"stator_resistance"' in done.stdout


def test_closed_streams_are_no_error(tmp_path):
    words = " ".join([*COMMAND, *MEASURE])
    done = subprocess.run(["sh", "-c", f"{words} <&- >&- 2>&-"], cwd=tmp_path, timeout=60, check=False)
    assert done.returncode == 0
    assert len(list(tmp_path.glob("runs/*/result.json"))) == 1


def test_an_output_of_few_characters_has_the_others_escaped():
    done = run("procedures", "--language", "zh", environment={"PYTHONIOENCODING": "ascii"})
    assert (done.returncode, done.stderr) == (0, "")
    assert "\\u6570\\u636e\\u624b\\u518c" in done.stdout


def test_a_run_that_was_killed_is_said_to_have_ended_without_a_word():
    done = run("results", "tests/data/runs/killed", "--language", "en")
    assert "the run was interrupted: its process ended without a word\n" in done.stderr
