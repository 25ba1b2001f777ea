"""A figure of which only a bound is known: it fails a motor beyond its limit, and is an error otherwise."""

import math
from types import SimpleNamespace

import pytest

from bench.eol.diagnosis.diagnose import diagnose
from bench.eol.limits import GuardBand, ParameterLimits
from bench.eol.line.judging import MotorJudge
from bench.eol.plan import PlannedCheck
from bench.eol.record import MeasuredFigure
from bench.eol.verdict import Verdict
from bench.run.retry_policy import Next
from drivers.interfaces.text import text
from procedures.core.procedure_error import OnlyBoundedError

CHECK = PlannedCheck("no-load-current", {}, 1, "stop", 1)


@pytest.mark.parametrize(("value", "codes"), [(0.05, []), (2.4, ["TURNS-B"])])
def test_a_figure_within_its_limits_accuses_no_part_for_its_uncertainty(value: float, codes: list[str]) -> None:
    found = {"back-emf-shape": {"flux_linkages": {"A": 1.0, "B": 1.0 - 0.01 * value, "C": 1.0}}}
    figure = MeasuredFigure("back_emf_unbalance", value, "%", 1.5, 3.0, -math.inf, 1.5, Verdict.FAIL)
    assert [each.code for each in diagnose(found, (figure,), ())] == codes


@pytest.mark.parametrize(
    ("high", "verdict", "codes"), [(0.75, Verdict.FAIL, ["BEARING"]), (1.5, Verdict.ERROR, []), (None, Verdict.ERROR, [])]
)  # fmt: skip
def test_a_bound_beyond_the_limit_rejects_and_no_other(high: float | None, verdict: Verdict, codes: list[str]) -> None:
    limits = {} if high is None else {"no_load_current": ParameterLimits(high=high)}
    judge = MotorJudge((CHECK,), limits, GuardBand.STRICT, 1.0)
    error = OnlyBoundedError(text("too uneven"), "no_load_current", 1.1)
    attempt = SimpleNamespace(
        planned=SimpleNamespace(name="no-load-current"), result=None, error=error, told=text("too uneven"), started=0.0, ended=1.0
    )  # fmt: skip
    assert judge.after(attempt) is Next.STOP  # type: ignore[arg-type]
    assert judge.verdict((), aborted=False, planned=1) is verdict
    assert [each.code for each in diagnose({}, (), judge.errors)] == codes
