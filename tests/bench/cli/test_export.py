"""`motorbench export` on recorded runs: files, JSON, refusals."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.journal.journal import Journal
from bench.journal.stored_result import store
from bench.journal.waveforms import StoredWaveform, WaveformFolder
from bench.plugins.catalogues import installed
from drivers.interfaces.text import text
from procedures.core.budget import Uncertainties
from procedures.core.result import Notice, ProcedureResult
from tests.command_line import Call
from tests.journals import event
from tests.reports.exports.map_subject import MAPS, findings

#: Not among what developers have: python-can loads it, with half a second's worth of others, wherever it is installed.
EXTRA = "asammdf is an extra; CI has it: uv run --isolated --extra mdf pytest tests/bench/cli/test_export.py -k mdf4"
MOTOR = """
[nameplate]
name = "outrunner"
connection = "delta"
rated_current = 12.0
rated_speed_rpm = 4000.0
serial_number = "SN 7"
"""
UNITS = {
    "stator_resistance": "Ω",
    "d_axis_inductance": "H",
    "q_axis_inductance": "H",
    "flux_linkage": "V·s/rad",
    "inertia": "kg·m²",
    "viscous_friction": "N·m·s/rad",
}
VALUES = {
    "stator_resistance": 0.05,
    "d_axis_inductance": 20e-6,
    "q_axis_inductance": 22e-6,
    "flux_linkage": 2e-3,
    "inertia": 1e-5,
    "viscous_friction": 1e-6,
}


def result(values: dict[str, float], relative: float = 0.01, warnings: Sequence[Notice] = ()) -> ProcedureResult:
    unc = Uncertainties()
    parameters = [
        unc.parameter(
            name,
            UNITS.get(name, "1"),
            unc.statistical(name, value, 0.0 if name == "pole_pairs" else relative * value),
            procedure="everything",
            section="3",
            estimator="e",
        )
        for name, value in values.items()
    ]
    return ProcedureResult("everything", "3", tuple(parameters), tuple(warnings))


@pytest.fixture
def record(tmp_path: Path) -> Callable[..., Path]:
    """Write a run's journal as a run would, and return its folder."""

    def write(*results: ProcedureResult, motor: str = MOTOR, plugins: dict[str, str] | None = None) -> Path:
        folder = tmp_path / "runs" / "a-run"
        folder.mkdir(parents=True)
        journal = Journal(folder / "journal.jsonl", lambda: 0.0)
        about: dict[str, Any] = {
            "run": str(folder),
            "motor": {"name": "outrunner", "serial_number": "SN 7", "source": "motor.toml"},
            "station": {},
            "procedures": [r.procedure for r in results],
            "settings": [],
            "software": {"motorbench": "0.1.0", **(plugins or {})},
            "motor_file": motor,
        }
        journal.record(event("run_started", **about))
        for made in results:
            journal.record(event("procedure_started", procedure=made.procedure, steps={}))
            journal.record(event("procedure_finished", result=store(made)))
        journal.record(event("run_finished", status="completed", cause="", bench_time=1.0, wall_time=1.0))
        journal.close()
        return folder

    return write


def everything() -> ProcedureResult:
    return result({"pole_pairs": 7.0, **VALUES})


@pytest.mark.parametrize("target", [name for name in installed().exports if name != "mdf4"])
def test_every_target_from_the_command_line(
    target: str, call: Call, record: Callable[..., Path], tmp_path: Path
) -> None:
    record(replace(everything(), findings=findings()) if target in MAPS else everything())
    code, out, err = call("export", "a-run", "--for", target)
    assert (code, "outrunner" in out) == (0, target != "flux-map-csv")
    assert ("motorbench: left out:" in err) == (target == "c-header")
    code, shown, _ = call("export", "a-run", "--for", target, "--output", "out.file", "--json")
    assert code == 0
    assert (tmp_path / "out.file").read_bytes().decode("utf-8") == out
    made = json.loads(shown)
    assert (made["target"], made["file"]) == (target, "out.file")
    assert "content" not in made


def test_waveforms_in_mdf4_are_what_asammdf_reads(call: Call, record: Callable[..., Path], tmp_path: Path) -> None:
    MDF = pytest.importorskip("asammdf", reason=EXTRA).MDF
    folder = record(everything())
    time = np.linspace(-1e-3, 4e-3, 501)
    ramp, other = np.linspace(0.0, 1.0, 40), np.linspace(0.0, 2.0, 40)
    kept = WaveformFolder(folder / "waveforms")
    kept.store(
        "step",
        {
            "A": StoredWaveform(time, np.sin(2e3 * time), "V", 1e-3, clipped=True),
            "B": StoredWaveform(time, time, "A", 0.0),
        },
    )
    kept.store("ramp", {"A": StoredWaveform(ramp, ramp, "V", 0.0), "C": StoredWaveform(other, ramp**2, "N·m", 0.0)})
    code, out, err = call("export", "a-run", "--for", "mdf4", "--output", "run.mf4")
    assert (code, out, err) == (0, "", "")
    with MDF(tmp_path / "run.mf4") as read:
        names = [group.channel_group.acq_name for group in read.groups]
        assert names == ["0001-step", "0002-ramp", "0002-ramp"]
        found = read.get("A", group=0)
        assert (found.unit, found.comment) == ("V", "resolution 0.001 V, clipped")
        assert np.array_equal(found.timestamps, time)
        assert np.array_equal(found.samples, np.sin(2e3 * time))
        last = read.get("C")
        assert (last.unit, last.timestamps[-1], last.samples[-1]) == ("N·m", 2.0, 1.0)
        assert "stator_resistance" in read.header.comment


def test_what_an_mdf4_file_needs(call: Call, record: Callable[..., Path]) -> None:
    folder = record(everything())
    code, out, err = call("export", "a-run", "--for", "mdf4", "--json")
    assert (code, "--output FILE.mf4" in json.loads(out)["error"]) == (2, True)
    samples = np.arange(9.0)
    WaveformFolder(folder / "waveforms").store("step", {"A": StoredWaveform(samples, samples, "V", 0.0)})
    if find_spec("asammdf") is None:
        code, _, err = call("export", "a-run", "--for", "mdf4", "--output", "run.mf4")
        assert (code, "pip install 'motorbench[mdf]'" in err) == (1, True)


def test_what_an_mdf4_file_is_made_of(call: Call, record: Callable[..., Path], tmp_path: Path) -> None:
    pytest.importorskip("asammdf", reason=EXTRA)
    folder = record(everything())
    code, _, err = call("export", "a-run", "--for", "mdf4", "--output", "run.mf4")
    assert (code, "the run has no waveforms" in err) == (1, True)
    (folder / "waveforms").mkdir()
    (folder / "waveforms" / "0001-step.h5").write_bytes(b"torn")
    code, _, err = call("export", "a-run", "--for", "mdf4", "--output", "run.mf4")
    assert (code, "0001-step.h5: the waveforms cannot be read" in err) == (2, True)
    assert not (tmp_path / "run.mf4").exists()


def test_a_file_with_other_content_is_not_overwritten(call: Call, record: Callable[..., Path], tmp_path: Path) -> None:
    record(everything())
    (file := tmp_path / "out.file").write_text("somebody's own gains", encoding="utf-8")
    export = ("export", "a-run", "--for", "vesc", "--output", "out.file")
    code, out, err = call(*export)
    assert (code, out) == (2, "")
    assert err == "motorbench: out.file already exists; choose another file, or overwrite it with --force\n"
    assert file.read_text(encoding="utf-8") == "somebody's own gains"
    assert call(*export, "--force")[0] == 0
    written = file.stat().st_mtime_ns
    assert file.read_text(encoding="utf-8").startswith("<?xml")
    assert call(*export)[0] == 0, "the same content may be written again"
    assert file.stat().st_mtime_ns == written


@pytest.mark.parametrize("folder", ["/", ".", "..", ""])
def test_a_folder_is_no_file(folder: str, call: Call, record: Callable[..., Path]) -> None:
    record(everything())
    code, out, err = call("export", "a-run", "--for", "vesc", "--force", "--output", folder)
    assert (code, out) == (2, "")
    assert err == f"motorbench: {folder or '.'} is a folder; give the name of a file\n"


def test_json_has_the_fields_and_the_content(call: Call, record: Callable[..., Path]) -> None:
    record(everything())
    made = json.loads(call("export", "a-run", "--for", "vesc", "--json")[1])
    assert made["content"].startswith("<?xml")
    field = made["fields"]["foc_motor_l"]
    assert field["value"] == pytest.approx(21e-6)
    assert (field["unit"], field["from"]) == ("H", ["d_axis_inductance", "q_axis_inductance"])
    low, high = field["coverage_interval"]
    assert low < field["value"] - field["standard_uncertainty"] < field["value"] < high
    assert made["fields"]["si_motor_poles"] == {
        "value": 14,
        "unit": "",
        "convention": "poles, twice the pole pairs",
        "from": ["pole_pairs"],
    }


def test_refusals_name_every_reason(call: Call, record: Callable[..., Path]) -> None:
    record(result({"stator_resistance": 0.05}, relative=0.2))
    code, out, err = call("export", "a-run", "--for", "vesc", "--output", "out.xml")
    assert (code, out) == (1, "")
    assert "cannot be exported for VESC mcconf XML" in err
    assert "stator_resistance is known to 20 % only" in err
    assert "flux_linkage is needed and the run has none; run back-emf-constant" in err
    assert not Path("out.xml").exists()
    code, out, _ = call("export", "a-run", "--for", "vesc", "--json", "--language", "zh")
    assert code == 1
    assert "需要 flux_linkage" in json.loads(out)["error"]


def test_an_uncertain_figure_may_be_let_through(call: Call, record: Callable[..., Path]) -> None:
    record(result({"pole_pairs": 7.0, **VALUES}, relative=0.2))
    assert call("export", "a-run", "--for", "ti")[0] == 1
    assert call("export", "a-run", "--for", "ti", "--largest-uncertainty", "0.25")[0] == 0
    assert call("export", "a-run", "--for", "ti", "--largest-uncertainty", "0")[0] == 2


def test_doubts_are_said(call: Call, record: Callable[..., Path]) -> None:
    alarm = Notice("consistency-inductance", text("the reading was halved"))
    record(result({"pole_pairs": 7.0, **VALUES}, warnings=[alarm]))
    _, out, err = call("export", "a-run", "--for", "st")
    assert "motorbench: consistency-inductance: the reading was halved" in err
    assert "WARNING consistency-inductance: the reading was halved" in out


def test_two_counts_that_differ(call: Call, record: Callable[..., Path]) -> None:
    other = ProcedureResult("other", "3", result({"pole_pairs": 14.0}).parameters)
    record(everything(), other)
    code, _, err = call("export", "a-run", "--for", "simplefoc")
    assert code == 1
    assert "the number of pole pairs is not certain" in err


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("a-run", "--for", "vesc", "--bandwidth", "-1"), 2, "from 0 (no gains) to 20000 Hz"),
        (
            ("a-run", "--for", "vesc", "--bandwidth", "1000", "--loop-rate", "14000"),
            2,
            "at least 15000 samples a second",
        ),
        (("a-run", "--for", "ti", "--as-detected"), 2, "stores the detected values unchanged"),
        (("a-run", "--for", "vecs"), 2, "did you mean vesc?"),
        (("nowhere", "--for", "vesc"), 2, "no run was found here"),
        (("a-run",), 2, "--for"),
        (("a-run", "--for", "vesc", "--output", "no/such/folder/x.xml"), 1, "cannot be written: there is no such file"),
    ],
)
def test_wrong_use(arguments: tuple[str, ...], code: int, said: str, call: Call, record: Callable[..., Path]) -> None:
    record(everything())
    got, out, err = call("export", *arguments)
    assert (got, out) == (code, "")
    assert said in err


def test_a_journal_that_was_changed(call: Call, record: Callable[..., Path]) -> None:
    journal = record(everything()) / "journal.jsonl"
    journal.write_bytes(journal.read_bytes().replace(b"0.05", b"0.06"))
    code, _, err = call("export", "a-run", "--for", "vesc")
    assert code == 1
    assert "the journal was changed" in err


STRANGE = """from reports.exports import quantities as q
from reports.exports.target import Field, Target

def raising(sheet):
    print("noise")
    return 1 / 0

def leaving(sheet):
    raise SystemExit(0)

FIELDS = (Field("Rs", q.RESISTANCE),)
RAISES = Target("raises", "Raises", ".x", FIELDS, raising)
LEAVES = Target("leaves", "Leaves", ".x", FIELDS, leaving)
NOTHING = Target("nothing", "Nothing", ".x", FIELDS, lambda sheet: None)
NUMBER = Target("number", "Number", ".x", FIELDS, lambda sheet: "x", write_records=lambda text, began, records: 7)
"""


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ("raises", "ZeroDivisionError (plugin.py:6): division by zero"),
        ("leaves", "SystemExit: 0"),
        ("nothing", "write returned NoneType, not str"),
        ("number", "write_records returned int, not bytes"),
    ],
)
def test_a_plug_in_s_writer_that_fails_is_named(
    target: str, said: str, call: Call, record: Callable[..., Path], tmp_path: Path
) -> None:
    plugin = tmp_path / "plugin.py"
    plugin.write_text(STRANGE, encoding="utf-8")
    folder = record(everything(), plugins={str(plugin): hashlib.sha256(plugin.read_bytes()).hexdigest()})
    samples = np.arange(9.0)
    WaveformFolder(folder / "waveforms").store("step", {"A": StoredWaveform(samples, samples, "V", 0.0)})
    code, out, err = call("export", "a-run", "--for", target, "--output", "out.file")
    assert (code, out, (tmp_path / "out.file").exists()) == (1, "", False)
    assert f"an error in export target {target} from {plugin}" in err
    assert said in err
    assert "program error" not in err
    code, out, err = call("export", "a-run", "--for", target, "--language", "zh", "--output", "out.file")
    assert (code, f"导出目标 {target}" in err) == (1, True)
