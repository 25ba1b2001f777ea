"""Flux maps with one wild reading at a location that is read once: is it told, and does the interval hold what is so?

`python -m tests.studies.odd_locations --benches 3 --seed 91`: what stands out is read again, as the procedure does.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.flux.estimator import FluxMapEstimate, estimate_flux_map
from procedures.estimation.flux.flux_map import GainLimits
from procedures.estimation.flux.plan import PlannedReading, grid_locations, reading_order
from tests.studies.worlds.flux_benches import CURRENT_GAIN, VOLTAGE_GAIN, RandomBench, random_bench, read
from tests.studies.worlds.flux_truths import Array, TrueMotor, true_motors

#: By how much the reading is off, in shares of the largest voltage.
SIZES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.3)
GAINS = GainLimits(VOLTAGE_GAIN, CURRENT_GAIN)
TABLE = Path(__file__).parents[3] / "shared" / "data" / "flux_maps" / "baldor_400rpm.csv"


def errors(motor: TrueMotor, made: FluxMapEstimate) -> Array:
    """Return the errors of flux linkages over their expanded uncertainties."""
    points = made.map.points
    true = motor.flux(points[:, 0] + 1j * points[:, 1])
    error = np.abs(made.map.flux - np.column_stack((true.real, true.imag)))
    half = 2.0 * made.map.uncertainty
    return np.asarray(error[half > 0.0] / half[half > 0.0])


def worst(motor: TrueMotor, made: FluxMapEstimate) -> float:
    """Return the largest error of a flux linkage over its expanded uncertainty."""
    return float(np.max(errors(motor, made)))


def measured(
    motor: TrueMotor,
    bench: RandomBench,
    planned: Sequence[PlannedReading],
    random: np.random.Generator,
    place: int,
    off: complex,
) -> tuple[FluxMapEstimate, int]:
    """Return the map of a plan of which one reading is off (shares of the largest voltage), and how many were read again, as the
    procedure does.
    """
    plan, doubts = list(planned), [FluxMapEstimate.least_foreseen, lambda made: made.doubtful]
    while True:
        readings, wanted = read(motor, bench, plan, random)
        wild = off * float(np.max(np.abs(readings.voltage))) * (np.arange(len(plan)) == place)
        readings = replace(readings, u_d=readings.u_d + wild.real, u_q=readings.u_q + wild.imag)
        made = estimate_flux_map(readings, gains=GAINS, wanted=wanted)
        more = [plan[np.flatnonzero(made.kept)[k]] for k in doubts.pop(0)(made)] if doubts else []
        if not more:
            return made, len(plan) - len(planned)
        plan += more


def one(motor: TrueMotor, seed: list[int], locations: int) -> Iterator[tuple[float, float, bool, bool, int]]:
    """Give for each size the worst error, the share of intervals that hold, whether anything is told, whether the reading is, and how
    many were read again.
    """
    random = np.random.default_rng(seed)
    bench = random_bench(motor, random)
    count = locations * (1 if motor.symmetric else 2)
    points = grid_locations(motor.largest_current, count, i_d_range=motor.d_range, both_sides=not motor.symmetric)
    plan = reading_order(points, random)
    of = estimate_flux_map(*read(motor, bench, plan, random)[:1], gains=GAINS).fit.locations.of
    once = np.flatnonzero(np.bincount(of)[of] == 1)
    for size in SIZES:
        place, angle = int(random.choice(once)), random.uniform(0.0, 2.0 * np.pi)
        made, again = measured(motor, bench, plan, random, place, size * complex(np.cos(angle), np.sin(angle)))
        odd = [each for each in made.misfit.findings if each.cause is Cause.ODD_READING]
        told = [each for each in made.misfit.findings if each.cause is not Cause.ASYMMETRIC_MAP]
        off = errors(motor, made)
        yield (
            float(np.max(off)),
            float(np.mean(off <= 1.0)),
            bool(told),
            any(each.figures["number"] == place + 1 for each in odd),
            again,
        )


def main() -> None:
    """Print a row for each size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benches", type=int, default=3, help="benches of each motor")
    parser.add_argument("--seed", type=int, default=91)
    parser.add_argument("--locations", type=int, default=60)
    given = parser.parse_args()
    rows: dict[float, list[tuple[float, float, bool, bool, int]]] = {size: [] for size in SIZES}
    for bench in range(given.benches):
        for motor in true_motors(TABLE if TABLE.exists() else None).values():
            for size, found in zip(SIZES, one(motor, [given.seed, bench], given.locations), strict=True):
                rows[size].append(found)
    print(
        "| off by, % | maps | told, % | the reading named, % | beyond 3 U | of these not told | worst, U | held, % | read again, mean |"
    )
    print("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for size, found in rows.items():
        error, held, told, named, again = np.array(found).T
        beyond = error > 3.0
        print(
            f"| {100.0 * size:g} | {error.size} | {100.0 * np.mean(told):.0f} | {100.0 * np.mean(named):.0f} | {np.sum(beyond)} "
            f"| {np.sum(beyond & (told == 0.0))} | {np.max(error):.1f} | {100.0 * np.mean(held):.1f} | {np.mean(again):.1f} |"
        )


if __name__ == "__main__":
    main()
