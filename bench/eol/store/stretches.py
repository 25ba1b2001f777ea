"""Stretches of keys: which of them are summed up, and what lies between."""

from bisect import bisect_right
from collections.abc import Sequence

from sqlalchemy import ColumnElement, Connection, false, or_, select

from bench.eol.store.summed_tables import SUMMED_STRETCH

#: The first and the last key.
Stretch = tuple[int, int]
#: No key is greater.
LAST_KEY = 2**31 - 1
#: So many gaps at most are left between summed-up stretches: a query has room for so many conditions.
_GAPS = 200


def summed_stretches(connection: Connection) -> tuple[Stretch, ...]:
    """Return the stretches that are summed up, in order; those that would leave too many gaps are left out."""
    query = select(SUMMED_STRETCH.c.first, SUMMED_STRETCH.c.last).where(SUMMED_STRETCH.c.by_test)
    stretches = [(row.first, row.last) for row in connection.execute(query.order_by(SUMMED_STRETCH.c.first))]
    runs = joined(stretches)
    if len(runs) <= _GAPS:
        return tuple(stretches)
    longest = sorted(runs, key=lambda run: run[0] - run[1])[:_GAPS]
    return tuple(each for each in stretches if any(first <= each[0] <= last for first, last in longest))


def joined(stretches: Sequence[Stretch]) -> list[Stretch]:
    """Return stretches in order, those that touch or overlap made one."""
    merged: list[Stretch] = []
    for first, last in sorted(stretches):
        if merged and first <= merged[-1][1] + 1:
            merged[-1] = (merged[-1][0], max(merged[-1][1], last))
        else:
            merged.append((first, last))
    return merged


def without(stretches: Sequence[Stretch], taken: Sequence[Stretch]) -> list[Stretch]:
    """Return what of stretches lies beyond those that are `taken`; both are in order."""
    left = []
    away = joined(taken)
    for first, last in stretches:
        for low, high in away:
            if high < first or low > last:
                continue
            if first < low:
                left.append((first, low - 1))
            first = high + 1
        if first <= last:
            left.append((first, last))
    return left


def unsummed(stretches: Sequence[Stretch]) -> list[Stretch]:
    """Return all keys that lie beyond summed-up stretches."""
    return without([(1, LAST_KEY)], stretches)


def among(key: ColumnElement[int], stretches: Sequence[Stretch]) -> ColumnElement[bool]:
    """Return the condition that a key is of one of some stretches; the database may go there by the key."""
    return or_(false(), *(key.between(first, last) for first, last in stretches))


class StretchesByKey:
    """Tells of a key whether it is `in` one of some stretches."""

    def __init__(self, stretches: Sequence[Stretch]) -> None:
        self._joined = joined(stretches)
        self._starts = [first for first, _ in self._joined]

    def __contains__(self, key: int) -> bool:
        place = bisect_right(self._starts, key)
        return place > 0 and key <= self._joined[place - 1][1]
