"""The order of a plan's procedures, and which motors have which."""

from itertools import permutations

from hypothesis import given
from hypothesis import strategies as st

from bench.eol.line.preparation import by_time_over_failures, sampled
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


def test_what_comes_after_another_stays_after_it() -> None:
    experience = {"slow": (100, 0, 60.0), "quick": (100, 50, 1.0), "other": (100, 1, 10.0)}
    checks = [check("slow"), check("quick", "slow"), check("other")]
    assert [each.name for each in by_time_over_failures(checks, experience)] == ["other", "slow", "quick"]


def test_without_experience_the_listed_order_stays() -> None:
    checks = [check("slow"), check("quick")]
    assert by_time_over_failures(checks, {"slow": (100, 0, 60.0)}) == tuple(checks)


def test_every_nth_motor_begins_with_the_first() -> None:
    checks = [check("each"), check("third", every=3)]
    assert [len(sampled(checks, number)) for number in range(1, 8)] == [2, 1, 1, 2, 1, 1, 2]
