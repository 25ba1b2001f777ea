"""A line of another house: its hipot step, its meter and its output, from one wheel, through eol check, eol run and its own tests."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PROJECT = ROOT / "docs" / "examples" / "line-project"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the project's wheel, its plan, motor and station; the package's source is not there."""
    made = tmp_path_factory.mktemp("acme")
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    metadata = f"acme_line-{project['version']}.dist-info"
    entries = "\n".join(
        f"[{group}]\n" + "\n".join(f"{name} = {value}" for name, value in points.items())
        for group, points in project["entry-points"].items()
    )
    with zipfile.ZipFile(made / f"acme_line-{project['version']}-py3-none-any.whl", "w") as archive:
        for module in sorted((PROJECT / "acme_line").glob("*.py")):
            archive.write(module, f"acme_line/{module.name}")
        archive.writestr(
            f"{metadata}/METADATA", f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
        )
        archive.writestr(f"{metadata}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        archive.writestr(f"{metadata}/entry_points.txt", entries)
        archive.writestr(f"{metadata}/RECORD", "")
    for file in PROJECT.glob("*.toml"):
        if file.name != "pyproject.toml":
            shutil.copy(file, made)
    shutil.copytree(PROJECT / "tests", made / "tests")
    return made


def run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run a module of Python with the wheel on the path, in the folder."""
    (wheel,) = folder.glob("*.whl")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(wheel), str(ROOT))), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(
        [sys.executable, "-m", *words], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.slow
def test_check_measures_by_the_own_step_and_the_own_meter_of_the_station(folder: Path) -> None:
    done = run(
        folder,
        *("bench", "eol", "check", "plan.toml", "--station", "station.toml", "--each", "0", "--sound", "2"),
        *("--jobs", "1", "--json"),
    )
    assert done.returncode == 0, done.stdout + done.stderr
    said = json.loads(done.stdout)
    assert [each["procedure"] for each in said["procedures"]] == ["hipot", "stator-resistance-dc"]
    assert not any("voltmeter" in difference for difference in said["differences"]), (
        "the station's own meter stands there"
    )
    figures = {each["parameter"]: each for each in said["defect_check"]["figures"]}
    assert figures["leakage_current"]["mean"] == pytest.approx(500.0 / 2e9, rel=0.1)


@pytest.mark.slow
def test_a_batch_hands_its_records_to_the_own_output(folder: Path) -> None:
    done = run(
        folder, "bench", "eol", "run", "plan.toml", "--station", "virtual", "--sockets", "2", "--motors", "3", "--json"
    )
    assert done.returncode == 0, done.stdout + done.stderr
    kept = sorted(folder.glob("runs/acme-pump/mes/*.json"))
    assert [file.stem for file in kept] == ["A000001", "A000002", "A000003"]
    record = json.loads(kept[0].read_text(encoding="utf-8"))
    assert record["verdict"] == "pass"
    assert {"leakage_current", "stator_resistance"} <= record["figures"].keys()
    stats = run(folder, "bench", "eol", "stats", "--parameter", "leakage_current", "--language", "en")
    assert "Leakage current to the frame" in stats.stdout, stats.stderr


@pytest.mark.slow
def test_its_own_tests_pass_the_meter_s_conformance_among_them(folder: Path) -> None:
    plugins = ("-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:benchmark")
    done = run(folder, "pytest", "-q", *plugins, f"--rootdir={folder}", "tests")
    assert "4 passed" in done.stdout, done.stdout + done.stderr
