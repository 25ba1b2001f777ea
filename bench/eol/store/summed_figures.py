"""What a parameter's figures sum up to in stretches of motors that were summed up before."""

import json
from dataclasses import dataclass

from sqlalchemy import Connection, select

from bench.eol.limits import ParameterLimits
from bench.eol.store.binned_sums import BinnedSums
from bench.eol.store.limits_of_figures import limits_of
from bench.eol.store.selection import Selection
from bench.eol.store.stretches import Stretch
from bench.eol.store.summed_tables import SUMMED_FIGURES
from bench.eol.store.summing import MIXED


@dataclass(frozen=True)
class SummedFigures:
    """The sums of one parameter of one type over the motors of a stretch of keys."""

    stretch: Stretch
    limits: ParameterLimits
    edges: tuple[float, ...]
    sums: BinnedSums


def summed_figures(connection: Connection, parameter: str, selection: Selection) -> list[SummedFigures]:
    """Return the sums of the stretches that are chosen whole, the earliest first; those with changed limits are left out."""
    last_of = dict(selection.whole)
    query = select(SUMMED_FIGURES).where(
        SUMMED_FIGURES.c.model == selection.model,
        SUMMED_FIGURES.c.parameter == parameter,
        SUMMED_FIGURES.c.count != MIXED,
    )
    edges: dict[str, tuple[float, ...]] = {}
    result = []
    for row in connection.execute(query.order_by(SUMMED_FIGURES.c.first)):
        if row.first in last_of:
            if row.edges not in edges:
                edges[row.edges] = tuple(json.loads(row.edges))
            sums = BinnedSums(tuple(json.loads(row.counts)), row.middle, row.total, row.squares)
            stretch = (row.first, last_of[row.first])
            result.append(SummedFigures(stretch, limits_of(row.low, row.high), edges[row.edges], sums))
    return result
