"""The rule by which motors are admitted: what holds of it whatever was tested before."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import timedelta
from random import Random
from typing import Literal, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.eol.admission_rule import AdmittedTest, RefusedTest, decide, takes_again
from bench.eol.plan_file import RetestSection
from bench.eol.store.earlier_tests import EarlierTest, in_order
from bench.eol.verdict import Verdict
from tests.bench.eol.motor_records import NOON

Name = Literal["pass", "fail", "error", "aborted"]
JUDGED = (Verdict.PASS, Verdict.FAIL)


def earlier_test(number: int, verdict: Verdict, person: str = "", model: str = "LG-400W") -> EarlierTest:
    return EarlierTest(
        f"{number:036d}",
        "B1",
        number,
        "pump",
        model,
        "line 3",
        "left",
        NOON + timedelta(minutes=number),
        verdict,
        person,
    )


def history_of(*verdicts: str) -> list[EarlierTest]:
    """Tests in a row; one whose verdict ends with ! was had by a person."""
    return [
        earlier_test(n, Verdict(each.rstrip("!")), "Wang" if each.endswith("!") else "")
        for n, each in enumerate(verdicts, 1)
    ]


histories = st.lists(
    st.tuples(st.sampled_from(Verdict.of_motors()), st.sampled_from(["", "Wang"])), min_size=1, max_size=6
).map(lambda tests: [earlier_test(n, *each) for n, each in enumerate(tests, 1)])
rules = st.builds(
    RetestSection,
    verdicts=st.frozensets(st.sampled_from(get_args(Name))),
    most_tests=st.integers(min_value=1, max_value=8),
)


def ruled(earlier: Sequence[EarlierTest], rule: RetestSection) -> AdmittedTest | RefusedTest:
    return decide("A1", "LG-400W", earlier, rule)


@given(rules)
def test_a_motor_that_is_new_is_admitted(rule: RetestSection) -> None:
    assert ruled([], rule) == AdmittedTest(1, "")


@given(histories, rules)
def test_a_person_may_have_any_motor_of_the_type_tested(earlier: list[EarlierTest], rule: RetestSection) -> None:
    decision = decide("A1", "LG-400W", earlier, rule, "Li")
    assert isinstance(decision, AdmittedTest)
    assert decision.test_number == len(earlier) + 1
    # Nobody is named where nobody was needed.
    assert (decision.again_by == "") == isinstance(ruled(earlier, rule), AdmittedTest)


@given(histories, rules, st.sampled_from(["", "Li"]))
def test_a_motor_of_another_type_is_refused_whoever_answers(
    earlier: list[EarlierTest], rule: RetestSection, person: str
) -> None:
    last = replace(earlier[-1], model="other")
    decision = decide("A1", "LG-400W", [*earlier[:-1], last], rule, person)
    assert isinstance(decision, RefusedTest)
    assert not decision.by_person
    assert "other" in str(decision.why)


@given(histories, rules)
def test_what_was_judged_is_judged_again_by_the_rule_or_a_person_only(
    earlier: list[EarlierTest], rule: RetestSection
) -> None:
    if isinstance(ruled(earlier, rule), RefusedTest):
        return
    assert sum(test.verdict is not Verdict.ABORTED for test in earlier) < rule.most_tests
    judged = [n for n, test in enumerate(earlier) if test.verdict in JUDGED]
    if judged:
        since = earlier[judged[-1] + 1 :]
        assert earlier[judged[-1]].verdict.value in rule.verdicts or any(test.again_by for test in since)
    assert any(test.verdict.value in rule.verdicts for test in earlier)


@given(histories, rules, rules)
def test_a_wider_rule_refuses_nothing_that_a_narrower_one_admits(
    earlier: list[EarlierTest], rule: RetestSection, other: RetestSection
) -> None:
    wider = rule.model_copy(
        update={
            "verdicts": rule.verdicts | other.verdicts,
            "most_tests": max(rule.most_tests, other.most_tests),
        }
    )
    if isinstance(ruled(earlier, rule), AdmittedTest):
        assert isinstance(ruled(earlier, wider), AdmittedTest)


@given(histories, rules, st.randoms())
def test_a_file_and_a_server_that_both_know_some_of_it_give_one_decision(
    earlier: list[EarlierTest], rule: RetestSection, random: Random
) -> None:
    here = [test for test in earlier if random.random() < 0.7]
    there = [test for test in earlier if test not in here or random.random() < 0.5]
    random.shuffle(there)
    assert ruled(in_order([*there, *here]), rule) == ruled(earlier, rule)


@given(histories, rules)
def test_who_is_refused_hears_where_and_with_which_verdict(earlier: list[EarlierTest], rule: RetestSection) -> None:
    decision = ruled(earlier, rule)
    if isinstance(decision, RefusedTest):
        said = str(decision.why)
        assert decision.by_person
        assert f"A1 was tested before: {earlier[-1].verdict.value} at station line 3, socket left" in said
        assert f"as motor {earlier[-1].number} of batch B1" in said
        assert "again.verdicts" in said or "again.most_tests" in said


def test_the_usual_rule_takes_what_was_cut_off_and_nothing_that_was_judged() -> None:
    usual = RetestSection()
    for admitted in (["aborted"], ["error"], ["error", "aborted", "aborted"], ["fail", "aborted!"], ["pass", "error!"]):
        assert isinstance(ruled(history_of(*admitted), usual), AdmittedTest), admitted
    for refused in (["pass"], ["fail"], ["aborted", "fail"], ["fail", "error"], ["error"] * 3, ["pass", "fail!"]):
        assert isinstance(ruled(history_of(*refused), usual), RefusedTest), refused


@pytest.mark.parametrize(
    ("verdict", "test_number", "again"),
    [
        ("error", 1, True),
        ("error", 3, False),
        ("aborted", 1, True),
        ("aborted", 9, True),
        ("pass", 1, False),
        ("fail", 1, False),
    ],
)
def test_what_came_to_no_verdict_is_taken_again_as_long_as_the_rule_allows(
    verdict: str, test_number: int, again: bool
) -> None:
    assert takes_again(Verdict(verdict), test_number, RetestSection()) is again
    assert not takes_again(Verdict(verdict), test_number, RetestSection(verdicts=frozenset()))
