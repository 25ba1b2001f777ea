"""The plugin as another team has it: the example's tests in a process of their own, and what it costs who does not use it."""

import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

from bench.i18n.errors import InputError
from bench.testing import assert_holds_truth, virtual_motor
from procedures.core.result import Parameter
from tests.bench.testing.own_pytest import own_pytest

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "docs" / "examples" / "ci-project"


@pytest.mark.slow
def test_the_example_project() -> None:
    done = own_pytest(EXAMPLE, EXAMPLE)
    assert done.returncode == 0
    assert "9 passed" in done.stdout, done.stdout + done.stderr


def test_the_entry_point_names_the_plugin() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert hasattr(import_module(project["entry-points"]["pytest11"]["motorbench"]), "virtual_bench")


def test_who_does_not_use_it_loads_nothing() -> None:
    program = (
        "import sys, pytest, motorbench.pytest_plugin\n"
        "print([name for name in ('numpy', 'scipy', 'pyvisa', 'sqlalchemy', 'bench.testing', 'sim_instruments') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_plan_that_is_wrong_says_where(tmp_path: Path) -> None:
    (tmp_path / "test_it.py").write_text(f"def test_it(eol_plan):\n    eol_plan('{tmp_path}/plan.toml')\n")
    (tmp_path / "plan.toml").write_text('[plan]\nname = "x"\nmotor = "lg-400w"\n[[procedure]]\nname = "inertie"\n')
    done = own_pytest(EXAMPLE, tmp_path)
    assert done.returncode == 1
    assert "1 failed" in done.stdout
    assert "did you mean inertia" in done.stdout


def parameter(value: float, half: float) -> Parameter:
    return Parameter("r", value, "Ω", half / 2.0, 9.0, (value - half, value + half), "p", "3", "e")


def test_what_holds_and_what_does_not() -> None:
    assert_holds_truth({"r": parameter(1.0, 0.1)}, {"r": 1.19})
    with pytest.raises(AssertionError, match=r"r = 1 Ω, 0\.8 … 1\.2 does not hold the truth 1\.21"):
        assert_holds_truth({"r": parameter(1.0, 0.1)}, {"r": 1.21})
    with pytest.raises(AssertionError, match="l: not measured"):
        assert_holds_truth({"r": parameter(1.0, 0.1)}, {"r": 1.0}, names=["r", "l"])
    with pytest.raises(AssertionError, match="nothing to compare"):
        assert_holds_truth({"r": parameter(1.0, 0.1)}, {})


def test_a_truth_that_a_motor_has_not() -> None:
    with pytest.raises(InputError, match="did you mean flux_linkage"):
        virtual_motor("lg-400w", flux_linkagee=1.0)
