"""Plans held against defects: what a defect costs, what limits let through, what is proposed, and the processes that measure."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.cli.eol.defects_output import as_json, print_defects, print_proposal
from bench.distribution.workforce import Workforce
from bench.eol.defects.campaign import Campaign, measure_all, tasks_of
from bench.eol.defects.cases import DefectCases, defect_cases
from bench.eol.defects.check import DefectCheck
from bench.eol.defects.findings import findings
from bench.eol.defects.function_cost import DefectSeverity, RatedPoint, function_cost
from bench.eol.defects.proposal import Proposal, propose, write_plan
from bench.eol.defects.trial import Attempted, FigureReading, MotorTrial, TrialBench, TrialSetup
from bench.eol.defects.verdicts import PlanRules
from bench.eol.limits import GuardBand, ParameterLimits
from bench.eol.line.preparation.dry_run import virtually
from bench.eol.line.preparation.prepare import BatchRequest, prepare
from bench.eol.line.workers.messages import Batch
from bench.eol.plan import PlannedCheck, load_plan
from bench.i18n.errors import InputError
from bench.i18n.language import translator
from bench.motor.motor_file import load_motor
from drivers.interfaces.text import text
from reports.labels import ParameterLabels
from sim_instruments.physics.motor import defects
from tests.command_line import called
from tests.studies.forked import ready

EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "eol"
MOTOR = load_motor(str(EXAMPLE / "motor.toml")).virtual_motor()
RATING = RatedPoint(29.0, 314.0)
CHECKS = (PlannedCheck("first", {}, 1, "stop", 1), PlannedCheck("second", {}, 1, "stop", 1))
RULES = PlanRules(CHECKS, {"x": ParameterLimits(9.0, 11.0)}, GuardBand.SHARED, 0.0)


def trial(case: int, number: int, refused: str = "", **values: float) -> MotorTrial:
    """Return a motor of which the first procedure gave x and the second the rest."""
    readings = {name: FigureReading(value, 0.1, "V") for name, value in values.items()}
    first = {name: reading for name, reading in readings.items() if name == "x"}
    second = {name: reading for name, reading in readings.items() if name != "x"}
    procedures: Mapping[str, Attempted] = {
        "first": Attempted(first, (), 2.0),
        "second": Attempted(second, (), 3.0, refused),
    }
    return MotorTrial(case, number, procedures, 5.0)


@pytest.fixture(scope="module")
def cases() -> DefectCases:
    return defect_cases(MOTOR, None, RATING, fixture=True)


def test_a_bench_that_does_not_model_a_defect_has_not_caught_it() -> None:
    refused = trial(0, 1, "the virtual bench does not model it", x=10.0)
    assert RULES.catches(refused)
    second = replace(refused.procedures["second"], unmodelled=True)
    assert not RULES.catches(replace(refused, procedures={**refused.procedures, "second": second}))


def test_what_costs_more_is_graded_higher() -> None:
    grades = [function_cost(MOTOR, defects.weak_magnets(MOTOR, share), RATING).grade for share in (0.01, 0.07, 0.2)]
    assert grades == [DefectSeverity.SLIGHT, DefectSeverity.MARGINAL, DefectSeverity.GROSS]
    assert function_cost(MOTOR, MOTOR, RATING).grade is DefectSeverity.SLIGHT
    # One solidly shorted turn of twenty burns, whatever the resistance of its winding says.
    assert function_cost(MOTOR, defects.shorted_turns(MOTOR, 0.05), RATING).grade is DefectSeverity.GROSS
    for bad in (defects.exchanged(MOTOR), defects.other_poles(MOTOR), defects.weak_pole(MOTOR, 2.0)):
        assert function_cost(MOTOR, bad, RATING).grade is DefectSeverity.GROSS


def test_drag_is_counted_against_rated_torque() -> None:
    torque = RATING.torque(MOTOR)
    cost = function_cost(MOTOR, defects.tight_bearing(MOTOR, 0.03 * torque), RATING)
    assert (cost.by, cost.grade) == ("drag", DefectSeverity.MARGINAL)
    assert cost.value == pytest.approx(0.03)
    assert function_cost(MOTOR, defects.rubbing(MOTOR, 0.06 * torque), RATING).value == pytest.approx(0.03)


def test_a_type_without_hall_sensors_is_told_so_and_one_with_them_has_their_defects(cases: DefectCases) -> None:
    assert [label.render() for label in cases.left_out] == ["Hall sensor"]
    kinds = {case.defect for case in cases.cases}
    assert {"open-phase", "shorted-turns", "reversed-magnet", "rubbing", "insulation", "probe-off"} <= kinds
    six_step = load_motor("92bl-30-25l")
    others = defect_cases(six_step.virtual_motor(), six_step.six_step, RATING, fixture=False)
    assert {"hall-stuck", "hall-inverted", "hall-leads", "hall-place", "hall-offset"} <= {
        c.defect for c in others.cases
    }
    assert "bad joint" in {label.render() for label in others.left_out}
    assert all(len({case.key for case in found.cases}) == len(found.cases) for found in (cases, others))


def test_escapes_and_false_rejects_are_counted_with_their_intervals(cases: DefectCases) -> None:
    gross = next(n for n, case in enumerate(cases.cases) if case.cost.grade is DefectSeverity.GROSS)
    trials = (
        trial(-1, 1, x=10.0, y=1.0),
        trial(-1, 2, x=12.0, y=1.0),
        trial(gross, 3, x=8.0, y=1.0),
        trial(gross, 4, x=10.0, y=1.0),
        trial(gross, 5, x=10.0, refused="no path"),
        replace(trial(gross, 6, x=10.0), felt=False),
    )
    found = findings(Campaign(trials, 6), cases.cases, RULES)
    assert (found.false_rejects.hits, found.false_rejects.count) == (1, 2)
    through = found.through[DefectSeverity.GROSS]
    assert (through.hits, through.count) == (1, 3), "a probe that nobody needs is nobody's escape"
    assert through.interval == pytest.approx((0.0084, 0.9057), abs=1e-4)
    x, y = (next(each for each in found.figures if each.parameter == name) for name in "xy")
    assert (x.catches, x.alone, x.false_rejects.hits, x.limited) == (1, 1, 1, True)
    assert not y.limited
    assert [(p.time, p.catches, p.alone) for p in found.procedures] == [(2.0, 1, 1), (3.0, 1, 1)]
    assert not found.good


def test_a_procedure_of_every_second_motor_rejects_no_other() -> None:
    rules = replace(RULES, checks=(replace(CHECKS[0], every=2), CHECKS[1]))
    assert rules.catches(trial(0, 1, x=20.0))
    assert not rules.catches(trial(0, 2, x=20.0))


def sound(count: int) -> list[MotorTrial]:
    random = np.random.default_rng(1)
    return [trial(-1, n, x=10.0 + 0.1 * random.normal(), y=5.0 + 0.2 * random.normal()) for n in range(1, count + 1)]


def test_limits_follow_the_spread_and_only_useful_ones_are_kept(cases: DefectCases) -> None:
    gross = next(n for n, case in enumerate(cases.cases) if case.cost.grade is DefectSeverity.GROSS)
    motors = [
        *sound(200),
        trial(gross, 201, x=12.0, y=5.0),
        trial(gross, 202, x=10.0, y=9.0),
        trial(gross, 203, x=12.0),
    ]
    wide = replace(RULES, limits={})
    seldom = propose(motors, cases.cases, replace(RULES, limits={"of every tenth motor": ParameterLimits(1.0, 2.0)}))
    assert seldom.limits["of every tenth motor"] == ParameterLimits(1.0, 2.0)
    proposal = propose(motors, cases.cases, wide)
    assert proposal.limits.keys() == {"x", "y"}
    limits = proposal.limits["x"]
    # 3.7 deviations for two in ten thousand, a little more for the 200 motors that it is known from.
    assert (limits.high - limits.low) / 2.0 / 0.1 == pytest.approx(3.72, rel=0.2)
    strict = propose(motors, cases.cases, replace(wide, guard=GuardBand.STRICT)).limits["x"]
    assert strict.high - limits.high == pytest.approx(0.1, abs=0.01)
    assert propose(motors[:-2], cases.cases, wide).limits.keys() == {"x"}
    # Two motors in 2 s go before one in 3 s.
    assert proposal.order == ("first", "second")
    with pytest.raises(InputError, match="raise --sound"):
        propose(motors[:10], cases.cases, wide)


def test_a_limit_on_a_deviation_is_no_nearer_than_its_uncertainty(cases: DefectCases) -> None:
    gross = next(n for n, case in enumerate(cases.cases) if case.cost.grade is DefectSeverity.GROSS)

    def unbalanced(case: int, number: int, value: float) -> MotorTrial:
        first = Attempted({"x": FigureReading(value, 0.07, "%")}, (), 2.0)
        return replace(trial(case, number), procedures={"first": first})

    motors = [unbalanced(-1, n, 0.03 + 0.001 * (n % 5)) for n in range(40)] + [unbalanced(gross, 41, 3.0)]
    rules = replace(RULES, checks=CHECKS[:1], limits={}, minimum_ratio=2.0)
    assert propose(motors, cases.cases, rules).limits["x"].high == pytest.approx(0.14, rel=0.01)


def test_a_procedure_that_no_sound_motor_had_is_not_taken_to_cost_nothing(cases: DefectCases) -> None:
    gross = next(n for n, case in enumerate(cases.cases) if case.cost.grade is DefectSeverity.GROSS)
    seldom = Attempted({}, (), 60.0)

    def with_a_third(one: MotorTrial) -> MotorTrial:
        return replace(one, procedures={**one.procedures, "third": seldom})

    motors = [*sound(40), trial(gross, 41, x=12.0), with_a_third(trial(gross, 42, x=12.0, y=9.0))]
    third = PlannedCheck("third", {}, 20, "stop", 1)
    for trials in (motors, motors[:-1]):
        proposal = propose(trials, cases.cases, replace(RULES, checks=(*CHECKS, third), limits={}))
        assert proposal.order == ("first", "second", "third")


def test_the_plan_with_them_is_read_again(tmp_path: Path) -> None:
    plan = load_plan(EXAMPLE / "plan.toml")
    order = tuple(reversed([check.name for check in plan.checks]))
    wide = ParameterLimits(-0.1, 1.0e-3)
    proposal = Proposal({"stator_resistance": ParameterLimits(high=0.02), "inertia": wide}, order, ())
    made = write_plan(proposal, plan, tmp_path / "made.toml", "Made.")
    assert [check.name for check in made.checks] == list(order)
    # What lies where no figure can be is no limit.
    assert made.absolute == {
        "stator_resistance": ParameterLimits(high=0.02),
        "inertia": ParameterLimits(high=1.0e-3),
    }
    assert load_motor(made.motor).nameplate.name == "LG-400W"
    with pytest.raises(InputError, match="already exists"):
        write_plan(proposal, plan, tmp_path / "made.toml", "Made.")


def checked(cases: DefectCases, trials: list[MotorTrial], planned: int) -> DefectCheck:
    campaign = Campaign(tuple(trials), planned)
    plan = load_plan(EXAMPLE / "plan.toml")
    return DefectCheck(
        plan, cases, text("somewhere"), RULES, campaign, findings(campaign, cases.cases, RULES), ParameterLabels({})
    )


@pytest.mark.parametrize("language", ["en", "zh"])
def test_what_is_printed_has_80_columns_and_says_that_it_is_partial(
    cases: DefectCases, capsys: pytest.CaptureFixture[str], language: str
) -> None:
    from rich.cells import cell_len

    trials = [trial(number, number + 1, x=10.0) for number in range(len(cases.cases))] + [trial(-1, 99, x=10.0, y=1.0)]
    print_defects(checked(cases, trials, 200), translator(language))
    out = capsys.readouterr().out
    assert max(cell_len(line) for line in out.splitlines()) <= 80
    assert ("Partial" if language == "en" else "部分") in out


def test_an_order_says_which_procedures_are_first_by_rule(
    cases: DefectCases, capsys: pytest.CaptureFixture[str]
) -> None:
    done = replace(checked(cases, [trial(-1, 1, x=10.0)], 1), safety_tests=("insulation-resistance",))
    proposal = Proposal({}, ("insulation-resistance", "winding-balance"), ("insulation-resistance",))
    print_proposal(proposal, done, "made.toml", translator("en"))
    said = " ".join(capsys.readouterr().out.split())
    assert "Safety tests, before everything that energises the motor whatever they find: Insulation resistance" in said
    assert as_json(done, proposal)["proposal"]["safety_tests"] == ["insulation-resistance"]


def test_json_has_no_number_that_json_has_not(cases: DefectCases) -> None:
    for trials in ([trial(0, 1, x=10.0)], [trial(-1, 1, x=10.0, y=math.nan)]):
        assert json.loads(json.dumps(as_json(checked(cases, trials, 1), None), allow_nan=False))


@pytest.mark.slow
def test_one_seed_gives_the_same_figures_by_one_process_and_by_several_and_a_stop_keeps_what_is_done(
    tmp_path: Path,
) -> None:
    """The one test here that measures: two quick procedures, four motors."""
    file = tmp_path / "plan.toml"
    motor = (EXAMPLE / "motor.toml").read_text(encoding="utf-8")
    if "insulation_test_voltage" not in motor:
        motor = motor.replace("[nameplate]", "[nameplate]\ninsulation_test_voltage = 500.0", 1)
    (tmp_path / "motor.toml").write_text(motor, encoding="utf-8")
    file.write_text(
        '[plan]\nname = "quick"\nmotor = "motor.toml"\n[[procedure]]\nname = "insulation-resistance"\n'
        '[[procedure]]\nname = "winding-balance"\nsettings = { repeats = 1, aperture = "SHOR", short_correction = false }\n'
        "[virtual]\nresistance = 1.5\n",
        encoding="utf-8",
    )
    request = BatchRequest(file, "virtual", tmp_path)
    prepared, _ = virtually(prepare(file, "virtual", 1))
    found = defect_cases(prepared.motor.virtual_motor(), None, RATING, fixture=True)
    shorted = next(n for n, case in enumerate(found.cases) if case.key == "shorted-turns 15 %")
    batch = Batch("check", "0" * 32, prepared.plan, {}, prepared.motor, "line", "", request)
    setup = TrialSetup(batch, found.cases)
    tasks = [(-1, 0, 1), (shorted, 0, 2), (-1, 1, 3), (shorted, 1, 4)]
    ready()
    by_two = measure_all(setup, tasks, Workforce(2))
    bench = TrialBench(setup)
    assert by_two.complete
    assert by_two.trials == tuple(bench.measure(*task) for task in tasks)
    unbalance = [each.procedures["winding-balance"].readings["inductance_unbalance"].value for each in by_two.trials]
    assert min(unbalance[1::2]) > 3.0 * max(unbalance[::2]), "shorted turns show at the bridge"

    def stop(done: int) -> None:
        raise KeyboardInterrupt

    stopped = measure_all(setup, tasks, Workforce(1), stop)
    assert len(stopped.trials) == 1
    assert not stopped.complete


def test_all_motors_are_planned_and_evenly_mixed(cases: DefectCases) -> None:
    tasks = tasks_of(cases, 2, 50)
    assert len(set(tasks)) == 2 * len(cases.cases) + 50
    assert [number for *_, number in tasks] == list(range(1, len(tasks) + 1))
    first_half = sum(case < 0 for case, *_ in tasks[: len(tasks) // 2])
    assert first_half == pytest.approx(25, abs=2)
    # What is stopped soon has tried something of everything.
    assert 10 <= sum(case >= 0 for case, *_ in tasks_of(cases, 1, 50)[:25]) <= 15


@pytest.mark.parametrize("few", [("--each", "0"), ("--sound", "19")])
def test_limits_that_nothing_would_tell_of_are_refused_before_anything_is_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], few: tuple[str, str]
) -> None:
    proposed = tmp_path / "proposed.toml"
    code, out, err = called(
        capsys, "eol", "check", str(EXAMPLE / "plan.toml"), *few, "--output", str(proposed), "--language", "en"
    )
    assert (code, out) == (2, "")
    assert "give --each 1 and --sound 20 at least" in err
    assert not proposed.exists()
