"""How often the intervals of the mechanical estimators hold the truth when the world is not as the model says.

`python -m tests.studies.mechanics_misfit [--records N] [--seed S] [--rows NAME …] [--without CAUSE …] [--workers K]`

A row "bare" is a coast-down alone, down to 5 % of the top speed or to 20 %, its frictions over inertia judged without a limit of gain.
With `--without` the estimator does not know these causes, as one that no list holds. Result and order do not depend on the workers.

Printed by row: share of the 95 % intervals that hold the truth (total: with the transducer's gain limit of 0.3 %; scatter: without),
beyond 3 U, warned, withheld, and the mean half-width relative to the truth.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, Fit
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.mechanics import ramp_causes, ramp_fit, ramp_trials
from procedures.estimation.mechanics.inertia import fit_ramps
from tests.studies.worlds.shaft_records import Shaft, draw, fit_coast_down, move, record

GAIN = 0.003
_BATCH = 50
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


def quiet(s: Shaft, r: Random) -> None:
    s.noise *= log(r, 1e-3, 0.1)


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


def to_share(share: float) -> Callable[[Shaft, Random], None]:
    def made(s: Shaft, r: Random) -> None:
        s.coast_share = share

    return made


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
    "speed filter, torque filter": both(speed_filter, torque_filter),
    "quiet speed, clean": quiet,
    "quiet speed, torque filter": both(quiet, torque_filter),
    "quiet speed, both filters": both(quiet, speed_filter, torque_filter),
    "thinning grease": thinning,
    "bare to 5 %, clean": to_share(0.05),
    "bare to 5 %, thinning grease": both(thinning, to_share(0.05)),
    "bare to 20 %, thinning grease": thinning,
    "bare to 5 %, Stribeck": both(stribeck, to_share(0.05)),
    "bare to 5 %, Stribeck, Gaussian": both(stribeck_gaussian, to_share(0.05)),
    "bare to 20 %, clean": nothing,
    "bare to 20 %, Stribeck": stribeck,
    "bare to 20 %, Stribeck, Gaussian": stribeck_gaussian,
}
NAMES, RATES = ("inertia", "coulomb_friction", "viscous_friction"), ("coulomb_deceleration", "viscous_rate")


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
    by_name: dict[str, Tally] = field(default_factory=dict)

    def add(self, other: "Row") -> None:
        """Take another part of the row into account."""
        self.records += other.records
        self.warned += other.warned
        self.refused += other.refused
        for cause, count in other.causes.items():
            self.causes[cause] = self.causes.get(cause, 0) + count
        for name, more in other.by_name.items():
            tally = self.by_name.setdefault(name, Tally())
            tally.given += more.given
            tally.held += more.held
            tally.scatter += more.scatter
            tally.beyond += more.beyond
            tally.width += more.width


def ramps(name: str, records: int, seed: int, *, without: Sequence[Cause] = (), workers: int = 1) -> Row:
    """Return how fits of so many records of a row do, by an estimator that does not know some causes."""
    sizes = [min(_BATCH, records - begun) for begun in range(0, records, _BATCH)]
    part, whole = partial(batch, name, seed, tuple(without)), Row()
    if workers == 1:
        for made in map(part, range(len(sizes)), sizes):
            whole.add(made)
        return whole
    with ProcessPoolExecutor(workers) as pool:
        for made in pool.map(part, range(len(sizes)), sizes):
            whole.add(made)
    return whole


def batch(name: str, seed: int, without: tuple[Cause, ...], number: int, records: int) -> Row:
    """Return how one batch of a row's records does."""
    known = ramp_trials.families, ramp_fit.look, ramp_fit.periodic, ramp_trials.unseen
    ramp_trials.families, ramp_fit.look, ramp_fit.periodic = unaware(without)
    if Cause.STRIBECK in without:
        ramp_trials.unseen = lambda *_: []
    try:
        random = np.random.default_rng([seed, sum(map(ord, name)), number])
        row = Row(by_name={estimate: Tally() for estimate in (RATES if name.startswith("bare") else NAMES)})
        shafts = [draw(random) for _ in range(records)]
        for shaft in shafts:
            ROWS[name](shaft, random)
        for shaft, motion in zip(shafts, move(shafts), strict=True):
            row.records += 1
            judge(row, shaft, motion, random, stated=name.endswith("stated"))
        return row
    finally:
        ramp_trials.families, ramp_fit.look, ramp_fit.periodic, ramp_trials.unseen = known


def unaware(without: tuple[Cause, ...]):
    """Return what the estimator looks for and fits, without some causes."""

    def families(model, found):
        return (each for each in ramp_causes.families(model, found) if each.cause not in without)

    def look(model, solved):
        seen = ramp_causes.look(model, solved)
        kept = [k for k, cause in enumerate(seen.causes) if cause not in without]
        score = replace(seen.score, z=seen.score.z[kept], bias=seen.score.bias[kept])
        return ramp_causes.Look(tuple(seen.causes[k] for k in kept), score)

    def periodic(model, solved):
        found = ramp_causes.periodic(model, solved)
        return None if found is None or found.cause in without else found

    return families, look, periodic


def judge(row: Row, shaft: Shaft, motion, random: Random, *, stated: bool) -> None:
    """Take one record into account; the transducer is off by a gain within its limit."""
    bare = RATES[0] in row.by_name
    limit = 0.0 if bare else GAIN
    gain = 1.0 + random.uniform(-limit, limit)
    truths = (shaft.coulomb, shaft.viscous) if bare else (shaft.inertia, shaft.coulomb, shaft.viscous)
    try:
        made = record(shaft, motion, random, stated=stated)
        fit: Fit = fit_coast_down(made[1].time, made[1].speed) if bare else fit_ramps(made)
    except EstimationError:
        row.refused += 1
        return
    row.warned += bool(fit.misfit)
    for cause in {f.cause.value for f in fit.misfit.findings}:
        row.causes[cause] = row.causes.get(cause, 0) + 1
    for name, of_shaft in zip(row.by_name, truths, strict=True):
        truth = of_shaft / shaft.inertia if bare else of_shaft
        tally = row.by_name[name]
        if fit.misfit.withholding(name):
            continue
        tally.given += 1
        value, u = fit.value(name), fit.uncertainty(name)
        total = 2.0 * np.hypot(u, value * limit / np.sqrt(3.0))
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
    parser.add_argument("--without", nargs="*", type=Cause, default=(), help="causes that the estimator is not to know")
    parser.add_argument("--workers", type=int, default=1, help="processes of this machine")
    given = parser.parse_args()
    print("| record | estimate | held, total | held, scatter | beyond 3 U | median U | warned | not given | named |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |")
    for name in given.rows:
        for line in lines(name, ramps(name, given.records, given.seed, without=given.without, workers=given.workers)):
            print(line, flush=True)


if __name__ == "__main__":
    main()
