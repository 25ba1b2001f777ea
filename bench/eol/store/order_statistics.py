"""Single values by their rank, out of the index by value: percentiles of very many figures without reading them all."""

from bisect import bisect_left
from collections.abc import Sequence
from itertools import accumulate

from sqlalchemy import Connection, and_, select

from bench.eol.store.distribution import Distribution
from bench.eol.store.schema import FIGURE
from bench.eol.store.selection import Selection

#: Ranks that lie nearer to each other than this are read in one go.
_TOGETHER = 2000


def values_at(
    connection: Connection, found: Distribution, selection: Selection, ranks: Sequence[int]
) -> dict[int, float]:
    """Return a parameter's values by rank, from 1 for the least.

    The bins' counts tell in which bin a rank lies; the database walks there from the bin's beginning.
    """
    ends = list(accumulate(found.bins.counts))
    values: dict[int, float] = {}
    for group in _groups(sorted(ranks)):
        n = bisect_left(ends, group[0])
        before = ends[n - 1] if n else 0
        of_it = and_(
            FIGURE.c.parameter == found.parameter, selection.holds(FIGURE.c.motor), FIGURE.c.value.is_not(None)
        )
        if n:
            of_it = and_(of_it, FIGURE.c.value >= found.bins.edges[n])
        query = select(FIGURE.c.value).where(of_it).order_by(FIGURE.c.value)
        rows = connection.execute(query.offset(group[0] - before - 1).limit(group[-1] - group[0] + 1)).scalars().all()
        values |= {rank: rows[rank - group[0]] for rank in group if rank - group[0] < len(rows)}
    return values


def _groups(ranks: Sequence[int]) -> list[list[int]]:
    groups: list[list[int]] = []
    for rank in ranks:
        if groups and rank - groups[-1][0] < _TOGETHER:
            groups[-1].append(rank)
        else:
            groups.append([rank])
    return groups
