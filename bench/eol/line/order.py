"""In which order a plan's procedures are taken."""

from collections.abc import Mapping, Sequence

from bench.eol.plan import Check


def by_time_over_failures(
    checks: Sequence[Check], experience: Mapping[str, tuple[int, int, float]]
) -> tuple[Check, ...]:
    """Return the checks with the least time over failure rate first, none before those that it comes after.

    `experience` gives by procedure how many attempts were made, how many did not pass, and their mean time (s). The rate is
    estimated by (failures + 1)/(attempts + 2) (Laplace's rule of succession), so that few motors decide little.
    Where one procedure has no experience the listed order stays, for nothing can be compared.
    Source: W. E. Smith, Naval Research Logistics Quarterly 3 (1956) 59: for independent tests that end with the first
    failure, the order by time over failure probability has the least expected time.
    """
    if any(check.name not in experience for check in checks):
        return tuple(checks)

    def cost(check: Check) -> float:
        attempts, failures, time = experience[check.name]
        return time * (attempts + 2) / (failures + 1)

    left, ordered = list(checks), list[Check]()
    while left:
        waiting = {check.name for check in left}
        free = [check for check in left if not waiting & set(check.after)]
        best = min(free, key=cost)
        left.remove(best)
        ordered.append(best)
    return tuple(ordered)


def sampled(checks: Sequence[Check], number: int) -> tuple[Check, ...]:
    """Return the checks that a batch's motor of this number (from 1) has: those of every n-th begin with the first."""
    return tuple(check for check in checks if (number - 1) % check.every == 0)
