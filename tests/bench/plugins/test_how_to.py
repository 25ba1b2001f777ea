"""The how-to pages: the code on them is what runs here."""

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from tomli_w import dumps as toml_text

from bench.i18n.language import translator
from bench.journal.finished_run import read_run
from bench.journal.guardian_record import read_guardian
from bench.motor.motor_file import load_motor
from bench.motor.shipped_motors import motor_content
from bench.report.evidence import record_of
from bench.station.station_file import load_station
from bench.testing.conformance.kit import Conformance
from bench.virtual.served_station import station_to_serve
from bench.virtual.virtual_station import describe
from drivers.interfaces.text import word
from sim_instruments.server.served_bench import ServedBench
from tests.bench.plugins.how_to_pages import OSCILLOSCOPE, PAGES, PROBES, codes, left
from tests.command_line import Call
from tests.studies.forked import Forked, motorbench

#: The pages' files, and the most lines that each may have.
LONGEST = {"acme_supply.py": 40, "acme_meter.py": 80, "simulated_acme_meter.py": 80}
#: Motors with defects are tried elsewhere.
QUICK = ("--each", "0", "--sound", "0")
PLAN = """
[plan]
name = "acme"
motor = "lg-400w"
guard = "shared"

[plugins]
files = ["cold_lines.py", "acme_mes.py"]
records = ["acme-mes"]

[[procedure]]
name = "stator-resistance-dc"
settings = { levels = 3, settle = 0.03, wiring_settle = 0.03, winding_temperature = 25.0 }
"""


def stations(page: str) -> list[str]:
    return re.findall(r"```toml\n(.*?)```", (PAGES / page).read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with every file of the pages, their station, and names beside them that are ours."""
    for page in PAGES.glob("*.md"):
        for name, code in codes(page.name).items():
            (tmp_path / name).write_text(code, encoding="utf-8")
    (tmp_path / "station.toml").write_text(stations("add-a-driver.md")[1], encoding="utf-8")
    for name in ("drivers", "reports"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise ImportError('the user has this name too')")
    return tmp_path


@pytest.mark.parametrize(("name", "most"), (LONGEST | dict.fromkeys(OSCILLOSCOPE, 80)).items())
def test_the_files_are_short(folder: Path, name: str, most: int) -> None:
    assert len((folder / name).read_text(encoding="utf-8").splitlines()) <= most


@pytest.mark.parametrize("name", ["acme-ps303", "acme-dm5"])
def test_the_drivers_pass_the_conformance_kit(folder: Path, conformance: Conformance, name: str) -> None:
    conformance.files(*(folder / file for file in LONGEST)).driver(name)


def test_the_oscilloscope_passes_the_conformance_kit(folder: Path, conformance: Conformance) -> None:
    kit = conformance.files(*(folder / file for file in OSCILLOSCOPE))
    kit.driver("rigol-ds1000z", options={"probes": PROBES}, found=left)
    kit.simulated_instrument("rigol-ds1000z", driver="rigol-ds1000z", options={"probes": PROBES})


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        pytest.param("told.y_reference + told.y_origin", "told.y_reference", marks=pytest.mark.slow),
        ("_offset_sign = -1.0", "_offset_sign = 1.0"),
        ("- pre_trigger * record_time", "+ pre_trigger * record_time"),
        pytest.param('"WAIT": Acquiring.ARMED', '"WAIT": Acquiring.DONE', marks=pytest.mark.slow),
        pytest.param(
            '_transfer = (":WAV:MODE RAW", ":WAV:FORM BYTE")', '_transfer = (":WAV:FORM BYTE",)', marks=pytest.mark.slow
        ),
        pytest.param('trigger_row(":TRIG:COUP", "DC")', "()", marks=pytest.mark.slow),
    ],
)
def test_a_mistake_in_the_oscilloscope_s_own_is_found(
    folder: Path, conformance: Conformance, right: str, wrong: str
) -> None:
    file = folder / "rigol_ds1000z.py"
    code = file.read_text(encoding="utf-8")
    assert right in code
    file.write_text(code.replace(right, wrong), encoding="utf-8")
    with pytest.raises(AssertionError):
        conformance.files(*(folder / each for each in OSCILLOSCOPE)).driver(
            "rigol-ds1000z", options={"probes": PROBES}, found=left
        )


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        ('add("VOLTS"', 'add("VOL-TS"', "voltmeter: simulated instrument acme-dm5: header pattern 'VOL-TS'"),
        (
            "self._cycles / 50.0\n",
            "self._cicles / 50.0\n",
            r"AttributeError \(simulated_acme_meter.py:\d+\): .*_cicles",
        ),
    ],
)
def test_a_simulated_instrument_that_fails_is_named(
    call: Call, folder: Path, right: str, wrong: str, told: str
) -> None:
    file = folder / "simulated_acme_meter.py"
    file.write_text(file.read_text(encoding="utf-8").replace(right, wrong), encoding="utf-8")
    rehearsal = ("--station", "station.toml", "--motor", "lg-400w", "--rehearse", "--json")
    code, out, err = call("run", "stator-resistance-dc", *rehearsal)
    assert code == 1
    assert re.search(told, out + err)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        (
            {'Reading(value, "V", STATED': 'Reading(value, "Ohmz", STATED'},
            "voltmeter after 'measure_voltage': the driver acme-dm5 gave a reading in the unit 'Ohmz', declared is V; "
            "the reading is not used. Let the driver convert what it returns to that unit",
        ),
        (
            {
                "    def measure_voltage": '    @reading("Ohmz")\n    def measure_voltage',
                "from drivers.interfaces import": "from drivers.interfaces.declarations import reading\nfrom drivers.interfaces import",
            },
            "acme_meter.py cannot be used: DeclarationError: AcmeMeter.measure_voltage declares the unit 'Ohmz', "
            "its interface 'V'; leave the declaration to the interface",
        ),
    ],
)
def test_a_reading_in_a_unit_that_is_none_is_refused_at_the_station(
    call: Call, folder: Path, changes: dict[str, str], told: str
) -> None:
    file = folder / "acme_meter.py"
    code = file.read_text(encoding="utf-8")
    for right, wrong in changes.items():
        assert right in code
        code = code.replace(right, wrong)
    file.write_text(code, encoding="utf-8")
    rehearsal = ("--station", "station.toml", "--motor", "lg-400w", "--rehearse")
    status, out, err = call("run", "stator-resistance-dc", *rehearsal, "--language", "en")
    said = " ".join((out + err).split())
    assert status != 0
    assert told in said, said


@pytest.mark.parametrize(
    "procedure", [pytest.param("back-emf-constant", marks=pytest.mark.slow), "dq-inductance-time-constant"]
)
def test_the_oscilloscope_is_rehearsed(call: Call, folder: Path, procedure: str) -> None:
    (folder / "station.toml").write_text(stations("add-a-driver.md")[0], encoding="utf-8")
    _, out, err = call("run", procedure, "--station", "station.toml", "--motor", "lg-400w", "--rehearse", "--json")
    told = json.loads(out)
    assert (told["status"], told["good"]) == ("completed", True), err


def test_several_instruments_of_a_role(folder: Path) -> None:
    tables = "\n".join(
        [*stations("add-a-driver.md")[1].split("[instruments.supply]")[:1], stations("add-a-driver.md")[2]]
    )
    (folder / "station.toml").write_text(tables, encoding="utf-8")
    (entry,) = load_station(folder / "station.toml").entries.values()
    assert (entry.driver.name, entry.address) == ("acme-ps303", "TCPIP0::192.0.2.10::inst0::INSTR")


def test_a_rehearsal_is_behind_the_own_drivers_on_their_own_instruments(call: Call, folder: Path) -> None:
    _, out, _ = call(
        "run", "stator-resistance-dc", "--station", "station.toml", "--motor", "lg-400w", "--rehearse", "--json"
    )
    told = json.loads(out)
    assert (told["status"], told["good"], told["differences"]) == ("completed", True, [])
    assert told["highest"]["supply"]["current limit"] == {"value": 3.0, "unit": "A", "limit": 3.0, "whose": "the model"}


def test_a_driver_without_a_counterpart_is_rehearsed_with_its_own_ratings(call: Call, folder: Path) -> None:
    code = (folder / "acme_supply.py").read_text(encoding="utf-8")
    (folder / "acme_supply.py").write_text(code.replace(', simulated="acme-ps303")', ")"), encoding="utf-8")
    _, out, _ = call(
        "run", "stator-resistance-dc", "--station", "station.toml", "--motor", "lg-400w", "--rehearse", "--json"
    )
    told = json.loads(out)
    assert told["differences"] == [
        "supply: acme-ps303 has no simulated counterpart; a generic instrument with its driver's ratings is used instead, "
        "at most 30 V, 3 A"
    ]
    assert told["highest"]["supply"]["current limit"] == {"value": 3.0, "unit": "A", "limit": 3.0, "whose": "the model"}


@contextmanager
def served(folder: Path) -> Iterator[ServedBench]:
    """The station's instruments on real sockets, and its file with their addresses."""
    motor = load_motor("lg-400w")
    own = station_to_serve(folder / "station.toml", motor)
    with ServedBench(motor.virtual_motor(), units=own.units, speedup=50.0, pages={"/motor": {"truth": {}}}) as bench:
        # One computer plays bench and station, and may be busy.
        station = {**own.file(describe(bench.preferred(), bench.control)), "guardian": {"heartbeat": 5.0}}
        (folder / "station.toml").write_text(toml_text(station), encoding="utf-8")
        yield bench


def test_the_page_s_own_test_of_the_drivers(
    folder: Path, run_procedure: Any, assert_holds_truth: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    (folder / "station.toml").rename("my_station.toml")
    names: dict[str, Any] = {}
    exec(compile(codes("add-a-driver.md")["test_acme.py"], "test_acme.py", "exec"), names)  # noqa: S102
    names["test_the_drivers_read_what_is_there"](run_procedure, assert_holds_truth)
    # A meter that reads 2 % more than there is is found out.
    meter = Path("acme_meter.py")
    code = meter.read_text(encoding="utf-8")
    assert "return Reading(value," in code
    meter.write_text(code.replace("return Reading(value,", "return Reading(1.02 * value,"), encoding="utf-8")
    with pytest.raises(AssertionError, match="stator_resistance"):
        names["test_the_drivers_read_what_is_there"](run_procedure, assert_holds_truth)


@pytest.mark.slow
def test_a_virtual_run_by_the_page_s_two_lines(call: Call, folder: Path) -> None:
    page = (PAGES / "add-a-driver.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```\n(motorbench sim serve.*?)```", page, re.DOTALL | re.MULTILINE)
    serve, run = (line.split()[1:] for line in block.splitlines())
    (folder / "station.toml").rename("my_station.toml")
    serving = Forked(motorbench, *serve)
    try:
        while "station file" not in (told := serving.stdout.readline()):
            assert told, serving.communicate(10.0)
        _, out, err = call(*run, "--json")
    finally:
        serving.close()
    told = json.loads(out)
    assert told["status"] == "completed", err
    resistance = told["parameters"]["stator_resistance"]
    assert abs(resistance["value"] - 0.016) < 4.0 * resistance["standard_uncertainty"]
    assert "acme-dm5" in (folder / "served.toml").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_run_and_a_line_on_real_sockets(call: Call, folder: Path) -> None:
    (folder / "plan.toml").write_text(PLAN, encoding="utf-8")
    (folder / "serials.txt").write_text("A1\n", encoding="utf-8")
    quick = [f"--set={name}" for name in ("levels=3", "settle=0.03", "wiring_settle=0.03")]
    with served(folder) as bench:
        _, out, _ = call("station", "scan", "--station", "station.toml", "--named-only", "--json")
        assert all(one["fits"] for one in json.loads(out)["station"].values())
        _, out, err = call(
            "run", "stator-resistance-dc", "--station", "station.toml", "--motor", "lg-400w", "--json", *quick
        )
        told = json.loads(out)
        assert told["status"] == "completed", err
        true = load_motor("lg-400w").virtual_motor().phase_resistances[0]
        assert told["parameters"]["stator_resistance"]["value"] == pytest.approx(true, rel=0.1)
        run = read_run(told["run"], folder / "runs")
        noted = run.start.software
        files = {Path(name).name: sha256 for name, sha256 in noted.items() if name.endswith(".py")}
        assert set(files) == set(LONGEST)
        assert all(len(sha256) == 64 for sha256 in files.values())
        # The report names them by the first digits.
        printed = record_of(run).software
        assert {"motorbench", "python"} < set(printed)
        assert {name: sha256[:12] for name, sha256 in noted.items() if name.endswith(".py")}.items() <= printed.items()
        # The guardian has a process of its own, and loads the same files.
        guardian = read_guardian(Path(told["run"]))
        assert next(event.data["roles"] for event in guardian if event.kind == "started") == ["supply"]
        code, _, err = call(
            "eol", "run", "plan.toml", "--station", "station.toml", "--serials", "serials.txt", "--json"
        )
        assert code == 0, err
        assert bench.bench.world.supply.is_on is False
    (record,) = folder.glob("runs/acme/mes-A1.json")
    assert json.loads(record.read_text(encoding="utf-8"))["verdict"] == "pass"


@pytest.mark.slow
def test_a_run_on_the_instruments_needs_no_counterpart(call: Call, folder: Path) -> None:
    with served(folder):
        code = (folder / "acme_supply.py").read_text(encoding="utf-8")
        (folder / "acme_supply.py").write_text(
            code.replace('simulated="acme-ps303")', 'simulated="acme-ps330")'), encoding="utf-8"
        )
        quick = [f"--set={name}" for name in ("levels=3", "settle=0.03", "wiring_settle=0.03")]
        words = ("stator-resistance-dc", "--station", "station.toml", "--motor", "lg-400w", "--json")
        _, out, err = call("run", *words, *quick)
        assert json.loads(out)["status"] == "completed", err


def test_a_plan_is_tried_by_the_station_s_own_drivers_and_procedures(call: Call, folder: Path) -> None:
    station = stations("add-a-driver.md")[1]
    (folder / "station.toml").write_text(station.replace('files = ["', 'files = ["cold_lines.py", "'), encoding="utf-8")
    (folder / "plan.toml").write_text(PLAN.replace('"cold_lines.py", ', ""), encoding="utf-8")
    code, out, err = call("eol", "check", "plan.toml", "--station", "station.toml", *QUICK, "--json")
    told = json.loads(out)
    assert (code, told["differences"], told["troubles"]) == (0, [], []), err
    # Nothing of it is handed to the plan's outputs.
    assert not list(folder.glob("**/mes-*"))
    # A driver that asks for something else than its instrument understands is found out.
    meter = folder / "acme_meter.py"
    meter.write_text(meter.read_text(encoding="utf-8").replace('query_number("VOLTS?")', 'query_number("AMPERES?")'))
    code, out, _ = call("eol", "check", "plan.toml", "--station", "station.toml", *QUICK, "--json")
    assert code == 1
    assert "AMPERES" in " ".join(json.loads(out)["troubles"])


def test_a_procedure_of_ones_own(call: Call, folder: Path) -> None:
    station = """
[station]
name = "own procedure"
[plugins]
files = ["cold_lines.py", "acme_drive.py"]
[instruments.lcr_meter]
driver = "keysight-e4980a"
address = "TCPIP0::192.0.2.11::inst0::INSTR"
"""
    (folder / "own.toml").write_text(station, encoding="utf-8")
    listed = json.loads(call("procedures", "--station", "own.toml", "--json")[1])["procedures"]["cold-lines"]
    assert listed["from"]["name"] == str(folder / "cold_lines.py")
    assert [step["id"] for step in listed["steps"]] == ["acme/1", "acme/2"]
    known = json.loads(call("parameters", "--station", "own.toml", "--json")[1])["parameters"]["cold_line_resistance"]
    assert (known["symbol"], known["unit"], known["procedures"]) == ("R_l", "Ω", ["cold-lines"])
    assert "Line resistance as it comes" in call("parameters", "--station", "own.toml", "--language", "en")[1]
    assert "cold_line_resistance" not in call("parameters")[1]
    (folder / "cold_lines.py").write_text("import no_such_library")
    code, _, err = call("parameters", "--station", "own.toml")
    assert code == 0
    assert "cold_lines.py cannot be used: ModuleNotFoundError: No module named 'no_such_library'" in err
    page = codes("add-a-procedure.md")["cold_lines.py"]
    catalogue = re.findall(r"```po\n(.*?)```", (PAGES / "add-a-procedure.md").read_text(encoding="utf-8"), re.DOTALL)[0]
    (folder / "cold_lines.py").write_text(page, encoding="utf-8")
    assert word("cold-lines").render(translator("en")) == "Line resistance as it comes"
    for language in ("en", "zh"):
        words = ("run", "cold-lines", "--station", "own.toml", "--motor", "lg-400w", "--rehearse", "--json")
        told = json.loads(call(*words, "--language", language)[1])
        assert told["status"] == "completed"
        assert told["procedures"][0]["steps"][1]["text"] == "The mean of the three"
    # In English sentences of its own, until its translations stand beside it.
    assert "Line resistance as it comes" in call("parameters", "--station", "own.toml", "--language", "zh")[1]
    translations = folder / "cold_lines.zh.po"
    translations.write_text(catalogue, encoding="utf-8")
    (folder / "cold_lines.py").write_text(f"{page}# another content: loaded anew", encoding="utf-8")
    assert "现状线电阻" in call("parameters", "--station", "own.toml", "--language", "zh")[1]
    assert json.loads(call(*words, "--language", "zh")[1])["procedures"][0]["steps"][1]["text"] == "三个读数的平均值"
    assert word("cold-lines").render(translator("zh")) == "现状线电阻"
    for number, (right, wrong, said) in enumerate(
        (
            ("以 {frequency:g} Hz", "以 {frequenz:g} Hz", "must have the placeholders of 'Between AB, BC and CA"),
            ('msgstr "现状线电阻"', 'msgstring "现状线电阻"', "cold_lines.zh.po cannot be read"),
        )
    ):
        translations.write_text(catalogue.replace(right, wrong), encoding="utf-8")
        (folder / "cold_lines.py").write_text(f"{page}# content {number}", encoding="utf-8")
        code, _, err = call("parameters", "--station", "own.toml")
        assert code == 0
        assert said in err
    exports = json.loads(call("export", "--list", "--station", "own.toml", "--json")[1])["exports"]
    assert exports["acme-drive"]["from"]["name"] == str(folder / "acme_drive.py")
    assert exports["vesc"]["from"]["name"] == "motorbench"


def test_it_is_measured_at_the_line_and_stands_in_the_report(call: Call, folder: Path) -> None:
    plan = PLAN.split("[[procedure]]")[0] + '[[procedure]]\nname = "cold-lines"\n'
    (folder / "plan.toml").write_text(plan, encoding="utf-8")
    code, _, err = call("eol", "run", "plan.toml", "--station", "virtual", "--motors", "1", "--operator", "virtual")
    assert code == 0, err
    (run,) = folder.glob("runs/acme/000/*")
    (record,) = record_of(read_run(str(run), folder / "runs")).procedures
    assert (record.name, [step.identifier for step in record.steps]) == ("cold-lines", ["acme/1", "acme/2"])
    assert str(record.title) == "Line resistance as it comes"


def test_a_motor_file_may_hold_a_type_value_of_its_parameter(call: Call, folder: Path) -> None:
    (folder / "own.toml").write_text(
        '[station]\nname = "s"\n[plugins]\nfiles = ["cold_lines.py"]\n[instruments.lcr_meter]\n'
        'driver = "keysight-e4980a"\naddress = "TCPIP0::192.0.2.11::inst0::INSTR"\n',
        encoding="utf-8",
    )
    _, _, shipped = motor_content("lg-400w")
    words = ("run", "cold-lines", "--station", "own.toml", "--motor", "motor.toml", "--rehearse", "--json")

    def typed(name: str, value: float) -> None:
        (folder / "motor.toml").write_text(toml_text({**shipped, "expected": {name: value}}), encoding="utf-8")

    typed("cold_line_resistance", 0.032)
    assert json.loads(call(*words)[1])["status"] == "completed"
    for name, value, said in (
        ("cold_line_resistence", 0.032, "did you mean cold_line_resistance?"),
        ("cold_line_resistance", -1.0, "expected.cold_line_resistance = -1.0"),
        ("something_else", 1.0, "known are: .*cold_line_resistance"),
    ):
        typed(name, value)
        code, _, err = call(*words)
        assert code != 0
        assert re.search(said, err), err
    # What no plug-in of this station defines is no parameter here.
    typed("cold_line_resistance", 0.032)
    (folder / "bare.toml").write_text((folder / "own.toml").read_text().replace('"cold_lines.py"', ""))
    code, _, err = call("run", "stator-resistance", "--station", "bare.toml", "--motor", "motor.toml", "--rehearse")
    assert "unknown key expected.cold_line_resistance" in err
    # A plan's limit in per cent is taken of it, and its record is read without the plug-in.
    plan = PLAN.split("[plugins]")[0].replace("lg-400w", "motor.toml") + (
        '[plugins]\nfiles = ["cold_lines.py"]\n[[procedure]]\nname = "cold-lines"\n'
        '[[limit]]\nparameter = "cold_line_resistance"\npercent = 60.0\n'
    )
    (folder / "plan.toml").write_text(plan, encoding="utf-8")
    code, _, err = call("eol", "run", "plan.toml", "--station", "virtual", "--motors", "1", "--operator", "virtual")
    assert code == 0, err
    (folder / "cold_lines.py").unlink()
    (run,) = folder.glob("runs/acme/000/*")
    assert read_run(str(run), folder / "runs").nameplate.expected == {"cold_line_resistance": 0.032}


def test_the_panel_offers_it(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import asyncio

    from bench.panel.offer import Offer

    (folder / "own.toml").write_text('[station]\nname = "s"\n[plugins]\nfiles = ["cold_lines.py"]\n', encoding="utf-8")
    monkeypatch.chdir(folder)
    offer = Offer("own.toml")
    offered = asyncio.run(offer.procedures())
    assert offered["cold-lines"].title == "Line resistance as it comes"
    assert str(offer.title("cold-lines")) == "Line resistance as it comes"


def test_several_makes_on_one_virtual_bench(capsys: pytest.CaptureFixture[str]) -> None:
    page = (PAGES / "add-a-simulated-instrument.md").read_text(encoding="utf-8")
    code = re.findall(r"```python\n(.*?)```", page, re.DOTALL)[-1]
    exec(compile(code, "page", "exec"), {})  # noqa: S102
    assert capsys.readouterr().out.splitlines() == [
        "supply Keysight Technologies,E36313A,MY59001234,2.1.0-1.0.4-1.12",
        "second_supply Acme,PS603,1,1.0",
    ]
