"""The order of a plan's procedures, and which motors have which."""

from collections.abc import Sequence
from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.eol.line.preparation.procedure_order import by_time_over_failures, sampled
from bench.eol.plan import PlannedCheck


def check(name: str, *after: str, every: int = 1) -> PlannedCheck:
    return PlannedCheck(name, {}, every, "stop", 1, after)


def expected_time(names: list[str], experience: dict[str, tuple[int, int, float]]) -> float:
    """The mean time until the first failure or the end, failures being independent."""
    time, going = 0.0, 1.0
    for name in names:
        attempts, failures, each = experience[name]
        time += going * each
        going *= 1.0 - (failures + 1) / (attempts + 2)
    return time


@given(st.lists(st.tuples(st.integers(0, 50), st.floats(0.1, 100.0)), min_size=1, max_size=5))
def test_no_other_order_takes_less_time_on_average(figures: list[tuple[int, float]]) -> None:
    experience = {f"p{n}": (100, failures, time) for n, (failures, time) in enumerate(figures)}
    checks = [check(name) for name in experience]
    chosen = [each.name for each in by_time_over_failures(checks, experience)]
    least = min(expected_time(list(names), experience) for names in permutations(experience))
    assert expected_time(chosen, experience) <= least * (1.0 + 1e-9)


@pytest.mark.parametrize("sets", [20_000, 0])
@given(
    st.lists(st.tuples(st.integers(0, 99), st.floats(0.1, 100.0), st.sets(st.integers(0, 4))), min_size=1, max_size=6)
)
def test_what_comes_before_others_is_weighed_with_them(sets: int, figures: list[tuple[int, float, set[int]]]) -> None:
    experience = {f"p{n}": (100, failures, time) for n, (failures, time, _) in enumerate(figures)}
    checks = [check(f"p{n}", *(f"p{m}" for m in sorted(after) if m < n)) for n, (_, _, after) in enumerate(figures)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bench.eol.line.preparation.procedure_order._SETS", sets)
        chosen = [each.name for each in by_time_over_failures(checks, experience)]

    def allowed(names: Sequence[str]) -> bool:
        return all(set(each.after) <= set(names[: names.index(each.name)]) for each in checks)

    assert allowed(chosen)
    if sets:
        least = min(expected_time(list(names), experience) for names in permutations(experience) if allowed(names))
        assert expected_time(chosen, experience) <= least * (1.0 + 1e-9)


@pytest.mark.parametrize("sets", [20_000, 0])
def test_a_slow_one_comes_soon_for_what_waits_behind_it(monkeypatch: pytest.MonkeyPatch, sets: int) -> None:
    """By itself it finds nothing and comes last, and the one behind it, which finds most, would with it."""
    monkeypatch.setattr("bench.eol.line.preparation.procedure_order._SETS", sets)
    experience = {"other": (100, 10, 10.0), "opens": (100, 0, 5.0), "finds": (100, 80, 1.0)}
    checks = [check("other"), check("opens"), check("finds", "opens")]
    assert [each.name for each in by_time_over_failures(checks, experience)] == ["opens", "finds", "other"]


def test_very_many_procedures_are_put_in_order_all_the_same() -> None:
    experience = {f"p{n}": (100, n, 1.0 + n % 7) for n in range(60)}
    checks = [check(f"p{n}", *([f"p{n - 1}"] if n % 2 else [])) for n in range(60)]
    chosen = [each.name for each in by_time_over_failures(checks, experience)]
    assert sorted(chosen) == sorted(experience)
    assert all(chosen.index(f"p{n - 1}") < chosen.index(f"p{n}") for n in range(1, 60, 2))


def test_what_comes_after_another_stays_after_it() -> None:
    experience = {"slow": (100, 0, 60.0), "quick": (100, 5, 1.0), "other": (100, 1, 10.0)}
    checks = [check("slow"), check("quick", "slow"), check("other")]
    assert [each.name for each in by_time_over_failures(checks, experience)] == ["other", "slow", "quick"]


def test_without_experience_the_listed_order_stays() -> None:
    checks = [check("slow"), check("quick")]
    assert by_time_over_failures(checks, {"slow": (100, 0, 60.0)}) == tuple(checks)


def test_every_nth_motor_begins_with_the_first() -> None:
    checks = [check("each"), check("third", every=3)]
    assert [len(sampled(checks, number)) for number in range(1, 8)] == [2, 1, 1, 2, 1, 1, 2]
