"""A figure that is withheld, from the command line to the last export: told everywhere, taken for a value nowhere."""

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.analysis.outcome import AnalysisOutcome
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from bench.journal.finished_run import read_run
from bench.journal.verification import Integrity
from bench.journal.verify import verify
from bench.panel.archive import Archive
from bench.report.evidence import record_of
from bench.testing import PlanUnderTest
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from reports.plots.of_procedures import plots
from tests.command_line import Call
from tests.studies import simulated as sim

PROCEDURE = """
from typing import ClassVar
import numpy as np
from procedures.core.bench import Role
from procedures.core.curves import curve
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from drivers.interfaces.text import text

OWN = ParameterDefinition("frame_capacitance", "C_f", "F", text("Capacitance to the frame"), reader_unit="s/Ω")


class Named(Procedure[Settings]):
    name: ClassVar[str] = "{name}"
    title: ClassVar[str] = "A fit"
    section: ClassVar[str] = "9.8"
    roles: ClassVar[frozenset[Role]] = frozenset()
    gives: ClassVar[tuple[str | ParameterDefinition, ...]] = ("stator_resistance", "inertia", OWN)

    def measure(self) -> None:
        self.compare()

    @step("9.8/1", "Fit it")
    def compare(self) -> None:
        time = np.linspace(0.0, 1.0, 50)
        self.findings["fit"] = dict(unit="A", **curve(time=time, fitted=np.exp(-time), residual=0.1 * np.sin(time)))
        quantity = self.bench.uncertainties.statistical("comparison", 1.01, 0.01)
        for name, answer in {answers}.items():
            found = Misfit((Finding(Cause.UNEXPLAINED, Answer(answer), (name,), 12.0),)) if answer else Misfit()
            self.report(name, quantity, section="9.8", estimator="comparison", misfit=found)
"""
WITHHELD = {"stator_resistance": "withheld", "frame_capacitance": "withheld", "inertia": "widened"}
GIVEN = {"stator_resistance": "", "frame_capacitance": "modelled"}
SAID = "none of the causes known here"


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


def test_a_run_says_what_it_does_not_give_and_ends_with_status_1(
    measured: Callable[..., tuple[int, str, str]], call: Call
) -> None:
    status, out, err = measured("withholding")
    assert status == 1
    assert "not given: Stator resistance, Capacitance to the frame" in err
    (line,) = [line for line in out.splitlines() if line.strip().startswith("Stator resistance ")]
    assert "not given" in line
    # One sentence for what is withheld alike, and no warning that says it again.
    assert out.count("unexplained") == 2
    assert "Stator resistance, Capacitance to the frame (withholding), unexplained: " in out
    shown, out, _ = call("results", "latest", "--language", "zh")
    assert shown == 0
    assert "未给出" in out


def test_a_widened_or_modelled_figure_is_given(measured: Callable[..., tuple[int, str, str]]) -> None:
    status, out, err = measured("giving")
    assert (status, "not given" in out + err) == (0, False)


def test_another_procedure_s_figure_counts(measured: Callable[..., tuple[int, str, str]]) -> None:
    status, out, _ = measured("withholding", "giving", json=True)
    result = json.loads(out)
    assert (status, result["withheld"]) == (0, {})
    assert result["parameters"]["stator_resistance"]["procedure"] == "giving"
    assert result["procedures"]["withholding"]["withheld"].keys() == {"stator_resistance", "frame_capacitance"}


def test_it_stands_beside_the_parameters_in_every_json(
    measured: Callable[..., tuple[int, str, str]], call: Call, tmp_path: Path
) -> None:
    told = json.loads(measured("withholding", json=True)[1])
    shown = json.loads(call("results", "latest", "--json")[1])
    (folder,) = (tmp_path / "runs").iterdir()
    kept = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    for result in (told, shown, kept):
        assert result["parameters"].keys() == {"inertia"}
        assert result["withheld"].keys() == {"stator_resistance", "frame_capacitance"}
        reason = result["withheld"]["stator_resistance"]
        assert (reason["cause"], reason["procedure"]) == ("unexplained", "withholding")
        assert SAID in reason["message"]
        assert result["withheld"]["frame_capacitance"]["definition"]["reader_unit"] == "s/Ω"
        assert [(row["answer"], row["procedure"]) for row in result["misfit"]] == [
            ("withheld", "withholding"),
            ("withheld", "withholding"),
            ("widened", "withholding"),
        ]


def test_it_is_read_back_and_proved(measured: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    measured("withholding", language="zh")
    run = read_run("latest", tmp_path / "runs")
    ((first,), (second,)) = run.view.parameters().withheld.values()
    assert (first.label.render(), second.label.render(), second.unit) == (
        "Stator resistance",
        "Capacitance to the frame",
        "F",
    )
    assert verify(run.folder).verdict is Integrity.UNTOUCHED
    content = json.loads(run.folder.result.read_text(encoding="utf-8"))
    content["withheld"]["stator_resistance"]["cause"] = "hum"
    run.folder.result.write_text(json.dumps(content), encoding="utf-8")
    assert verify(run.folder).verdict is Integrity.CHANGED
    assert [row["message"][:2] for row in content["misfit"]] == ["记录"] * 3


@pytest.mark.parametrize("target", ["c-header", "vesc"])
def test_an_export_that_needs_it_is_refused_with_the_cause(
    measured: Callable[..., tuple[int, str, str]], call: Call, target: str
) -> None:
    measured("withholding")
    status, out, err = call("export", "latest", "--for", target, "--language", "en")
    assert (status, out) == (1, "")
    assert "stator_resistance was withheld by withholding (unexplained): the record differs" in err
    assert "stator_resistance is needed and the run has none" not in err


def test_an_export_of_all_there_is_tells_it(measured: Callable[..., tuple[int, str, str]], call: Call) -> None:
    measured("withholding")
    status, out, err = call("export", "latest", "--for", "json", "--language", "en")
    content = json.loads(out)
    assert (status, content["parameters"].keys()) == (0, {"inertia"})
    assert content["withheld"]["stator_resistance"]["cause"] == "unexplained"
    assert "left out: stator_resistance was withheld" in err
    assert "stator_resistance" not in call("export", "latest", "--for", "csv", "--language", "en")[1]


def test_page_and_residual_name_it(measured: Callable[..., tuple[int, str, str]], call: Call, tmp_path: Path) -> None:
    measured("withholding")
    out = call("report", "latest", "--format", "html", "--language", "en")[1]
    page = Path(out.split()[-1]).read_text(encoding="utf-8")
    assert "withheld" in page
    assert SAID in page
    assert "The residual shows: unexplained (withheld), unexplained (widened)" in page
    (procedure,) = record_of(read_run("latest", tmp_path / "runs")).procedures
    (plot,) = plots(procedure)
    assert plot.rows[1][0].curves[0].y[-1] == pytest.approx(0.0841, abs=1e-4)


def test_the_list_of_runs_shows_it(measured: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    measured("withholding")
    (run,) = Archive(tmp_path / "runs").list()
    assert {name: lacking.cause for name, lacking in run.withheld.items()} == dict.fromkeys(
        ("stator_resistance", "frame_capacitance"), "unexplained"
    )
    assert run.matches("frame_capacitance")


def test_an_analysis_tells_it_and_ends_with_status_1(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    time, v, i, _, _ = sim.step_record(np.random.default_rng(1), 8)
    table = np.column_stack((time, v, i))
    np.savetxt(tmp_path / "step.csv", table, delimiter=",", header="t (s),CH1 (V),CH2 (A)", comments="")
    add = AnalysisOutcome.parameter

    def withholding(self: AnalysisOutcome, name: str, quantity: Any, **more: Any) -> None:
        answer = Answer.WITHHELD if name == "loop_inductance" else Answer.MODELLED
        more["misfit"] = Misfit((Finding(Cause.UNEXPLAINED, answer, (name,), 12.0),))
        add(self, name, quantity, **more)

    assert call("analyze", "step-response", "step.csv")[0] == 0
    monkeypatch.setattr(AnalysisOutcome, "parameter", withholding)
    status, out, _ = call("analyze", "step-response", "step.csv", "--json")
    made = json.loads(out)
    assert (status, made["withheld"].keys()) == (1, {"loop_inductance"})
    assert "loop_inductance" not in made["parameters"]
    assert {row["answer"] for row in made["misfit"]} == {"withheld", "modelled"}
    status, out, _ = call("analyze", "step-response", "step.csv")
    assert status == 1
    assert "not given" in next(line for line in out.splitlines() if line.strip().startswith("Loop inductance"))
    assert out.count("no figure is given") == 1


def plan(folder: Path, *procedures: str, on_failure: str = "retry", limits: str = "") -> str:
    taken = "".join(f'[[procedure]]\nname = "{name}"\n' for name in procedures)
    (folder / "plan.toml").write_text(
        f'[plan]\nname = "batch"\nmotor = "lg-400w"\non_failure = "{on_failure}"\nretries = 1\n'
        f'[plugins]\nfiles = ["withholding.py", "giving.py"]\n{taken}'
        + (limits or '[[limit]]\nparameter = "stator_resistance"\nlow = 0.5\nhigh = 1.5\n'),
        encoding="utf-8",
    )
    return "plan.toml"


def batch(call: Call, file: str) -> tuple[int, dict[str, Any]]:
    words = ("--station", "virtual", "--motors", "1", "--operator", "virtual", "--language", "en", "--json")
    status, out, _ = call("eol", "run", file, *words)
    return status, json.loads(out)


@pytest.mark.usefixtures("station")
def test_a_plan_does_not_judge_it_and_never_passes_the_motor(call: Call, tmp_path: Path) -> None:
    status, counts = batch(call, plan(tmp_path, "withholding"))
    assert (status, counts["pass"], counts["error"]) == (1, 0, 1)
    assert "not_judged" not in counts
    engine = open_database("records.sqlite", existing=True)
    (record,) = Records(engine).read()
    engine.dispose()
    assert (record.verdict, record.first_pass) == (Verdict.ERROR, False)
    figure = {one.parameter: one for one in record.measured}["stator_resistance"]
    assert (figure.verdict, figure.unit, figure.low, figure.value != figure.value) == (
        Verdict.NOT_JUDGED,
        "Ω",
        0.5,
        True,
    )
    # Tried again, as the plan has it, before it was left.
    assert [(check.attempt, check.verdict) for check in record.checks] == [(1, Verdict.ERROR), (2, Verdict.ERROR)]
    assert "stator_resistance is not judged, unexplained: the record differs" in record.cause
    # What has no limits decides nothing, and is told by the run only.
    assert {one.parameter for one in record.measured} == {"stator_resistance", "inertia"}
    out = call("eol", "export", "--format", "csv")[1]
    row = next(row for row in csv.DictReader(io.StringIO(out)) if row["parameter"] == "stator_resistance")
    assert (row["value"], row["verdict"], row["motor_verdict"]) == ("", "not_judged", "error")
    out = call("eol", "export", "--format", "junit")[1]
    assert 'errors="1"' in out
    assert 'type="not_judged"' in out
    assert SAID in out
    assert '"verdict":"not_judged"' in call("eol", "export", "--format", "jsonl")[1]
    assert "| ERROR |" in call("eol", "labels", "--batch", "batch")[1]
    out = json.loads(call("eol", "stats", "--json")[1])
    assert out["verdicts"] == {"pass": 0, "fail": 0, "error": 1, "aborted": 0}
    assert "500.0 … 1500.0" not in call("eol", "stats", "--language", "en")[1]


@pytest.mark.usefixtures("station", "call")
def test_a_plan_passes_a_motor_whose_figure_another_procedure_gives(tmp_path: Path) -> None:
    file = plan(tmp_path, "withholding", "giving", on_failure="go_on")
    judged = PlanUnderTest(Path(file), tmp_path / "runs").measure()
    assert [attempt.verdict for attempt in judged.attempts] == [Verdict.ERROR, Verdict.PASS]
    assert (judged.verdict, judged.figures["stator_resistance"].verdict) == (Verdict.PASS, Verdict.PASS)


@pytest.mark.usefixtures("station", "call")
def test_a_motor_that_fails_has_failed_whatever_is_withheld(tmp_path: Path) -> None:
    limits = "".join(f'[[limit]]\nparameter = "{name}"\nhigh = 0.5\n' for name in ("stator_resistance", "inertia"))
    file = plan(tmp_path, "withholding", limits=limits)
    judged = PlanUnderTest(Path(file), tmp_path / "runs").measure()
    assert judged.verdict is Verdict.FAIL
    assert judged.figures["stator_resistance"].verdict is Verdict.NOT_JUDGED


@pytest.mark.usefixtures("station", "call")
def test_a_plan_that_has_no_limits_on_it_passes(tmp_path: Path) -> None:
    file = plan(tmp_path, "withholding", limits='[[limit]]\nparameter = "inertia"\nlow = 0.5\n')
    judged = PlanUnderTest(Path(file), tmp_path / "runs").measure()
    assert (judged.verdict, judged.figures.keys()) == (Verdict.PASS, {"inertia"})
    assert judged.run.withheld.keys() == {"stator_resistance", "frame_capacitance"}


@pytest.mark.usefixtures("station")
def test_a_plan_is_checked_before_a_line_runs_by_it(call: Call, tmp_path: Path) -> None:
    status, out, _ = call("eol", "check", plan(tmp_path, "withholding"), "--station", "virtual", "--json")
    content = json.loads(out)
    assert (status, content["good"]) == (1, False)
    (limit,) = content["limits"]
    assert limit["fault"] == "not judged: the figure was withheld"
