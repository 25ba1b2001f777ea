"""A user's own folder that bears the name of one of our packages is named in one sentence, wherever the program begins."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from motorbench import PACKAGES, shadowed

ROOT = Path(__file__).parents[2]


def start(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], cwd=folder, capture_output=True, text=True, check=False)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "drivers").mkdir()
    (tmp_path / "drivers" / "__init__.py").touch()
    (tmp_path / "reports").mkdir()
    (tmp_path / "test_it.py").write_text("def test_it(virtual_motor):\n    assert virtual_motor()\n")
    return tmp_path


def sentence(folder: Path) -> str:
    return f"{folder / 'drivers' / '__init__.py'} stands where Python should find motorbench's own package 'drivers': rename it"


@pytest.mark.parametrize("module", ["bench", "motorbench"])
def test_the_command_line(folder: Path, module: str) -> None:
    done = start(folder, "-m", module, "procedures", "--json")
    assert done.returncode == 1
    assert done.stderr.startswith(f"motorbench: {sentence(folder)}")
    assert done.stderr.count("\n") == 1
    assert json.loads(done.stdout)["error"].startswith(sentence(folder))


def test_a_search_path_without_that_folder(folder: Path) -> None:
    assert start(folder, "-P", "-m", "motorbench", "--version").returncode == 0


def test_the_plugin(folder: Path) -> None:
    quiet = ("-q", "-p", "no:cacheprovider", "-p", "no:benchmark", "-p", "no:xdist")
    done = start(folder, "-m", "pytest", *quiet, "test_it.py")
    assert done.returncode == 1
    assert sentence(folder) in done.stdout
    assert "Traceback" not in done.stdout


def test_a_module_that_is_loaded_already(monkeypatch: pytest.MonkeyPatch) -> None:
    assert shadowed() == ""
    monkeypatch.setitem(sys.modules, "reports", json)
    assert shadowed().startswith(f"{json.__file__} stands where Python should find motorbench's own package 'reports'")


def test_every_package_is_looked_for() -> None:
    assert all((ROOT / name / "__init__.py").is_file() for name in PACKAGES)
    folders = {path.parent.name for path in ROOT.glob("*/__init__.py")}
    assert folders == {*PACKAGES, "motorbench"}
