"""How often the intervals of the mechanical estimators hold the truth when the world is not as the model says.

`python -m tests.studies.mechanics_misfit [--records N] [--seed S] [--rows NAME …]`

Printed by row: share of the 95 % intervals that hold the truth (total: with the transducer's gain limit of 0.3 %; scatter: without),
beyond 3 U, warned, withheld, and the mean half-width relative to the truth.
"""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.mechanics.inertia import fit_ramps
from tests.studies.shaft_records import Shaft, draw, move, record

GAIN = 0.003
_BATCH = 100
Random = np.random.Generator


def log(random: Random, low: float, high: float) -> float:
    """Draw a magnitude from negligible to gross."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def windage(s: Shaft, r: Random) -> None:
    s.quadratic = log(r, 0.003, 1.0) * s.coulomb / s.top**2


def stribeck(s: Shaft, r: Random) -> None:
    s.stribeck, s.stribeck_power = log(r, 0.003, 1.0) * s.coulomb, 1.0
    s.stribeck_speed = log(r, 0.02, 0.3) * s.top


def stribeck_gaussian(s: Shaft, r: Random) -> None:
    stribeck(s, r)
    s.stribeck_power = 2.0


def speed_filter(s: Shaft, r: Random) -> None:
    s.speed_filter = log(r, 0.001, 0.1)


def torque_filter(s: Shaft, r: Random) -> None:
    s.torque_filter = log(r, 0.001, 0.1)


def dropouts(s: Shaft, r: Random) -> None:
    s.dropouts = int(log(r, 1, 20))


def cogging(s: Shaft, r: Random) -> None:
    s.cogging, s.cogging_order = log(r, 0.01, 5.0) * s.coulomb, int(r.integers(4, 37))
    s.top, s.samples = s.top, s.samples
    s.steps = 30_000


def eccentricity(s: Shaft, r: Random) -> None:
    s.eccentricity = log(r, 1e-4, 0.02)


def thinning(s: Shaft, r: Random) -> None:
    s.thinning = log(r, 0.003, 0.3)


def nothing(s: Shaft, r: Random) -> None:
    pass


def both(*parts: Callable[[Shaft, Random], None]) -> Callable[[Shaft, Random], None]:
    def made(s: Shaft, r: Random) -> None:
        for part in parts:
            part(s, r)

    return made


ROWS: dict[str, Callable[[Shaft, Random], None]] = {
    "clean": nothing,
    "windage": windage,
    "Stribeck": stribeck,
    "Stribeck, Gaussian": stribeck_gaussian,
    "speed filter": speed_filter,
    "torque filter": torque_filter,
    "filters, stated": both(speed_filter, torque_filter),
    "dropouts": dropouts,
    "cogging": cogging,
    "eccentricity": eccentricity,
    "windage, Stribeck": both(windage, stribeck),
    "windage, speed filter": both(windage, speed_filter),
    "thinning grease (not in the list)": thinning,
}
NAMES = ("inertia", "coulomb_friction", "viscous_friction")


@dataclass
class Tally:
    """Counts of one row and one estimate."""

    given: int = 0
    held: int = 0
    scatter: int = 0
    beyond: int = 0
    width: list[float] = field(default_factory=list)


@dataclass
class Row:
    """One row's tallies and how many records were warned of, as what, and refused."""

    records: int = 0
    warned: int = 0
    refused: int = 0
    causes: dict[str, int] = field(default_factory=dict)
    by_name: dict[str, Tally] = field(default_factory=lambda: {name: Tally() for name in NAMES})


def ramps(name: str, records: int, seed: int) -> Row:
    """Return how fits of so many records of a row do."""
    random, row = np.random.default_rng([seed, sum(map(ord, name))]), Row()
    while row.records < records:
        shafts = [draw(random) for _ in range(min(_BATCH, records - row.records))]
        for shaft in shafts:
            ROWS[name](shaft, random)
        for shaft, motion in zip(shafts, move(shafts), strict=True):
            row.records += 1
            judge(row, shaft, motion, random, stated=name.endswith("stated"))
    return row


def judge(row: Row, shaft: Shaft, motion, random: Random, *, stated: bool) -> None:
    """Take one record into account; the transducer is off by a gain within its limit."""
    gain = 1.0 + random.uniform(-GAIN, GAIN)
    try:
        made = record(shaft, motion, random, stated=stated)
        fit = fit_ramps(made)
    except EstimationError:
        row.refused += 1
        return
    row.warned += bool(fit.misfit)
    for cause in {f.cause.value for f in fit.misfit.findings}:
        row.causes[cause] = row.causes.get(cause, 0) + 1
    for name, truth in zip(NAMES, (shaft.inertia, shaft.coulomb, shaft.viscous), strict=True):
        tally = row.by_name[name]
        if fit.misfit.withholding(name):
            continue
        tally.given += 1
        value, u = fit.value(name), fit.uncertainty(name)
        total = 2.0 * np.hypot(u, value * GAIN / np.sqrt(3.0))
        tally.scatter += abs(value - truth) <= 2.0 * u
        off = abs(value * gain - truth)
        tally.held += off <= total
        tally.beyond += off > 3.0 * total
        tally.width.append(total / truth)


def lines(name: str, row: Row) -> Iterator[str]:
    """Give the rows of the table."""
    causes = ", ".join(f"{c} {n / row.records:.1%}" for c, n in sorted(row.causes.items(), key=lambda e: -e[1]))
    for estimate, t in row.by_name.items():
        given = max(t.given, 1)
        yield (
            f"| {name} | {estimate} | {t.held / given:.1%} | {t.scatter / given:.1%} | {t.beyond} | "
            f"{np.median(t.width) if t.width else 0:.2%} | {row.warned / row.records:.1%} | {1 - t.given / row.records:.1%} | {causes} |"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rows", nargs="*", default=list(ROWS))
    given = parser.parse_args()
    print("| record | estimate | held, total | held, scatter | beyond 3 U | median U | warned | not given | named |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |")
    for name in given.rows:
        for line in lines(name, ramps(name, given.records, given.seed)):
            print(line, flush=True)


if __name__ == "__main__":
    main()
