"""Where declarations come from, what is said of those that cannot be used, and that they take nothing else down."""

import json
import os
import signal
import subprocess
import sys
import threading
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from bench.i18n.errors import InputError
from bench.plugins.catalogues import Catalogues, installed
from bench.plugins.files import PluginsSection, catalogues_of
from bench.plugins.records import RecordOutput, RecordOutputs
from bench.station.station_file import load_station
from drivers.interfaces import Role
from tests.command_line import Call

DRIVER = """
from drivers.catalogue import Driver
from drivers.interfaces import Role
from drivers.bases.scpi_supply import ScpiSupplyOptions

DRIVER = Driver("my-supply", Role.SUPPLY, ScpiSupplyOptions, "no_such_module:opened")
"""
STATION = """
[station]
name = "bench"
[plugins]
files = ["plugin.py"]
[instruments.{role}]
driver = "{driver}"
address = "TCPIP0::192.0.2.10::inst0::INSTR"
"""
Made = Callable[[str], Catalogues]


@pytest.fixture
def made(tmp_path: Path) -> Made:
    """The catalogues with a plug-in file of some content."""

    def make(code: str) -> Catalogues:
        (tmp_path / "plugin.py").write_text(code, encoding="utf-8")
        return catalogues_of(PluginsSection(files=["plugin.py"]), str(tmp_path / "station.toml"))

    return make


def wheel(folder: Path, name: str, entries: str, modules: Mapping[str, str], requires: Sequence[str] = ()) -> Path:
    """A wheel as installers have it; Python finds what is in it where it stands."""
    path = folder / f"{name}-1.2-py3-none-any.whl"
    metadata = f"{name}-1.2.dist-info"
    with zipfile.ZipFile(path, "w") as archive:
        for module, code in modules.items():
            archive.writestr(f"{module}.py", code)
        wanted = "".join(f"Requires-Dist: {line}\n" for line in requires)
        archive.writestr(f"{metadata}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n{wanted}")
        archive.writestr(f"{metadata}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        archive.writestr(f"{metadata}/entry_points.txt", entries)
        archive.writestr(f"{metadata}/RECORD", "")
    return path


def test_everything_of_ours_can_be_loaded() -> None:
    catalogues = installed()
    assert catalogues.broken() == ()
    assert len(catalogues.drivers) == 14
    assert len(catalogues.simulated_instruments) == 13
    assert len(catalogues.procedures) == 28
    assert len(catalogues.exports) == 18
    assert list(catalogues.records) == ["json-lines"]
    assert next(iter(catalogues.procedures)) == "nameplate"


def test_every_counterpart_of_a_driver_of_ours_is_there_and_of_its_role() -> None:
    simulated = installed().simulated_instruments
    for drivers in installed().drivers.values():
        for driver in drivers:
            assert not driver.simulated or simulated[driver.simulated].role == driver.role.value


def test_plug_ins_in_wheels(tmp_path: Path) -> None:
    good = wheel(
        tmp_path,
        "acme_motorbench",
        "[motorbench.drivers]\nmy-supply = acme_plugin:DRIVER\n",
        {"acme_plugin": DRIVER + "print('noise')\n"},
    )
    bad = wheel(
        tmp_path,
        "bad_motorbench",
        "[motorbench.drivers]\n"
        "keysight-e36300 = bad_plugin:DRIVER\nnothing = bad_plugin:ABSENT\nraises = raising_plugin:DRIVER\n"
        "other-name = bad_plugin:DRIVER\nexits = exiting_plugin:DRIVER\nunwritten = unwritten_plugin:DRIVER\n"
        "[motorbench.exports]\nwrong = bad_plugin:DRIVER\n",
        {
            "bad_plugin": DRIVER,
            "raising_plugin": "import raising_part",
            "raising_part": "raise RuntimeError('two\\nlines')",
            "exiting_plugin": "\nraise SystemExit(3)",
            "unwritten_plugin": "\nx = (",
        },
    )
    done = subprocess.run(
        [sys.executable, "-m", "bench", "station", "drivers", "--json"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (bad, good)))},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    found = {one["name"]: one for one in told["drivers"]}
    assert found["my-supply"]["from"] == {"name": "acme_motorbench", "version": "1.2"}
    assert found["keysight-e36300"]["from"]["name"] == "motorbench"
    assert not {"nothing", "raises", "other-name", "exits"} & found.keys()
    errors = {one["name"]: one["error"] for one in told["broken"]}
    assert errors["keysight-e36300"].startswith("the name is taken by motorbench")
    assert "no attribute 'ABSENT'" in errors["nothing"]
    assert errors["raises"] == "RuntimeError: two lines (raising_plugin.py, line 1)"
    assert errors["other-name"] == "it declares the name 'my-supply'"
    assert errors["exits"] == "SystemExit: 3 (exiting_plugin.py, line 2)"
    assert errors["unwritten"] == "SyntaxError: '(' was never closed (unwritten_plugin.py, line 2)"
    assert errors["wrong"] == "it is Driver, but must be a reports.exports.target.Target"


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("import no_such_library", "ModuleNotFoundError: No module named 'no_such_library'"),
        ("x = (", "SyntaxError: '(' was never closed"),
        ("x = 1", "it declares nothing"),
        ("raise SystemExit", "SystemExit: "),
        ("raise KeyboardInterrupt", "KeyboardInterrupt: "),
        ("raise GeneratorExit", "GeneratorExit: "),
    ],
)
def test_a_file_that_cannot_be_used_is_named_and_takes_nothing_else_down(made: Made, code: str, said: str) -> None:
    listens = signal.getsignal(signal.SIGINT)
    catalogues = made(code)
    assert signal.getsignal(signal.SIGINT) is listens
    (broken,) = catalogues.unusable
    assert said in str(broken.sentence)
    assert "plugin.py cannot be used" in str(broken.sentence)
    assert "\n" not in str(broken.sentence)
    assert catalogues.driver("manual", Role.SUPPLY) is not None


@pytest.mark.parametrize("code", ["\n\nraise SystemExit", "\n\nimport no_such_library", "x = 0\n\n1 / x"])
def test_a_file_that_cannot_be_used_says_in_which_line(made: Made, code: str) -> None:
    (broken,) = made(code).unusable
    assert str(broken.sentence).endswith("(plugin.py, line 3)")


def test_a_declaration_that_raises_when_it_is_looked_at_says_in_which_line(made: Made) -> None:
    (broken,) = made(
        "from procedures.core.procedure import Procedure, Settings\n"
        "class Wild(Procedure[Settings]):\n    name, title, section, roles, gives = 'wild', 'Wild', 'own', (), ()\n"
        "    def measure(self, settings): pass\n"
        "    @classmethod\n    def settings_type(cls): return cls.absent\n"
    ).broken()
    assert str(broken.sentence).endswith("has no attribute 'absent' (plugin.py, line 6)")


def test_ctrl_c_while_a_file_is_loaded_ends_the_command(tmp_path: Path) -> None:
    (tmp_path / "plugin.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)\nsignal.pause()\n")
    (tmp_path / "station.toml").write_text('[station]\nname = "s"\n[plugins]\nfiles = ["plugin.py"]\n')
    done = subprocess.run(
        [sys.executable, "-m", "bench", "station", "drivers", "--station", "station.toml"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert done.stderr == "motorbench: interrupted by Ctrl-C\n"


@pytest.mark.parametrize(
    ("code", "name", "said"),
    [
        (DRIVER.replace("my-supply", "manual"), "manual", "the name is taken by motorbench"),
        (
            "from procedures.core.procedure import Procedure, Settings\n"
            "class Half(Procedure[Settings]):\n    name = 'half'",
            "half",
            "Half does not define title, section, roles, measure",
        ),
    ],
)
def test_a_declaration_that_cannot_be_used_is_named(made: Made, code: str, name: str, said: str) -> None:
    (broken,) = made(code).broken()
    assert (broken.name, broken.origin.name.endswith("plugin.py")) == (name, True)
    assert said in str(broken.sentence)


def test_a_station_is_told_of_the_broken_plug_in_whose_driver_it_asks_for(tmp_path: Path) -> None:
    (tmp_path / "plugin.py").write_text("import no_such_library", encoding="utf-8")
    station = tmp_path / "station.toml"
    station.write_text(STATION.format(role="supply", driver="my-supply"), encoding="utf-8")
    with pytest.raises(InputError, match=r"(?s)my-supply.*plugin.py cannot be used: ModuleNotFoundError"):
        load_station(station)
    station.write_text(STATION.format(role="supply", driver="keysight-e36300"), encoding="utf-8")
    assert load_station(station).entries[Role.SUPPLY].driver.name == "keysight-e36300"


METER = """from drivers.interfaces import Role, Voltmeter


class Meter(Voltmeter):
    def measure_volts(self):
        return 1.0
"""


@pytest.mark.parametrize(
    ("code", "english", "chinese"),
    [
        ("x = (", "SyntaxError: '(' was never closed (plugin.py, line 1)", "SyntaxError：'(' was never closed"),
        (
            "\nimport no_such_library",
            "ModuleNotFoundError: No module named 'no_such_library' (plugin.py, line 2)",
            "ModuleNotFoundError：No module named 'no_such_library'（plugin.py 第 2 行）",
        ),
        (
            "from drivers.interfaces import Role\n\nROLE = Role.VOLTMETRE",
            "AttributeError: Role has no VOLTMETRE; did you mean VOLTMETER? (plugin.py, line 3)",
            "AttributeError：Role 没有 VOLTMETRE；是否指 VOLTMETER？（plugin.py 第 3 行）",
        ),
        (
            METER,
            "DeclarationError: Meter.measure_volts does not declare what it does; did you mean measure_voltage?; declare it in",
            "DeclarationError：Meter.measure_volts 未声明其作用；是否指 measure_voltage？；请在接口中声明",
        ),
        (METER, "or begin its name with an underscore (plugin.py, line 4)", "（plugin.py 第 4 行）"),
        ("x = 1", "it declares nothing", "没有声明"),
    ],
)
@pytest.mark.parametrize("command", [("station", "check"), ("run", "stator-resistance-dc", "--motor", "lg-400w")])
def test_why_a_file_cannot_be_used_is_said_once_and_with_its_line(
    call: Call, tmp_path: Path, code: str, english: str, chinese: str, command: tuple[str, ...]
) -> None:
    (tmp_path / "plugin.py").write_text(code, encoding="utf-8")
    (tmp_path / "s.toml").write_text(STATION.format(role="voltmeter", driver="my-meter"), encoding="utf-8")
    station = ("s.toml",) if command[0] == "station" else ("--station", "s.toml", "--rehearse")
    for language, said in (("en", english), ("zh", chinese)):
        status, _, err = call(*command, *station, "--language", language)
        assert status == 2
        assert err.count(said) == 1
        assert "motorbench_plugin" not in err
        # Those of the role, and those once.
        assert (err.count("keysight-34461a"), err.count("keysight-e36300"), len(err.splitlines())) == (1, 0, 1)


def test_an_unknown_driver_is_told_those_there_are_and_where_from(tmp_path: Path) -> None:
    (tmp_path / "plugin.py").write_text(DRIVER, encoding="utf-8")
    station = tmp_path / "station.toml"
    station.write_text(STATION.format(role="supply", driver="your-supply"), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_station(station)
    said = str(refused.value)
    assert "instruments.supply.driver = 'your-supply' is no driver for this role; did you mean my-supply?" in said
    assert f"keysight-e36300, manual, my-supply ({tmp_path / 'plugin.py'})" in said
    assert "[plugins] files" in said
    station.write_text(STATION.format(role="lcr_meter", driver="my-supply"), encoding="utf-8")
    with pytest.raises(InputError, match="for lcr_meter there are keysight-e4980a, manual"):
        load_station(station)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    station.write_text(STATION.format(role="supply", driver="manual"), encoding="utf-8")
    with pytest.raises(InputError, match=r"station.toml: plugins.files: .*plugin.py cannot be read: No such file"):
        load_station(station)


def test_a_file_is_loaded_once_and_anew_when_it_has_changed(made: Made) -> None:
    first, again = made(DRIVER), made(DRIVER)
    assert first.driver("my-supply", Role.SUPPLY) is again.driver("my-supply", Role.SUPPLY)
    assert made(DRIVER + "\n").driver("my-supply", Role.SUPPLY) is not first.driver("my-supply", Role.SUPPLY)


def test_a_run_is_told_of_a_broken_plug_in_and_goes_on(call: Call, tmp_path: Path) -> None:
    (tmp_path / "plugin.py").write_text("import no_such_library", encoding="utf-8")
    (tmp_path / "s.toml").write_text('[station]\nname = "s"\n[plugins]\nfiles = ["plugin.py"]\n', encoding="utf-8")
    code, out, err = call("run", "nameplate", "--station", "s.toml", "--motor", "lg-400w", "--json")
    assert (code, json.loads(out)["status"]) == (0, "completed")
    assert "plugin.py cannot be used: ModuleNotFoundError" in err


def test_a_driver_that_is_no_instrument_of_its_role_is_told_with_the_station(call: Call, tmp_path: Path) -> None:
    plugin = """
from drivers.catalogue import Driver
from drivers.interfaces import Role
from drivers.bases.scpi_supply import ScpiSupplyOptions

class Lamp:
    pass

def opened(address, options, surroundings, name) -> Lamp:
    raise AssertionError("nothing is opened")

DRIVER = Driver("lamp", Role.SUPPLY, ScpiSupplyOptions, opened)
"""
    (tmp_path / "plugin.py").write_text(plugin, encoding="utf-8")
    station = '[station]\nname = "s"\n[plugins]\nfiles = ["plugin.py"]\n[instruments.supply]\ndriver = "lamp"\naddress = "x"\n'
    (tmp_path / "s.toml").write_text(station, encoding="utf-8")
    for typed in (("station", "check", "s.toml"), ("run", "nameplate", "--station", "s.toml", "--motor", "lg-400w")):
        code, _, err = call(*typed)
        assert code == 2
        assert "s.toml: instruments.supply.driver: what driver lamp makes, Lamp, is no Supply" in err


def test_a_resumed_run_needs_the_plug_in_that_it_began_with(call: Call, tmp_path: Path) -> None:
    (tmp_path / "plugin.py").write_text(DRIVER, encoding="utf-8")
    (tmp_path / "s.toml").write_text('[station]\nname = "s"\n[plugins]\nfiles = ["plugin.py"]\n', encoding="utf-8")
    assert call("run", "nameplate", "--station", "s.toml", "--motor", "lg-400w")[0] == 0
    assert call("run", "--resume", "latest")[0] == 0
    (tmp_path / "plugin.py").write_text(DRIVER + "# changed\n", encoding="utf-8")
    code, _, err = call("run", "--resume", "latest")
    assert code == 2
    assert "plugin.py was" in err


def test_records_go_to_the_named_outputs(call: Call, tmp_path: Path) -> None:
    station = '[station]\nname = "s"\n[plugins]\nrecords = ["json-lines"]\n'
    (tmp_path / "s.toml").write_text(station, encoding="utf-8")
    assert call("run", "nameplate", "--station", "s.toml", "--motor", "lg-400w")[0] == 0
    (line,) = (tmp_path / "runs" / "records.jsonl").read_text(encoding="utf-8").splitlines()
    assert (json.loads(line)["kind"], json.loads(line)["status"]) == ("run", "completed")
    (tmp_path / "s.toml").write_text(station.replace("json-lines", "no-such"), encoding="utf-8")
    code, _, err = call("run", "nameplate", "--station", "s.toml", "--motor", "lg-400w")
    assert code == 2
    assert "plugins.records: 'no-such': known are: json-lines" in err


def test_an_output_that_fails_or_hangs_is_named_and_holds_up_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken: list[Any] = []
    said: list[str] = []
    released, hanging = threading.Event(), threading.Event()

    def fails(record: Mapping[str, Any], folder: Path) -> None:
        raise OSError("no route")

    def hangs(record: Mapping[str, Any], folder: Path) -> None:
        hanging.set()
        released.wait(60.0)

    def leaves(record: Mapping[str, Any], folder: Path) -> None:
        raise SystemExit(3)

    monkeypatch.setattr("bench.plugins.records.HANGS", 0.0)
    outputs = RecordOutputs(
        [
            RecordOutput("fails", fails),
            RecordOutput("leaves", leaves),
            RecordOutput("hangs", hangs),
            RecordOutput("takes", lambda r, _: taken.append(r)),
        ],
        tmp_path,
        lambda words: said.append(str(words)),
    )
    records = [{"serial_number": "A1"}, {"serial_number": "A2"}]
    for record in records:
        outputs.hand(record)
        assert hanging.wait(10.0)
    outputs.hand(records[-1])
    outputs.close(patience=0.1)
    released.set()
    assert taken == [*records, records[-1]]
    assert sum("output hangs has not taken the record of A1 for 0 s" in line for line in said) == 1
    assert sum("output leaves did not take the record of A1: SystemExit: 3" in line for line in said) == 1
    assert [line for line in said if "fails" in line] == [
        f"output fails did not take the record of {name}: OSError: no route" for name in ("A1", "A2", "A2")
    ]
    assert any(line.startswith("output hangs: records that were not taken in time: 3") for line in said)
