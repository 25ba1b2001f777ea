"""A figure that is withheld, from the command line to the last export: told everywhere, taken for a value nowhere."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from bench.analysis.outcome import AnalysisOutcome
from bench.journal.finished_run import read_run
from bench.journal.schema import journal_schema
from bench.journal.verification import Integrity
from bench.journal.verify import verify
from bench.panel.archive import Archive
from bench.report.evidence import record_of
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from reports.plots.of_procedures import plots
from tests.bench.withheld.withholding import NEEDING, SAID
from tests.command_line import Call
from tests.studies.worlds import simulated as sim


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
    assert "Stator resistance, Capacitance to the frame (A fit), unexplained: " in out
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
    validator = Draft202012Validator(journal_schema())
    for line in run.folder.journal.read_text(encoding="utf-8").splitlines():
        validator.validate(json.loads(line))
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
    assert "Stator resistance was withheld by A fit (unexplained): the record differs" in err
    assert "stator_resistance is needed and the run has none" not in err


def test_an_export_of_all_there_is_tells_it(measured: Callable[..., tuple[int, str, str]], call: Call) -> None:
    measured("withholding")
    status, out, err = call("export", "latest", "--for", "json", "--language", "en")
    content = json.loads(out)
    assert (status, content["parameters"].keys()) == (0, {"inertia"})
    assert content["withheld"]["stator_resistance"]["cause"] == "unexplained"
    assert "left out: Stator resistance was withheld" in err
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


def test_who_needs_it_is_told_why_it_is_not_there(station: str, measured: Callable[..., tuple[int, str, str]]) -> None:
    folder = Path(station).parent
    (folder / "giving.py").write_text(NEEDING, encoding="utf-8")
    status, _, err = measured("withholding", "needing")
    assert status == 1
    assert (
        "needing: run it first; Stator resistance was withheld by A fit (unexplained): the record differs"
        in " ".join(err.split())
    )
