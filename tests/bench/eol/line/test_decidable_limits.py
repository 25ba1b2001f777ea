"""Limits that the station's uncertainty cannot keep are told of: at the motor that shows it, at the end, and before the next batch."""

from typing import Any

import pytest

from bench.eol.verdict import Verdict

_PROCEDURE = """
from typing import ClassVar
from procedures.core.bench import Role
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step


class Unbalance(Procedure[Settings]):
    name: ClassVar[str] = "unbalance"
    title: ClassVar[str] = "Unbalance"
    section: ClassVar[str] = "9.9"
    roles: ClassVar[frozenset[Role]] = frozenset()
    gives: ClassVar[tuple[str, ...]] = ("resistance_unbalance", "stator_resistance")

    def measure(self) -> None:
        self.know()

    @step("9.9/1", "Know it")
    def know(self) -> None:
        unbalance = self.bench.uncertainties.statistical("unbalance", 0.1, 1.5)
        resistance = self.bench.uncertainties.statistical("resistance", 0.0165, 1e-4)
        self.report("resistance_unbalance", unbalance, section="9.9", estimator="known")
        self.report("stator_resistance", resistance, section="9.9", estimator="known")
"""
_UNKNOWN = "nothing was measured by this plan at this station yet"


def plan_with(bench: Any, limit: str, guard: str = "strict") -> None:
    (bench.folder / "unbalance.py").write_text(_PROCEDURE, encoding="utf-8")
    (bench.folder / "plan.toml").write_text(
        f'[plan]\nname = "small"\nmotor = "motor.toml"\nguard = "{guard}"\n[plugins]\nfiles = ["unbalance.py"]\n'
        f'[[procedure]]\nname = "unbalance"\n[[limit]]\n{limit}\n[brakes]\nline_fails = 0\nsocket_fails = 0\n',
        encoding="utf-8",
    )


def test_a_one_sided_limit_that_decides_nothing_is_told_of_once_and_before_the_next_batch(bench: Any) -> None:
    plan_with(bench, 'parameter = "resistance_unbalance"\nhigh = 2.0')
    counts, _ = bench.run(motors=3)
    first, told = bench.listener.noticed
    assert _UNKNOWN in first
    assert "limit on resistance_unbalance: figures from 0 to 2 are accepted, 0.34 times the width" in told
    assert [str(note) for note in counts.undecidable] == [told]
    bench.listener.noticed.clear()
    counts, _ = bench.run(motors=1, batch="next", first_serial=11)
    assert bench.listener.noticed == [told]
    assert [str(note) for note in counts.undecidable] == [told]


@pytest.mark.parametrize(
    ("guard", "limit", "told"),
    [
        # An open side without an end: the type's own 16 mΩ lies inside by less than the uncertainty of 0.2 mΩ.
        ("strict", "low = 0.0159", "the type's own 0.016 lies nearer to the limit than the ± 0.0002"),
        ("shared", "low = 0.0159", ""),
        ("strict", "low = 0.0150", ""),
        ("strict", "low = 0.0164\nhigh = 0.0166", "it will be an error"),
    ],
)
def test_only_what_cannot_be_kept_is_told_of(bench: Any, guard: str, limit: str, told: str) -> None:
    plan_with(bench, f'parameter = "stator_resistance"\n{limit}', guard)
    counts, _ = bench.run(motors=1)
    assert [told in str(note) for note in counts.undecidable] == [True] * bool(told)


def test_limits_that_strict_guard_bands_close_are_the_station_s(bench: Any) -> None:
    content = bench.request.plan.read_text(encoding="utf-8")
    for old, new in (('"shared"', '"strict"'), ("percent = 60.0", "percent = 0.001"), ("resistance = 3.0", "")):
        content = content.replace(old, new, 1)
    bench.request.plan.write_text(content, encoding="utf-8")
    bench.run(motors=1)
    (record,) = bench.listener.records
    assert record.verdict is Verdict.ERROR
    assert "its uncertainty is too large" in record.cause
    assert "nothing was measured by this plan" in bench.listener.noticed[0]
    bench.run(motors=1, first_serial=2, batch="next")
    told = bench.listener.noticed[1:]
    # At the motor of the first batch, and before the second.
    assert len(told) == 2
    for words in told:
        assert "limit on stator_resistance: " in words
        assert "and 1 are asked for: it will be an error" in words
