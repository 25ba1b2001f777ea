"""The order of a plan's procedures: the least expected time until a motor's first failure, and which motors have which."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from bench.eol.plan import PlannedCheck

#: Sets of procedures that may be done first; beyond so many the order is built up and not proved the best.
_SETS = 20_000


def by_time_over_failures(
    checks: Sequence[PlannedCheck], experience: Mapping[str, tuple[int, int, float]]
) -> tuple[PlannedCheck, ...]:
    """Return the checks in the order of the least expected time until the first failure, none before those that it comes after.

    `experience` gives by procedure how many attempts were made, how many did not pass, and their mean time (s). The rate is
    estimated by (failures + 1)/(attempts + 2) (Laplace's rule of succession), so that few motors decide little.
    Where one procedure has no experience nothing can be compared: the listed order stays, as far as nothing comes too early in it.
    Source: W. E. Smith, Naval Research Logistics Quarterly 3 (1956) 59: for independent tests that end with the first
    failure, the order by time over failure probability has the least expected time. With what comes after others a slow procedure
    may be worth its time for those behind it (M. R. Garey, Operations Research 21 (1973) 46), so that whole orders are compared.
    """
    if any(check.name not in experience for check in checks):
        return as_listed(checks)
    tests = [_test(experience[check.name], _before(check, checks)) for check in checks]
    order = _best(_with_ranks(tests))
    return tuple(checks[number] for number in (order if order is not None else _built_up(tests)))


def sampled(checks: Sequence[PlannedCheck], number: int) -> tuple[PlannedCheck, ...]:
    """Return the checks that a batch's motor of this number (from 1) has: those of every n-th begin with the first."""
    return tuple(check for check in checks if (number - 1) % check.every == 0)


def as_listed(checks: Sequence[PlannedCheck]) -> tuple[PlannedCheck, ...]:
    """Return the checks as they are listed, but for those that come after others: these go before them."""
    order: list[int] = []
    for number, check in enumerate(checks):
        before = [(len(_before(checks[n], checks)), n) for n in _before(check, checks)]
        order += [n for _, n in sorted(before) if n not in order]
        order += [number] if number not in order else []
    return tuple(checks[number] for number in order)


@dataclass(frozen=True)
class _Test:
    """A procedure's time (s), the share of motors that pass it, and the numbers of all that come before it."""

    time: float
    passed: float
    before: frozenset[int]

    @property
    def cost(self) -> float:
        return self.time / (1.0 - self.passed)


def _test(experience: tuple[int, int, float], before: frozenset[int]) -> _Test:
    attempts, failures, time = experience
    return _Test(time, 1.0 - (failures + 1) / (attempts + 2), before)


def _before(check: PlannedCheck, checks: Sequence[PlannedCheck]) -> frozenset[int]:
    """Return the numbers of all checks that come before one, through whatever others."""
    numbers = {each.name: number for number, each in enumerate(checks)}
    found, waiting = set[int](), [name for name in check.after if name in numbers]
    while waiting:
        number = numbers[waiting.pop()]
        if number not in found:
            found.add(number)
            waiting += [name for name in checks[number].after if name in numbers]
    return frozenset(found)


def _with_ranks(tests: Sequence[_Test]) -> list[_Test]:
    """Return the tests with those that have the same before and the same behind them put in their own order.

    Exchanging two such tests changes nothing else, so that among them the one of less time over failure rate comes first.
    """
    behind = [frozenset(n for n, other in enumerate(tests) if number in other.before) for number in range(len(tests))]
    ranked = []
    for number, test in enumerate(tests):
        sooner = {
            n
            for n, other in enumerate(tests)
            if (other.before, behind[n]) == (test.before, behind[number]) and (other.cost, n) < (test.cost, number)
        }
        ranked.append(replace(test, before=test.before | sooner))
    return ranked


def _best(tests: Sequence[_Test]) -> list[int] | None:
    """Return the order of the least expected time, None where too many would have to be compared."""
    needed = [sum(1 << n for n in test.before) for test in tests]
    everything = (1 << len(tests)) - 1
    # What follows does not depend on the order of what was done, only on what it was.
    reached = layer = {0}
    while layer != {everything}:
        layer = {
            done | 1 << n for done in layer for n in range(len(tests)) if not done & 1 << n and needed[n] & ~done == 0
        }
        reached = reached | layer
        if len(reached) > _SETS:
            return None

    @cache
    def rest(done: int) -> tuple[float, int]:
        """Return the expected time (s) of all that is left, and which comes next."""
        if done == everything:
            return 0.0, -1
        return min(
            (tests[n].time + tests[n].passed * rest(done | 1 << n)[0], n)
            for n in range(len(tests))
            if not done & 1 << n and needed[n] & ~done == 0
        )

    order: list[int] = []
    done = 0
    while done != everything:
        order.append(rest(done)[1])
        done |= 1 << order[-1]
    return order


def _built_up(tests: Sequence[_Test]) -> list[int]:
    """Return an order of little expected time: again and again a test with all that it needs, of the least time over failures."""
    order: list[int] = []
    while len(order) < len(tests):
        blocks = []
        for number, test in enumerate(tests):
            if number in order:
                continue
            block = sorted({*test.before, number} - set(order), key=lambda n: (len(tests[n].before), tests[n].cost, n))
            time, passed = 0.0, 1.0
            for n in block:
                time += passed * tests[n].time
                passed *= tests[n].passed
            blocks.append((time / (1.0 - passed), block))
        order.append(min(blocks)[1][0])
    return order
