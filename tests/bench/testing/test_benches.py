"""The plugin's benches are the line's: fixture, station files, options, disturbances and individual errors."""

from pathlib import Path

import pytest

from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError
from bench.testing import BenchUnderTest, PlanUnderTest, RequestedBench, run_procedures, virtual_motor

ROOT = Path(__file__).parents[3]
PLAN = """
[plan]
name = "cogging"
motor = "lg-400w"
guard = "shared"
[[procedure]]
name = "cogging-torque"
settings = { order = 24, speed_rpm = 12.5 }
[[limit]]
parameter = "cogging_torque"
high = "0.03 N·m"
"""


@pytest.mark.parametrize("operator", ["", "virtual"])
@pytest.mark.parametrize(("amplitude", "verdict"), [(0.004, Verdict.PASS), (0.02, Verdict.FAIL)])
def test_true_cogging_decides_whoever_does_the_hand_work(
    tmp_path: Path, operator: str, amplitude: float, verdict: Verdict
) -> None:
    (tmp_path / "plan.toml").write_text(PLAN, encoding="utf-8")
    plan = PlanUnderTest(tmp_path / "plan.toml", tmp_path / "runs", operator=operator)
    judged = plan.measure(cogging_torque=amplitude, cogging_order=24)
    assert judged.verdict is verdict
    assert judged.figures["cogging_torque"].value == pytest.approx(2.0 * amplitude, rel=0.05)


def test_a_procedure_runs_with_a_fixture_that_hands_have_not(tmp_path: Path) -> None:
    motor = virtual_motor(str(ROOT / "docs" / "examples" / "eol" / "motor.toml"), insulation_resistance=3e8)
    ran = run_procedures(
        ["insulation-resistance"],
        motor,
        tmp_path / "runs",
        seed=1,
        settings={},
        faults=[],
        bench=RequestedBench(operator="fixture"),
    )
    assert ran.status == "completed", ran.cause
    assert ran.parameters["insulation_resistance"].value == pytest.approx(3e8, rel=0.1)
    with pytest.raises(InputError, match="insulation_tester"):
        run_procedures(["insulation-resistance"], motor, tmp_path / "runs", seed=1, settings={}, faults=[])


def test_a_bench_has_what_it_is_asked_for() -> None:
    bench = BenchUnderTest(virtual_motor(), 1, [], fixture=True, options={"supply": {"channel": 2}}, drawn_errors=True)
    try:
        assert {"switch_matrix", "rotor_actuator", "insulation_tester"} <= set(bench.bench.roles)
        assert bench.bench.errors.voltmeter.gain != (0.0,) * 5
    finally:
        bench.close()
    with pytest.raises(InputError, match="there is no instrument 'suply'"):
        BenchUnderTest(virtual_motor(), 1, [], options={"suply": {}})
