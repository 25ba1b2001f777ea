"""Why a run ended, for a reader of another language than the run's."""

import re
from pathlib import Path

from bench.i18n.language import translator
from bench.journal.finished_run import read_run
from bench.report.evidence import record_of
from drivers.interfaces.text import Text

OPEN_PHASE = (
    "run",
    "stator-resistance-dc",
    "--station",
    "virtual",
    "--motor",
    "lg-400w",
    "--fault",
    "open_phase terminal=A",
)


def test_a_failed_run_says_why_in_the_readers_language(motorbench):
    status, given = motorbench(*OPEN_PHASE)
    assert status != 0
    run = read_run(str(given["run"]), Path(given["run"]).parent)
    assert run.view.as_dict()["cause"] == given["cause"]
    chinese = run.view.as_dict(translator("zh"))
    procedure = chinese["procedures"]["stator-resistance-dc"]
    for said in (chinese["cause"], procedure["cause"]):
        assert re.search("[\u4e00-\u9fff]", said)
        assert not re.search(r"\b(the|is|not|of)\b", said), said
    cause = record_of(run).cause
    assert isinstance(cause, Text)
    assert cause.render(translator("zh")) == chinese["cause"]


def test_a_run_that_completed_has_no_cause(motorbench):
    _, given = motorbench("run", "nameplate", "--station", "virtual", "--motor", "lg-400w")
    run = read_run(str(given["run"]), Path(given["run"]).parent)
    assert "cause" not in run.view.as_dict(translator("zh"))
    assert record_of(run).cause == ""
