"""`motorbench station drivers NAME`: what a driver sends, and who says that the instrument has it."""

import json
import re
from pathlib import Path

import pytest

from tests.command_line import Call


def test_a_drivers_commands_with_their_sources(call: Call) -> None:
    code, out, err = call("station", "drivers", "gwinstek-gpt9800", "--language", "en")
    assert (code, err) == (0, "")
    assert re.search(r"^FUNC:TEST\? +two sources or more +newcore, panel-python, bench-python$", out, re.MULTILINE)
    assert re.search(r"^TEST:RET\? +one source +station-network$", out, re.MULTILINE)
    assert "public on GitHub as `NetDev_Test.TEST_RET_ON`" in out


def test_in_chinese(call: Call) -> None:
    _, out, _ = call("station", "drivers", "delta-dyn200", "--language", "zh")
    assert re.search(r"^drive 0000H +无来源 +–$", out, re.MULTILINE)


def test_one_that_only_listens(call: Call) -> None:
    assert call("station", "drivers", "can-frame", "--language", "en") == (0, "it sends nothing\n\n", "")


def test_as_json(call: Call) -> None:
    code, out, _ = call("station", "drivers", "beckhoff-bk9000", "--json")
    made = json.loads(out)
    assert (code, made["driver"]) == (0, "beckhoff-bk9000")
    status = made["commands"][0]
    assert (status["command"], status["independent"]) == ("100CH", 2)
    assert status["sources"][0]["address"].startswith("https://infosys.beckhoff.com/")


def test_a_name_that_is_none(call: Call) -> None:
    code, out, err = call("station", "drivers", "manual")
    assert code != 0
    assert out == ""
    assert (
        "manual: no driver of this name states the sources of its commands; those that do are: cia402-inverter, " in err
    )


PLUG_IN = """
from drivers.bases.scpi_supply import ScpiSupplyOptions
from drivers.catalogue import Driver
from drivers.interfaces import Role

DRIVER = Driver("lamp", Role.SUPPLY, ScpiSupplyOptions, "lamp:opened", commands_in="{package}")
"""


def plug_in(folder: Path, package: str) -> str:
    (folder / "plugin.py").write_text(PLUG_IN.format(package=package), encoding="utf-8")
    (folder / "s.toml").write_text('[station]\nname = "s"\n[plugins]\nfiles = ["plugin.py"]\n', encoding="utf-8")
    return str(folder / "s.toml")


@pytest.mark.parametrize(
    ("written", "said"),
    [
        (None, "lamp: lamp_{} has no table [lamp] in a sources.toml"),
        ("[other]\n", "lamp: lamp_{} has no table [lamp] in a sources.toml"),
        ("[lamp\n", "lamp: sources.toml of lamp_{} cannot be used (Expected"),
        (
            '[lamp]\n"*IDN?" = ["nobody"]\n',
            "lamp: sources.toml of lamp_{} cannot be used (*IDN?: there is no source nobody)",
        ),
        ('[lamp]\n"*IDN?" = 3\n', "lamp: sources.toml of lamp_{} cannot be used ("),
        ("lamp = 3\n", "lamp: sources.toml of lamp_{} cannot be used ("),
        ('[sources.me]\n[lamp]\n"*IDN?" = ["me"]\n', "lamp: sources.toml of lamp_{} cannot be used ("),
    ],
)
def test_a_plug_ins_table_that_cannot_be_used_is_named_and_takes_nothing_else_down(
    call: Call,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    written: str | None,
    said: str,
    request: pytest.FixtureRequest,
) -> None:
    number = f"{abs(hash(request.node.name)):x}"
    package = tmp_path / f"lamp_{number}"
    package.mkdir()
    (package / "__init__.py").touch()
    if written is not None:
        (package / "sources.toml").write_text(written, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    station = plug_in(tmp_path, package.name)
    code, out, err = call("station", "drivers", "lamp", "--station", station, "--language", "en")
    assert (code, out) == (1, "")
    assert f"motorbench: {said.format(number)}" in err
    assert "program error" not in err
    code, _, err = call("station", "drivers", "gwinstek-gpt9800", "--station", station)
    assert (code, err) == (0, "")
    code, out, err = call("station", "drivers", "--markdown", "--station", station, "--language", "en")
    assert (code, "## `delta-dyn200`" in out, "## `lamp`" in out) == (1, True, False)
    assert said.format(number) in err


def test_a_plug_ins_package_that_is_not_there(call: Call, tmp_path: Path) -> None:
    station = plug_in(tmp_path, "no_such_package")
    code, _, err = call("station", "drivers", "lamp", "--station", station, "--language", "zh")
    assert code == 1
    assert "lamp：no_such_package 的 sources.toml 无法使用（No module named 'no_such_package'）" in err


def test_markdown_of_one_driver(call: Call) -> None:
    code, out, _ = call("station", "drivers", "delta-dyn200", "--markdown")
    assert (code, out.count("## `")) == (0, 1)
    assert call("station", "drivers", "nosuch", "--markdown")[0] == 2
