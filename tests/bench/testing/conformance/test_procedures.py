"""A procedure whose truth nobody knows: what can be told of it is, and that its truth was not checked."""

import re
import warnings
from pathlib import Path

import pytest

from bench.testing.conformance.kit import Conformance, UncheckedWarning

PAGE = Path(__file__).parents[4] / "docs" / "how-to" / "add-a-procedure.md"
SAID = "cold_line_resistance: whether it is true was not checked"
NAME = "cold_line_resistance"
MEAN = "sum(lines) / 3.0, self.accuracy"


def kit(folder: Path, was: str = "", becomes: str = "") -> Conformance:
    """The kit with the procedure of the how-to page, one thing of it changed."""
    (source,) = re.findall(r"`cold_lines\.py`:\n\n```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert was in source
    (folder / "cold_lines.py").write_text(source.replace(was, becomes, 1) if was else source, encoding="utf-8")
    return Conformance(folder / "runs").files(folder / "cold_lines.py")


def test_what_is_not_checked_is_told(tmp_path: Path) -> None:
    with pytest.warns(UncheckedWarning, match=SAID):
        report = kit(tmp_path).procedure("cold-lines", motors=2)
    assert [sentence.startswith(SAID) for sentence in report.unchecked] == [True]
    assert {
        f"{NAME}: repeatable within its uncertainty",
        f"{NAME}: the same seed gives the same figure",
        f"{NAME}: rests on what is measured",
        f"{NAME}: unit",
        "the record is whole after a run",
        "the record is whole after an abort at acme/1",
        "nothing is left energised after an abort at acme/2",
    } <= {finding.check for finding in report.findings}


def test_nothing_is_unchecked_where_the_truth_is_given(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(AssertionError, match=f"{NAME}: holds the truth") as raised:
            kit(tmp_path).procedure("cold-lines", motors=1, truth=lambda _: {NAME: 1.0})
    assert "not checked" not in str(raised.value)


@pytest.mark.parametrize(
    ("was", "becomes", "check"),
    [
        (MEAN, "sum(lines) / 3.0, type(self.accuracy)(gain=1e-9, source='manual')", f"{NAME}: repeatable within its uncertainty"),
        (MEAN, "0.25, self.accuracy", f"{NAME}: rests on what is measured"),
        (MEAN, "sum(lines) / 3.0 + 1e-12 * (__import__('time').time_ns() % 10**9), self.accuracy", f"{NAME}: the same seed"),
        ("        self.report_mean(", "        self.bench.lcr_meter.configure(50.0)\n        self.report_mean(", "lcr_meter.configure"),
    ],
)  # fmt: skip
def test_mistakes_are_found_without_a_truth(tmp_path: Path, was: str, becomes: str, check: str) -> None:
    with pytest.raises(AssertionError, match=re.escape(check)) as raised:
        kit(tmp_path, was, becomes).procedure("cold-lines", motors=2)
    assert SAID in str(raised.value)
