"""A station without instruments, with procedures that withhold figures and give them."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.bench.withheld.withholding import GIVEN, PROCEDURE, WITHHELD
from tests.command_line import Call

Measured = Callable[..., tuple[int, str, str]]


@pytest.fixture
def station(tmp_path: Path) -> str:
    """A station without instruments, with a procedure that withholds two figures and one that gives them."""
    for name, answers in (("withholding", WITHHELD), ("giving", GIVEN)):
        (tmp_path / f"{name}.py").write_text(
            PROCEDURE.replace("{name}", name).replace("{answers}", repr(answers)), encoding="utf-8"
        )
    path = tmp_path / "station.toml"
    path.write_text('[station]\nname = "nothing"\n[plugins]\nfiles = ["withholding.py", "giving.py"]\n')
    return str(path)


@pytest.fixture
def measured(call: Call, station: str) -> Callable[..., tuple[int, str, str]]:
    def run(*procedures: str, json: bool = False, language: str = "en") -> tuple[int, str, str]:
        more = ("--json",) if json else ()
        return call("run", *procedures, "--station", station, "--motor", "lg-400w", "--language", language, *more)

    return run
