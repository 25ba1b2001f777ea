"""The fault study in small: each kind of fault once, at a step where it matters, through the whole program."""

import math

import pytest

from bench.plugins.catalogues import installed
from tests.studies.faults import judge_all, table
from tests.studies.faulty.fault_cases import WITH_OUTPUT, Case, cases
from tests.studies.faulty.faulty_run import REFUSED, RIGHT, TOLD, WRONG, Ended, judge

MOTOR, SEED = "lg-400w", 1

#: Procedure, step, role and fault by the study's names: every kind once, at a step that it could spoil.
CHOSEN = [
    ("stator-resistance", "3.2.2/3", "lcr_meter", "silence"),
    ("stator-resistance", "3.2.2/3", "lcr_meter", "silence, once"),
    ("stator-resistance", "3.2.2/3", "lcr_meter", "late reply, once"),
    ("stator-resistance", "3.2.2/3", "lcr_meter", "9.9E37"),
    ("stator-resistance", "3.2.2/3", "lcr_meter", "sensor frozen"),
    ("stator-resistance", "3.2.2/3", "", "thermal runaway"),
    ("pole-pairs-static", "3.1.2.1/2", "supply", "half a reply, once"),
    ("pole-pairs-static", "3.1.2.1/2", "supply", "garbage"),
    ("pole-pairs-static", "3.1.2.1/2", "supply", "wrong channel"),
    ("pole-pairs-static", "3.1.2.1/2", "", "CC where CV is expected"),
    ("pole-pairs-static", "3.1.2.1/3", "supply", "replies one behind"),
    ("pole-pairs-static", "3.1.2.1/3", "supply", "disconnected, 2 s"),
    ("pole-pairs-static", "3.1.2.1/3", "", "motor unplugged"),
    ("pole-pairs-static", "3.1.2.1/3", "", "rotor jam"),
    ("pole-pairs-static", "3.1.2.1/2", "supply", "output stuck on"),
    ("pole-pairs-static", "3.1.2.1/2", "supply", "output stuck on, reported off"),
    ("pole-pairs-inverter", "3.1.2.2-1/3", "tachometer", "not a number"),
    ("pole-pairs-inverter", "3.1.2.2-1/2", "inverter", "bus-off"),
    ("inertia", "3.5/2", "dynamometer", "Modbus exception"),
    ("inertia", "3.5/2", "dynamometer", "wrong unit"),
    ("inertia", "3.5/2", "dynamometer", "speed runaway"),
]


def the_case(procedure: str, step: str, role: str, name: str) -> Case:
    (found,) = [one for one in cases(MOTOR, [procedure], [step], [name]) if one.role == role]
    return found


@pytest.mark.parametrize(("procedure", "step", "role", "name"), CHOSEN)
def test_a_run_ends_right_or_says_why_not(procedure: str, step: str, role: str, name: str) -> None:
    ended = judge(the_case(procedure, step, role, name), SEED)
    assert ended.outcome in (RIGHT, REFUSED, TOLD), ended.words
    assert ended.named, ended.words


@pytest.mark.parametrize(
    ("procedure", "step", "role", "name", "outcome", "said"),
    [
        ("stator-resistance", "3.2.2/3", "lcr_meter", "silence", REFUSED, "stator-resistance: lcr_meter after '"),
        ("inertia", "3.5/2", "dynamometer", "wrong unit", REFUSED, "inertia: dynamometer after '"),
        ("pole-pairs-static", "3.1.2.1/3", "supply", "disconnected", TOLD, "supply could not be made safe"),
        ("pole-pairs-inverter", "3.1.2.2-1/2", "inverter", "bus-off", TOLD, "inverter after '"),
        ("pole-pairs-static", "3.1.2.1/2", "supply", "output stuck on, reported off", TOLD, "the current is # A"),
    ],
)
def test_instrument_and_command_are_named(
    procedure: str, step: str, role: str, name: str, outcome: str, said: str
) -> None:
    ended = judge(the_case(procedure, step, role, name), SEED)
    assert ended.outcome == outcome, ended.words
    assert said in ended.words


def test_every_fault_comes_at_every_step_of_every_procedure() -> None:
    made = list(cases(MOTOR))
    steps = {
        (name, step.identifier)
        for name, kind in installed().procedures.items()
        if kind.roles and kind.in_all()
        for step in kind.steps()
    }
    assert {(case.procedure, case.step) for case in made} == steps
    names = {name for *_, name in CHOSEN}
    assert {case.name for case in made} - names <= {
        "garbage, once",
        "Modbus exception, once",
        "silence, once",
        "disconnected",
        "bus-off, 2 s",
        "open phase",
    }
    stuck = {case.role for case in made if case.name == "output stuck on"}
    assert stuck == set(WITH_OUTPUT)


def test_the_table_counts_and_names(monkeypatch: pytest.MonkeyPatch) -> None:
    some = [the_case("stator-resistance", step, "lcr_meter", "silence") for step in ("3.2.2/3", "3.2.2/4")]
    ended = list(judge_all(some, SEED, 0))
    assert [one.outcome for one in ended] == [REFUSED, RIGHT]
    assert list(judge_all(some, SEED, 0)) == ended
    ended.append(Ended(some[0], WRONG, "left on and not told: completed"))
    lines = list(table(ended))
    assert "| silence | 3 | 1 | 1 | 0 | 0 | 1 |" in lines
    assert "| stator-resistance | 3 | 1 | 1 | 0 | 0 | 1 |" in lines
    assert "- wrong: stator-resistance at 3.2.2/3, lcr_meter: silence: left on and not told: completed" in lines
    assert math.isclose(len(lines), 10, abs_tol=2)
