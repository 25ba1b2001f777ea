"""Flux maps with one wild reading at a location that is read once: is it told, and does the interval hold what is so?

`python -m tests.studies.odd_locations --benches 3 --seed 91`; with `--ranks 0.01`, among how many least foreseen locations one is that is
off by that share of the largest voltage: what reading these once more would find.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.flux.estimator import FluxMapEstimate, estimate_flux_map
from procedures.estimation.flux.flux_map import GainLimits
from procedures.estimation.flux.odd_location import without
from procedures.estimation.flux.plan import grid_locations, reading_order
from tests.studies.worlds.flux_benches import CURRENT_GAIN, VOLTAGE_GAIN, random_bench, read
from tests.studies.worlds.flux_truths import TrueMotor, true_motors

#: By how much the reading is off, in shares of the largest voltage.
SIZES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.3)
GAINS = GainLimits(VOLTAGE_GAIN, CURRENT_GAIN)
TABLE = Path(__file__).parents[3] / "shared" / "data" / "flux_maps" / "baldor_400rpm.csv"


def worst(motor: TrueMotor, made: FluxMapEstimate) -> float:
    """Return the largest error of a flux linkage over its expanded uncertainty."""
    points = made.map.points
    true = motor.flux(points[:, 0] + 1j * points[:, 1])
    error = np.abs(made.map.flux - np.column_stack((true.real, true.imag)))
    half = 2.0 * made.map.uncertainty
    return float(np.max(error[half > 0.0] / half[half > 0.0]))


def one(motor: TrueMotor, seed: list[int], locations: int) -> Iterator[tuple[float, float, bool, bool]]:
    """Return for each size the worst error, whether anything is told, and whether the reading is."""
    random = np.random.default_rng(seed)
    bench = random_bench(motor, random)
    count = locations * (1 if motor.symmetric else 2)
    points = grid_locations(motor.largest_current, count, i_d_range=motor.d_range, both_sides=not motor.symmetric)
    readings, wanted = read(motor, bench, reading_order(points, random), random)
    made = estimate_flux_map(readings, gains=GAINS, wanted=wanted)
    of = made.fit.locations.of
    once = np.flatnonzero(np.bincount(of)[of] == 1)
    for size in SIZES:
        place, angle = int(random.choice(once)), random.uniform(0.0, 2.0 * np.pi)
        off = size * float(np.max(np.abs(readings.voltage))) * (np.arange(of.size) == place)
        wild = replace(readings, u_d=readings.u_d + off * np.cos(angle), u_q=readings.u_q + off * np.sin(angle))
        made = estimate_flux_map(wild, gains=GAINS, wanted=wanted)
        odd = [each for each in made.misfit.findings if each.cause is Cause.ODD_READING]
        told = [each for each in made.misfit.findings if each.cause is not Cause.ASYMMETRIC_MAP]
        yield size, worst(motor, made), bool(told), any(each.figures["number"] == place + 1 for each in odd)


def rank(motor: TrueMotor, seed: list[int], locations: int, size: float) -> tuple[int, int]:
    """Return the place of a location that is off by a size among those that are read once, the least foreseen first, and their number."""
    random = np.random.default_rng(seed)
    bench = random_bench(motor, random)
    count = locations * (1 if motor.symmetric else 2)
    points = grid_locations(motor.largest_current, count, i_d_range=motor.d_range, both_sides=not motor.symmetric)
    readings, wanted = read(motor, bench, reading_order(points, random), random)
    of = estimate_flux_map(readings, gains=GAINS, wanted=wanted).fit.locations.of
    once = np.flatnonzero(np.bincount(of)[of] == 1)
    place, angle = int(random.choice(once)), random.uniform(0.0, 2.0 * np.pi)
    off = size * float(np.max(np.abs(readings.voltage))) * (np.arange(of.size) == place)
    wild = replace(readings, u_d=readings.u_d + off * np.cos(angle), u_q=readings.u_q + off * np.sin(angle))
    fit = estimate_flux_map(wild, gains=GAINS, wanted=wanted).fit
    single = np.flatnonzero(np.bincount(fit.locations.of) == 1)
    scores = {int(k): without(fit, int(k)).score for k in single}
    wrong = scores[int(fit.locations.of[place])]
    return 1 + sum(score > wrong for score in scores.values()), len(scores)


def print_ranks(benches: int, seed: int, locations: int, size: float) -> None:
    """Print in how many maps the location is among the first one, three and six."""
    motors = true_motors(TABLE if TABLE.exists() else None).values()
    found = np.array([rank(motor, [seed, bench], locations, size)[0] for bench in range(benches) for motor in motors])
    first = ", ".join(f"among {many}: {100.0 * np.mean(found <= many):.0f} %" for many in (1, 3, 6))
    print(f"off by {100.0 * size:g} %, {found.size} maps, {first}")


def main() -> None:
    """Print a row for each size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benches", type=int, default=3, help="benches of each motor")
    parser.add_argument("--seed", type=int, default=91)
    parser.add_argument("--locations", type=int, default=60)
    parser.add_argument("--ranks", type=float, default=0.0, help="only the ranks of locations off by this share")
    given = parser.parse_args()
    if given.ranks:
        print_ranks(given.benches, given.seed, given.locations, given.ranks)
        return
    rows: dict[float, list[tuple[float, bool, bool]]] = {size: [] for size in SIZES}
    for bench in range(given.benches):
        for motor in true_motors(TABLE if TABLE.exists() else None).values():
            for size, error, told, named in one(motor, [given.seed, bench], given.locations):
                rows[size].append((error, told, named))
    print("| off by, % | maps | told, % | the reading named, % | beyond 3 U | of these not told | worst, U |")
    print("| ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for size, found in rows.items():
        error, told, named = np.array(found).T
        beyond = error > 3.0
        print(
            f"| {100.0 * size:g} | {error.size} | {100.0 * np.mean(told):.0f} | {100.0 * np.mean(named):.0f} | {np.sum(beyond)} "
            f"| {np.sum(beyond & (told == 0.0))} | {np.max(error):.1f} |"
        )


if __name__ == "__main__":
    main()
