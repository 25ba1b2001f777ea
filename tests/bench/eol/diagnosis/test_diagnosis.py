"""A motor with a known defect is measured as on a line, and the part at fault is named."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bench.eol.defects.cases import DefectCase, defect_cases
from bench.eol.defects.function_cost import RatedPoint
from bench.eol.diagnosis.diagnose import diagnose
from bench.eol.record import MeasuredFigure
from bench.eol.verdict import Verdict
from bench.motor.motor_file import load_motor
from bench.testing import Judged, PlanUnderTest
from sim_instruments.physics.motor import defects

EXAMPLE = Path(__file__).parents[4] / "docs" / "examples" / "eol"

CASES = [
    (lambda m: defects.bad_joint(m, 0.3, winding=2), "JOINT-C", "joint or wire of C"),
    (lambda m: defects.missing_turns(m, 0.06, winding=0), "TURNS-A", "winding A lacks turns"),
    (lambda m: defects.shorted_turns(m, 0.05, winding=1), "SHORT-B", "turns of winding B are shorted"),
    (lambda m: defects.weak_pole(m, 1.0), "MAGNET", "one magnet is missing"),
    (lambda m: defects.weak_pole(m, 2.0), "MAGNET", "one magnet is reversed"),
    (lambda m: defects.weak_magnets(m, 0.12), "MAGNETS", "all magnets are weak"),
    (lambda m: defects.tight_bearing(m, 0.06), "BEARING", "bearing tight"),
    (lambda m: defects.rubbing(m, 0.3), "BEARING", "rotor rubs: once a turn"),
    (lambda m: defects.rubbing(m, 3.0), "BEARING", "rotor rubs: once a turn"),
    (lambda m: defects.cogging(m, 0.05), "COGGING", "cogging"),
    (lambda m: defects.insulation(m, 1e6), "INSULATION", "1 MΩ"),
    (lambda m: defects.insulation(m, 1e3), "INSULATION", "breaks down"),
    (defects.exchanged, "LEAD", "two of the leads A, B, C are exchanged"),
    (lambda m: defects.other_poles(m), "TYPE", "5 pole pairs"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("change", "code", "said"), CASES)
def test_the_part_at_fault_is_named(tmp_path: Path, change: Any, code: str, said: str) -> None:
    motor = load_motor(str(EXAMPLE / "motor.toml"))
    judged = PlanUnderTest(EXAMPLE / "plan.toml", tmp_path / "runs").measure(
        replace(motor, virtual=change(motor.virtual_motor())), seed=3
    )
    assert judged.verdict is Verdict.FAIL
    assert code in [each.code for each in judged.diagnoses], judged.attempts
    assert any(said in each.words.render() for each in judged.diagnoses)


@pytest.mark.slow
def test_a_lead_that_is_off_is_named(tmp_path: Path) -> None:
    judged = PlanUnderTest(EXAMPLE / "plan.toml", tmp_path / "runs").measure(faults=["open_phase terminal=B"])
    assert judged.verdict is Verdict.FAIL
    assert [each.code for each in judged.diagnoses] == ["LEAD-B"]


MOTOR = load_motor(str(EXAMPLE / "motor.toml"))
#: What the example plan names of each defect that eol check tries; a lead of the station's own is an error of it.
NAMED = {
    "bad-joint": "JOINT-B",
    "weak-magnets": "MAGNETS",
    "weak-pole": "MAGNET",
    "reversed-magnet": "MAGNET",
    "missing-turns": "TURNS-B",
    "fewer-turns": "MAGNETS",
    "shorted-turns": "SHORT-B",
    "swapped-wires": "LEAD",
    "tight-bearing": "BEARING",
    "rubbing": "BEARING",
    "cogging": "COGGING",
    "insulation": "INSULATION",
    "wrong-type": "TYPE",
    "open-phase": "LEAD-B",
    "probe-off": "",
}


def gravest() -> dict[str, DefectCase]:
    plate = MOTOR.nameplate
    assert plate.rated_speed_rpm is not None
    rating = RatedPoint(plate.rated_current, plate.rated_speed_rpm * math.pi / 30.0)
    found = defect_cases(MOTOR.virtual_motor(), None, rating, fixture=True)
    return {case.defect: case for case in found.cases}


def test_every_defect_that_a_motor_of_the_type_can_have_is_in_the_table() -> None:
    assert gravest().keys() == NAMED.keys()


@pytest.mark.slow
@pytest.mark.parametrize("defect", NAMED)
def test_each_defect_at_its_gravest_fails_and_is_named(tmp_path: Path, defect: str) -> None:
    case = gravest()[defect]
    bad = replace(MOTOR, virtual=case.specimen.change(MOTOR.virtual_motor()))
    faults = [
        " ".join([fault.fault, *(f"{key}={json.dumps(value).strip(chr(34))}" for key, value in given.items())])
        for fault in case.specimen.faults
        if (given := fault.model_dump(exclude_defaults=True, exclude={"fault"})) is not None
    ]
    judged = PlanUnderTest(EXAMPLE / "plan.toml", tmp_path / "runs").measure(bad, seed=3, faults=faults)
    assert judged.verdict is (Verdict.FAIL if NAMED[defect] else Verdict.ERROR)
    assert NAMED[defect] in [each.code for each in judged.diagnoses] or not NAMED[defect]
    assert all(each.words.render() for each in judged.diagnoses)


HALLS = """
[plan]
name = "halls"
motor = "92bl-30-25l"
[[procedure]]
name = "hall-sensors"
[[limit]]
parameter = "hall_faults"
high = 0
[[limit]]
parameter = "hall_spacing_deviation"
high = 8.0
[[limit]]
parameter = "hall_offset"
low = -10.0
high = 10.0
"""


RAMPS = """
[plan]
name = "ramps"
motor = "lg-400w"
[[procedure]]
name = "inertia"
settings = { ramp_time = 0.5, zero_rest = 0.2, tare = "TARE" }
"""


@pytest.mark.parametrize(
    ("tare", "verdict", "codes"), [("measured", Verdict.FAIL, ["HELD"]), ("given", Verdict.ERROR, [])]
)
def test_a_rotor_that_the_dynamometer_cannot_turn_is_the_motor_s_where_it_turned_alone(
    tmp_path: Path, tare: str, verdict: Verdict, codes: list[str]
) -> None:
    (tmp_path / "plan.toml").write_text(RAMPS.replace("TARE", tare), encoding="utf-8")
    motor = load_motor("lg-400w")
    seized = replace(motor, virtual=defects.tight_bearing(motor.virtual_motor(), 50.0))
    judged = PlanUnderTest(tmp_path / "plan.toml", tmp_path / "runs").measure(seized, seed=3)
    assert (judged.verdict, [each.code for each in judged.diagnoses]) == (verdict, codes), judged.attempts
    for each in judged.diagnoses:
        said = each.words.render()
        assert "bearing seized" in said
        assert "coupling jammed" in said
        assert "turn its shaft by hand" in said


@pytest.mark.parametrize(("high", "verdict"), [(0.06, Verdict.FAIL), (0.6, Verdict.ERROR)])
def test_a_coast_too_short_to_be_fitted_still_rejects_a_bearing_that_drags_grossly(
    tmp_path: Path, high: float, verdict: Verdict
) -> None:
    limit = f'[[limit]]\nparameter = "coulomb_friction"\nhigh = {high}\n'
    (tmp_path / "plan.toml").write_text(RAMPS.replace("TARE", "measured") + limit, encoding="utf-8")
    motor = load_motor("lg-400w")
    tight = replace(motor, virtual=defects.tight_bearing(motor.virtual_motor(), 1.0))
    judged = PlanUnderTest(tmp_path / "plan.toml", tmp_path / "runs").measure(tight, seed=3)
    assert judged.verdict is verdict, judged.attempts
    assert "coulomb_friction" not in judged.run.parameters
    if verdict is Verdict.FAIL:
        (said,) = judged.diagnoses
        assert said.code == "BEARING"
        assert "N·m at least" in said.words.render()


BALANCE = """
[plan]
name = "balance"
motor = "lg-400w"
[[procedure]]
name = "stator-resistance-dc"
settings = { levels = 3, winding_temperature = 25.0 }
[[procedure]]
name = "winding-balance"
settings = { repeats = 1, short_correction = false }
"""


@pytest.mark.parametrize(("known", "verdict"), [(True, Verdict.ERROR), (False, Verdict.FAIL)])
def test_a_lead_of_the_lcr_meter_is_the_station_s_where_others_had_all_of_the_motor_s(
    tmp_path: Path, known: bool, verdict: Verdict
) -> None:
    before, balance = BALANCE.split("[[procedure]]\n", 2)[1:]
    content = BALANCE if known else BALANCE.replace("[[procedure]]\n" + before, "")
    assert balance in content
    (tmp_path / "plan.toml").write_text(content, encoding="utf-8")
    off = [f"stuck_relay crosspoint={terminal}:lcr_high closed=false" for terminal in "ABC"]
    judged = PlanUnderTest(tmp_path / "plan.toml", tmp_path / "runs").measure(seed=3, faults=off)
    (attempt,) = [each for each in judged.attempts if each.procedure == "winding-balance"]
    assert attempt.verdict is verdict
    assert ("a lead or a relay of the LCR meter is open" in attempt.cause) is known


def halls(tmp_path: Path, change: Any) -> Judged:
    (tmp_path / "plan.toml").write_text(HALLS, encoding="utf-8")
    motor = load_motor("92bl-30-25l")
    bad = replace(motor, virtual=change(motor.virtual_motor()))
    return PlanUnderTest(tmp_path / "plan.toml", tmp_path / "runs").measure(bad)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "codes"),
    [
        (lambda m: defects.hall_stuck(m, "low", 2), ["HALL-H2"]),
        (lambda m: defects.hall_stuck(m, "high", 1), ["HALL-H1"]),
        (lambda m: defects.hall_turned(m, 0.35), ["HALL"]),
        (lambda m: defects.hall_inverted(m, 3), ["HALL-H3"]),
        (defects.hall_exchanged, ["HALL-H2", "HALL-H3"]),
        (lambda m: defects.hall_misplaced(m, 0.35, 1), ["HALL-H1"]),
        (defects.hall_missing, ["HALL"]),
    ],
)
def test_the_hall_lead_is_named_and_a_motor_without_them_fails(tmp_path: Path, change: Any, codes: list[str]) -> None:
    judged = halls(tmp_path, change)
    assert judged.verdict is Verdict.FAIL
    assert sorted(each.code for each in judged.diagnoses) == codes


def figure(parameter: str, value: float, low: float, high: float) -> MeasuredFigure:
    verdict = Verdict.PASS if low <= value <= high else Verdict.FAIL
    return MeasuredFigure(parameter, value, "Ω", 0.0, 0.0, low, high, verdict)


def test_all_three_windings_alike_and_too_large_are_one_finding() -> None:
    found = {"stator-resistance-dc": {"phase_resistances": {"A": 0.0178, "B": 0.0177, "C": 0.0176}}}
    (one,) = diagnose(found, [figure("stator_resistance", 0.0177, 0.0152, 0.0168)], ())
    assert one.code == "WINDING"
    assert "R +10.6 %" in one.words.render()


@pytest.mark.parametrize(("expanded", "codes"), [(0.0016, ["WINDING"]), (0.0018, [])])
def test_a_figure_that_may_as_well_be_the_type_s_accuses_no_part(expanded: float, codes: list[str]) -> None:
    """It fails, for shared guard bands take the figure as it is; 1.7 mΩ of deviation at ± 1.8 mΩ are no finding."""
    failed = replace(figure("stator_resistance", 0.0177, 0.0152, 0.0168), expanded=expanded)
    assert [each.code for each in diagnose({}, [failed], ())] == codes


@pytest.mark.parametrize(
    ("factor", "odd", "code"), [(1.1, 1.028, "WINDING"), (1.0, 1.2, "JOINT-A"), (1.02, 1.2, "JOINT-A")]
)
def test_one_winding_is_at_fault_only_where_it_makes_the_mean_so_large(factor: float, odd: float, code: str) -> None:
    phases = {"A": 0.016 * factor * odd, "B": 0.016 * factor, "C": 0.016 * factor}
    found = {"stator-resistance-dc": {"phase_resistances": phases}}
    (one,) = diagnose(found, [figure("stator_resistance", sum(phases.values()) / 3.0, 0.0152, 0.0168)], ())
    assert one.code == code


def test_another_number_of_turns_is_another_type() -> None:
    figures = [figure("stator_resistance", 0.0121, 0.0152, 0.0168), figure("flux_linkage", 7.4e-3, 8.1e-3, 8.9e-3)]
    assert [each.code for each in diagnose({}, figures, ())] == ["TYPE"]


def test_what_no_rule_knows_has_no_diagnosis() -> None:
    assert diagnose({}, [figure("inertia", 2.0, 0.0, 1.0)], ()) == ()
