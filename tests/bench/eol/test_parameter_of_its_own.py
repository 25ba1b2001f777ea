"""A procedure's own parameter, by its definition alone, wherever parameters are seen."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import pytest

from bench.cli.main import main
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from bench.i18n.language import translator
from bench.journal.finished_run import read_run
from bench.panel.archive import Archive
from bench.panel.line_records import Choice, read_statistics
from bench.plugins.catalogue import Origin, UnloadedDeclaration
from bench.plugins.catalogues import Catalogues, installed
from bench.report.exporting import subject_of
from bench.testing import PlanUnderTest, assert_holds_truth
from drivers.interfaces.text import english, text
from procedures.catalogue import catalogue
from procedures.core.bench import Role
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step
from reports.exports.target import sheet_for
from reports.tables.summary import rows
from tests.command_line import Call

FRAME = ParameterDefinition(
    "frame_capacitance",
    "C_f",
    "F",
    text("Capacitance between winding and frame"),
    "terminals joined",
    true_value="motor.frame_capacitance",
)


class FrameCapacitance(Procedure[Settings]):
    """One step, which knows the answer."""

    name: ClassVar[str] = "frame-capacitance"
    title: ClassVar[str] = "Frame capacitance"
    section: ClassVar[str] = "9.9"
    roles: ClassVar[frozenset[Role]] = frozenset()
    gives: ClassVar[tuple[str | ParameterDefinition, ...]] = (FRAME,)

    def measure(self) -> None:
        self.compare()

    @step("9.9/1", "Compare it")
    def compare(self) -> None:
        quantity = self.bench.uncertainties.statistical("comparison", 1.01e-9, 0.01e-9)
        self.report(FRAME.name, quantity, section="9.9", estimator="comparison")


@pytest.fixture
def _known(monkeypatch: pytest.MonkeyPatch) -> None:
    with_it = {**catalogue(), FrameCapacitance.name: FrameCapacitance}
    monkeypatch.setattr("procedures.known_parameters.catalogue", lambda: with_it)
    own = UnloadedDeclaration(FrameCapacitance.name, Origin("test"), lambda: FrameCapacitance)
    result = installed().entries
    with_own = Catalogues({**result, "procedures": (*result["procedures"], own)})
    for place in ("bench.plugins.files", "bench.eol.line.preparation.line_file"):
        monkeypatch.setattr(f"{place}.installed", lambda: with_own)


@pytest.mark.usefixtures("_known")
def test_it_is_measured_judged_reported_and_exported(tmp_path: Path) -> None:
    motor = (Path(__file__).parents[3] / "bench" / "motors" / "lg-400w.toml").read_text(encoding="utf-8")
    (tmp_path / "motor.toml").write_text(motor + "\n[expected]\nframe_capacitance = 0.9e-9\n", encoding="utf-8")
    plan = tmp_path / "plan.toml"
    plan.write_text(
        '[plan]\nname = "capacitance"\nmotor = "motor.toml"\n[[procedure]]\nname = "frame-capacitance"\n'
        '[[limit]]\nparameter = "frame_capacitance"\npercent = 20.0\n',
        encoding="utf-8",
    )
    judged = PlanUnderTest(plan, tmp_path / "runs").measure()
    assert (judged.verdict, judged.figures[FRAME.name].unit) == (Verdict.PASS, "F")
    assert judged.figures[FRAME.name].high == pytest.approx(1.08e-9)
    assert_holds_truth(judged)
    run = read_run(judged.run.folder.path.name, tmp_path / "runs")
    (row,) = rows(run.view.parameters(), judged.run.truth, english)
    assert (row.name, row.value, row.unit, row.truth) == (
        "Capacitance between winding and frame",
        "1.010",
        "nF",
        "1.000",
    )
    subject = subject_of(run)
    created = json.loads(installed().exports["json"].write(sheet_for(installed().exports["json"], subject)))[
        "parameters"
    ][FRAME.name]
    assert (created["unit"], created["convention"], created["procedure"]) == (
        "F",
        "terminals joined",
        "frame-capacitance",
    )
    assert "frame_capacitance,1.01e-09,F," in installed().exports["csv"].write(
        sheet_for(installed().exports["csv"], subject)
    )


PLUGIN = """
from typing import ClassVar
from drivers.interfaces.text import text
from procedures.core.bench import Role
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step


class FrameCapacitance(Procedure[Settings]):
    name: ClassVar[str] = "frame-capacitance"
    title: ClassVar[str] = "Frame capacitance"
    section: ClassVar[str] = "9.9"
    roles: ClassVar[frozenset[Role]] = frozenset()
    gives: ClassVar[tuple[str | ParameterDefinition, ...]] = (
        ParameterDefinition("frame_capacitance", "C_f", "F", text("Capacitance to the {{frame}}"), reader_unit="s/Ω",
                            true_value="motor.frame_capacitance"),
    )

    def measure(self) -> None:
        self.compare()

    @step("9.9/1", "Compare it")
    def compare(self) -> None:
        quantity = self.bench.uncertainties.statistical("comparison", 1.01e-9, 0.01e-9)
        self.report("frame_capacitance", quantity, section="9.9", estimator="comparison")
"""


def test_a_plug_in_file_s_parameter_is_named_by_the_record_when_the_file_is_gone(call: Call, tmp_path: Path) -> None:
    (tmp_path / "frame.py").write_text(PLUGIN, encoding="utf-8")
    (tmp_path / "plan.toml").write_text(
        '[plan]\nname = "capacitance"\nmotor = "lg-400w"\n[plugins]\nfiles = ["frame.py"]\n'
        '[[procedure]]\nname = "frame-capacitance"\n[[limit]]\nparameter = "frame_capacitance"\nlow = 1.2e-9\n',
        encoding="utf-8",
    )
    plan = ("plan.toml", "--station", "virtual", "--motors", "2", "--operator", "virtual")
    assert call("eol", "run", *plan, "--language", "en")[0] == 1
    (tmp_path / "frame.py").unlink()
    label = "Capacitance to the {frame}"
    run = sorted(tmp_path.glob("runs/capacitance/000/*"))[0]
    view = read_run(str(run), tmp_path / "runs").view
    (figure,) = view.parameters().parameters.values()
    assert (figure.label.render(), figure.reader_unit) == (label, "s/Ω")
    assert figure.own_definition is not None
    assert figure.own_definition.symbol == "C_f"
    assert view.truth["frame_capacitance"] == pytest.approx(1e-9)
    for words in (("results", str(run)), ("eol", "stats"), ("eol", "stats", "--parameter", "frame_capacitance")):
        out = call(*words, "--language", "en")[1]
        assert label in out, words
        assert "frame_capacitance" not in out, words
    out = call("report", str(run), "--format", "html")[1]
    page = Path(out.split()[-1]).read_text(encoding="utf-8")
    assert label in page
    assert "s/Ω" in page
    engine = open_database("records.sqlite", existing=True)
    assert {one.label for record in Records(engine).read() for one in record.measured} == {label}
    engine.dispose()
    assert read_statistics("records.sqlite", Choice()).labels["frame_capacitance"].render() == label


def test_a_check_of_a_plan_has_a_plug_in_file_s_label(call: Call, tmp_path: Path) -> None:
    (tmp_path / "frame.py").write_text(PLUGIN, encoding="utf-8")
    (tmp_path / "plan.toml").write_text(
        '[plan]\nname = "capacitance"\nmotor = "lg-400w"\n[plugins]\nfiles = ["frame.py"]\n'
        '[[procedure]]\nname = "frame-capacitance"\n[[limit]]\nparameter = "frame_capacitance"\nlow = 1.2e-9\n',
        encoding="utf-8",
    )
    words = ("eol", "check", "plan.toml", "--sockets", "1", "--motors", "1", "--each", "0", "--sound", "0")
    for language, fault in (("en", "outside"), ("zh", "限值之外")):
        code, out, _ = call(*words, "--language", language)
        assert code == 1
        assert "Capacitance to the {frame}" in out
        assert "≥ 1.2e-09" in out
        assert fault in out
    out = call(*words[:-1], "2", "--jobs", "1", "--language", "en")[1]
    of_defects = " ".join(out.rpartition("Cycle ")[2].split())
    assert "{frame}" in of_defects


def test_the_list_of_runs_names_it(tmp_path: Path) -> None:
    definition = {"symbol": "C_f", "label": "Capacitance to the {frame}", "reader_unit": "s/Ω"}
    entry = {"value": 1e-9, "standard_uncertainty": 1e-11, "unit": "F"}
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "journal.jsonl").write_text("")
    parameters = {"frame_capacitance": {**entry, "definition": definition}, "of_an_older_run": entry}
    (tmp_path / "a" / "result.json").write_text(json.dumps({"parameters": parameters}))
    (run,) = Archive(tmp_path).list()
    told = {name: (figure.label.render(), figure.reader_unit) for name, figure in run.figures.items()}
    assert told == {
        "frame_capacitance": ("Capacitance to the {frame}", "s/Ω"),
        "of_an_older_run": ("of_an_older_run", "F"),
    }


@pytest.mark.usefixtures("_known")
@pytest.mark.parametrize("reference", ["sqlite"], indirect=True)
def test_the_statistics_of_a_line_have_its_label(
    capsys: pytest.CaptureFixture[str], reference: str, put: Callable[..., None]
) -> None:
    for value in (9.9, 10.0, 10.1):
        put(frame_capacitance=value)
    with pytest.raises(SystemExit) as stop:
        main(["eol", "stats", "--parameter", FRAME.name, "--records", reference, "--language", "en"])
    assert stop.value.code in (None, 0)
    assert FRAME.label.render(translator("en")) in capsys.readouterr().out
