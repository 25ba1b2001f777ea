"""How often two coast-downs, one made after the other, hold friction over inertia while grease warms up.

`python -m tests.studies.coast_pairs [--records N] [--seed S]`

Coulomb friction falls as 1 − exp(−t/τ) by 0.3 to 50 %, τ being 0.3 to 4 times a coast-down; or all friction is another in the second
record, by 0.3 to 50 %, and steady in both. Held are the figures at the beginning.
Printed by row: share of the 95 % intervals that hold the truth, beyond 3 U, records warned of, refused, and the median half-width.
"""

import argparse
from dataclasses import dataclass, field, replace

import numpy as np

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.mechanics.inertia import fit_coast_downs
from procedures.estimation.mechanics.turning import SpeedRamp

#: Readings of a coast-down, their scatter as a share of the top speed, that at which it ends, and steps of the integration.
_READINGS, _NOISE, _END, _STEPS = 300, 3e-4, 0.06, 20_000


@dataclass(frozen=True)
class Bearing:
    """Friction over inertia: Coulomb (rad/s²), viscous (1/s), quadratic (1/rad), and by which share and how fast (s) the first falls."""

    coulomb: float
    viscous: float
    quadratic: float
    fall: float = 0.0
    time_constant: float = 1.0

    def coast(self, begun: float, top: float, random: np.random.Generator) -> SpeedRamp:
        """Return a coast-down from a speed (rad/s), begun after so much turning (s)."""
        slowest = self.coulomb * (1.0 - self.fall)
        step = (1.0 - _END) * top / slowest / _STEPS
        speed, time, speeds = top, 0.0, [top]

        def rate(at: float, w: float) -> float:
            fallen = self.fall * (1.0 - np.exp(-at / self.time_constant))
            return -(self.coulomb * (1.0 - fallen) + self.viscous * w + self.quadratic * w**2)

        while speed > _END * top:
            middle = speed + 0.5 * step * rate(begun + time, speed)
            speed += step * rate(begun + time + 0.5 * step, middle)
            time += step
            speeds.append(speed)
        taken = np.linspace(0, len(speeds) - 1, _READINGS).astype(int)
        scatter = random.normal(0.0, _NOISE * top, _READINGS)
        return SpeedRamp(step * taken, np.array(speeds)[taken] + scatter, 0.0, 0.0, 0.0)


@dataclass
class Row:
    """Counts of one row."""

    held: int = 0
    given: int = 0
    beyond: int = 0
    warned: int = 0
    refused: int = 0
    widths: list[float] = field(default_factory=list)


_ROWS = ("clean", "grease that warms up", "another day")


def row_of(records: int, seed: int, kind: str) -> Row:
    """Return how so many pairs of a kind do."""
    row, random = Row(), np.random.default_rng([seed, _ROWS.index(kind)])
    for _ in range(records):
        top = random.uniform(100.0, 600.0)
        coulomb = top / random.uniform(1.5, 12.0)
        bearing = Bearing(
            coulomb,
            coulomb / top * random.uniform(0.1, 1.0),
            coulomb / top**2 * random.uniform(0.0, 0.3),
            float(np.exp(random.uniform(np.log(0.003), np.log(0.5)))) if kind != "clean" else 0.0,
            random.uniform(0.3, 4.0) * top / coulomb,
        )
        if kind == "another day":
            less = 1.0 + bearing.fall * random.choice((-1.0, 1.0))
            bearing = replace(bearing, fall=0.0)
            other = Bearing(less * bearing.coulomb, less * bearing.viscous, less * bearing.quadratic)
            pair = [bearing.coast(0.0, top, random), other.coast(0.0, top, random)]
        else:
            first = bearing.coast(0.0, top, random)
            pair = [first, bearing.coast(float(first.time[-1]), top, random)]
        try:
            fit = fit_coast_downs(pair)
        except EstimationError:
            row.refused += 1
            continue
        row.warned += any(each.cause is not Cause.WINDAGE for each in fit.misfit.findings)
        for name, truth in (("coulomb_deceleration", bearing.coulomb), ("viscous_rate", bearing.viscous)):
            if fit.misfit.withholding(name):
                continue
            low, high = fit.interval(name)
            row.given += 1
            row.held += low <= truth <= high
            row.beyond += abs(0.5 * (low + high) - truth) > 1.5 * (high - low)
            row.widths.append(0.5 * (high - low) / truth)
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    print("| two coast-downs | figures | held | beyond 3 U | median U | warned | refused |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name in _ROWS:
        row = row_of(given.records, given.seed, name)
        print(
            f"| {name} | {row.given} | {row.held / max(row.given, 1):.1%} | {row.beyond} | {np.median(row.widths):.2%} | "
            f"{row.warned / given.records:.1%} | {row.refused} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
