from dataclasses import replace
from typing import Any

from bench.i18n.language import translator
from bench.journal.stored_result import restore, store
from drivers.interfaces import Accuracy
from drivers.interfaces.text import text
from procedures.core.budget import Uncertainties
from procedures.core.result import ProcedureResult

SHEET = "Keysight E4980A/E4980AL data sheet 5989-4435, basic accuracy; zeroed by subtraction here"


def measured() -> ProcedureResult:
    unc = Uncertainties()
    repeated = unc.statistical(text("repeats of {what}", what="R_CA"), 0.03, 1e-5, 5.0)
    read = unc.instrument("LCR meter", repeated, Accuracy(gain=1e-3, resolution=1e-6, source=SHEET))
    whole = read * (1.0 + unc.limit("winding temperature", 0.0, 1e-3))
    made = unc.parameter("stator_resistance", "Ω", whole, procedure="p", section="3.2", estimator="mean")
    return ProcedureResult("p", "3.2", (made,))


def test_a_budgets_inputs_come_back_and_are_said_in_the_readers_language() -> None:
    result = measured()
    stored = store(result)
    back, before = restore(stored).parameters[0], result.parameters[0]
    assert [{**vars(r), "source": str(r.source)} for r in back.budget] == [
        {**vars(r), "source": str(r.source)} for r in before.budget
    ]
    said = {row.source.render(translator("zh")) for row in restore(stored).parameters[0].budget}
    assert said == {
        "R_CA 的重复测量",
        "LCR 电桥：增益，Keysight E4980A/E4980AL 数据手册 5989-4435，基本准确度；由软件相减调零",
        "LCR 电桥：分辨力",
        "绕组温度",
    }


def test_a_budget_takes_no_more_room_than_in_finished_sentences() -> None:
    result = measured()
    [parameter] = result.parameters
    rows: list[dict[str, Any]] = store(result)["parameters"][0]["budget"]
    finished = [{**vars(row), "source": str(row.source)} for row in parameter.budget]
    assert len(str(rows)) < 1.1 * len(str(finished))


def test_an_older_budget_in_finished_english_opens() -> None:
    stored = store(measured())
    [parameter] = measured().parameters
    stored["parameters"][0]["budget"] = [{**vars(row), "source": str(row.source)} for row in parameter.budget]
    [restored] = restore(stored).parameters
    assert [str(row.source) for row in restored.budget] == [str(row.source) for row in parameter.budget]
    # What an instrument's errors are known by stays, so that a run begun by that version can go on.
    assert [row.identity for row in restored.budget] == [row.identity for row in parameter.budget]
    assert restored.covariance(parameter) == parameter.covariance(parameter)
    bare = [
        {key: value for key, value in row.items() if key != "identity"} for row in stored["parameters"][0]["budget"]
    ]
    stored["parameters"][0]["budget"] = bare
    assert {row.identity for row in restore(stored).parameters[0].budget} == {""}
    assert replace(restored, budget=()) == replace(parameter, budget=())
