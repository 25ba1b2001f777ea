"""A figure that is withheld on a production line: never judged, never passed; and the conformance kit."""

import csv
import io
import json
from pathlib import Path
from typing import Any

import pytest

from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from bench.plugins.files import PluginsSection, catalogues_of
from bench.testing import PlanUnderTest
from bench.testing.conformance.procedure import check_procedure
from tests.bench.withheld.withholding import PROCEDURE, SAID
from tests.command_line import Call


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
    assert "Stator resistance is not judged, unexplained: the record differs" in record.cause
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
    words = ("--station", "virtual", "--each", "0", "--sound", "0", "--json")
    status, out, _ = call("eol", "check", plan(tmp_path, "withholding"), *words)
    content = json.loads(out)
    assert (status, content["good"]) == (1, False)
    (limit,) = content["limits"]
    assert limit["fault"] == "not judged: the figure was withheld"


@pytest.mark.parametrize(("name", "passed"), [("sometimes", True), ("never", False)])
def test_the_conformance_kit_takes_a_withheld_figure_for_an_answer_and_none_at_all_for_a_mistake(
    tmp_path: Path, name: str, *, passed: bool
) -> None:
    content = PROCEDURE.replace("{name}", name).replace("{answers}", "dict(stator_resistance=ANSWER())")
    often = "lambda: next(_EACH)" if passed else "lambda: 'withheld'"
    head = f"import itertools\n_EACH = itertools.cycle(['withheld', ''])\nANSWER = {often}\n"
    content = head + content.replace('("stator_resistance", "inertia", OWN)', '("stator_resistance",)')
    (tmp_path / "own.py").write_text(content.replace("1.01, 0.01)", "0.016, 0.007)"), encoding="utf-8")
    catalogues = catalogues_of(PluginsSection(files=["own.py"]), str(tmp_path / "plan.toml"))
    report = check_procedure(name, tmp_path / "runs", motors=2, catalogues=catalogues)
    failures = [finding.check for finding in report.failures if "abort" not in finding.check]
    assert failures == ([] if passed else ["gives a figure of one motor at least"])
