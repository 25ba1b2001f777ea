"""The line and a test of a plan's say the same of the same motor, and name the same part."""

from pathlib import Path
from typing import Any

import pytest

from bench.testing import PlanUnderTest

EXAMPLE = Path(__file__).parents[4] / "docs" / "examples" / "eol"
AT_COGGING = "cogging_torque = 0.004          # N·m, amplitude"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("virtual", "verdict", "code"),
    [
        (AT_COGGING, "pass", ""),
        ("cogging_torque = 0.03", "fail", "COGGING"),
        (f"{AT_COGGING}\nrubbing_torque = 0.3", "fail", "BEARING"),
        (f'{AT_COGGING}\nshorted_turns = {{ winding = "B", share = 0.05 }}', "fail", "SHORT-B"),
    ],
)
def test_line_and_test_agree_on_a_motor_of_the_example_plan(bench: Any, virtual: str, verdict: str, code: str) -> None:
    motor = (EXAMPLE / "motor.toml").read_text(encoding="utf-8")
    assert AT_COGGING in motor
    (bench.folder / "motor.toml").write_text(motor.replace(AT_COGGING, virtual), encoding="utf-8")
    content = (EXAMPLE / "plan.toml").read_text(encoding="utf-8")
    content = content[: content.index("# How virtual motors of the type differ")]
    (bench.folder / "plan.toml").write_text(content, encoding="utf-8")

    bench.run(motors=1, sockets=None)
    (record,) = bench.listener.records
    judged = PlanUnderTest(bench.folder / "plan.toml", bench.folder / "tested").measure(seed=7)

    assert record.verdict.value == judged.verdict.value == verdict, record.cause
    assert record.rework.split() == [each.code for each in judged.diagnoses] == ([code] if code else [])
