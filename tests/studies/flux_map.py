"""How well the flux map's estimator does on random benches of which nothing is known but the limits of their gains.

`python -m tests.studies.flux_map [--benches N] [--seed S] [--table FILE] [--other FILE PAIRS OHM RAD_S]
[--motors NAME …] [--locations L] [--workers K]`

`--table` is a measured map (id_A,iq_A,psi_d_Vs,psi_q_Vs on a full grid) that is taken as one truth more; made-up ones are always there.
Demanded: ψ within 0.5 % of full scale at every measured point in 95 % of the benches, 95 % intervals that hold 93 … 97 %, the MTPA angle
within 0.7° and the torque within 1 % in 95 % of the benches, no more than 90 readings for 51 locations
(without symmetry, a plane of twice as many is read).
"""

import argparse
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from procedures.estimation.flux.estimator import estimate_flux_map
from procedures.estimation.flux.flux_map import GainLimits
from procedures.estimation.flux.mtpa import maximum_torque_per_ampere
from procedures.estimation.flux.mtpa_locations import about_mtpa, held_back
from procedures.estimation.flux.plan import further_readings, grid_locations, other_sides, reading_order
from tests.procedures.estimation.flux.half_widths import half_widths
from tests.studies.worlds.flux_benches import CURRENT_GAIN, VOLTAGE_GAIN, random_bench, read
from tests.studies.worlds.flux_truths import OtherTable, TrueMotor, true_motors

POINT, SHARE, HELD, ANGLE, TORQUE, READINGS = 0.005, 0.95, (0.93, 0.97), 0.7, 0.01, 90
#: Shares of the largest current at which MTPA is asked for.
SHARES = (0.25, 0.5, 1.0)
_BATCH = 25


@dataclass(frozen=True)
class BenchResult:
    """What became of one bench: largest error of a component and of a vector (shares of full scale), rms, share of intervals that hold,
    residual variance over the noise's, errors of angle (deg) and torque (relative) at MTPA, and which of their intervals hold.
    """

    readings: int
    locations: int
    worst: float
    worst_vector: float
    rms: float
    held: float
    variance: float
    angle: tuple[float, ...]
    torque: tuple[float, ...]
    angle_held: tuple[bool, ...]
    torque_held: tuple[bool, ...]
    symmetric: bool
    told: int


def true_mtpa(motor: TrueMotor, current: float) -> tuple[float, float]:
    """Return the angle (degrees from q towards −d) of most torque at a current (A), and the torque (N·m), by brute force."""
    beta = np.linspace(0.0, np.pi, 36001)
    i = current * np.exp(1j * beta)
    torque = 1.5 * motor.pole_pairs * (np.conj(motor.flux(i)) * i).imag
    if motor.d_range is not None:
        torque = np.where((i.real >= motor.d_range[0]) & (i.real <= motor.d_range[1]), torque, -np.inf)
    best = int(np.argmax(torque))
    return float(np.degrees(beta[best])) - 90.0, float(torque[best])


def one(motor: TrueMotor, seed: Sequence[int], locations: int) -> BenchResult:
    """Return what becomes of one random bench."""
    random = np.random.default_rng(list(seed))
    bench = random_bench(motor, random)
    # A motor that is not symmetric has twice the plane to be read.
    sides = 1 if motor.symmetric else 2
    later = held_back(locations)
    count = sides * (locations - later)
    points = grid_locations(motor.largest_current, count, i_d_range=motor.d_range, both_sides=not motor.symmetric)
    plan = reading_order(points, random)
    readings, wanted = read(motor, bench, plan, random)
    made = estimate_flux_map(readings, gains=GainLimits(VOLTAGE_GAIN, CURRENT_GAIN), wanted=wanted)
    if motor.symmetric and not made.symmetric:
        # As the procedure does: read on the other sides what was read on one.
        plan = [*plan, *other_sides(plan, random)]
        readings, wanted = read(motor, bench, plan, random)
        made = estimate_flux_map(readings, gains=GainLimits(VOLTAGE_GAIN, CURRENT_GAIN), wanted=wanted)
    # As the procedure does: the last currents lie about the largest torque per ampere of those before.
    plan = [*plan, *further_readings(about_mtpa(made.map, later), random, both_sides=not made.symmetric)]
    readings, wanted = read(motor, bench, plan, random)
    made = estimate_flux_map(readings, gains=GainLimits(VOLTAGE_GAIN, CURRENT_GAIN), wanted=wanted)
    found = made.map
    flux = motor.flux(found.points[:, 0] + 1j * found.points[:, 1])
    error = found.flux - np.column_stack((flux.real, flux.imag))
    scale, half = float(np.max(np.abs(flux))), half_widths(found)
    given = half > 0.0
    currents = motor.largest_current * np.array(SHARES)
    mtpa = maximum_torque_per_ampere(found, currents, motor.pole_pairs)
    truth = [true_mtpa(motor, float(current)) for current in currents]
    return BenchResult(
        len(plan),
        len(found.points),
        float(np.max(np.abs(error))) / scale,
        float(np.max(np.hypot(*error.T))) / scale,
        float(np.sqrt(np.mean(error[given] ** 2))) / scale,
        float(np.mean(np.abs(error[given]) <= half[given])),
        made.fit.variance_ratio,
        tuple(each.angle.value - angle for each, (angle, _) in zip(mtpa, truth, strict=True)),
        tuple(each.torque.value / torque - 1.0 for each, (_, torque) in zip(mtpa, truth, strict=True)),
        tuple(
            each.angle.coverage_interval[0] <= angle <= each.angle.coverage_interval[1]
            for each, (angle, _) in zip(mtpa, truth, strict=True)
        ),
        tuple(
            each.torque.coverage_interval[0] <= torque <= each.torque.coverage_interval[1]
            for each, (_, torque) in zip(mtpa, truth, strict=True)
        ),
        made.symmetric,
        len(made.misfit.findings),
    )


def batch(
    table: Path | None, others: tuple[OtherTable, ...], name: str, benches: range, seed: int, locations: int
) -> list[BenchResult]:
    """Return the results of some benches of one motor."""
    motor = true_motors(table, others)[name]
    return [one(motor, (seed, bench), locations) for bench in benches]


def line(name: str, results: Sequence[BenchResult]) -> str:
    """Return a motor's row of the table."""

    def quantile(values: Sequence[float], share: float) -> float:
        return float(np.quantile(np.abs(values), share))

    angle = " / ".join(f"{quantile([r.angle[k] for r in results], SHARE):.2f}" for k in range(len(SHARES)))
    torque = " / ".join(f"{100.0 * quantile([r.torque[k] for r in results], SHARE):.2f}" for k in range(len(SHARES)))
    held_angle = " / ".join(f"{np.mean([r.angle_held[k] for r in results]):.0%}" for k in range(len(SHARES)))
    held_torque = " / ".join(f"{np.mean([r.torque_held[k] for r in results]):.0%}" for k in range(len(SHARES)))
    worst = [r.worst for r in results]
    return (
        f"| {name} | {results[0].locations} / {results[0].readings} | {100.0 * float(np.median(worst)):.2f} / "
        f"{100.0 * quantile(worst, SHARE):.2f} | {np.mean(np.array(worst) <= POINT):.1%} | "
        f"{np.mean([r.worst_vector <= POINT for r in results]):.1%} | {100.0 * float(np.mean([r.rms for r in results])):.3f} | "
        f"{np.mean([r.held for r in results]):.1%} | {angle} | {held_angle} | {torque} | {held_torque} | "
        f"{np.mean([r.variance for r in results]):.2f} | {np.mean([not r.symmetric for r in results]):.1%} |"
    )


def missed(name: str, results: Sequence[BenchResult]) -> Iterator[str]:
    """Give which demands a motor misses."""
    if np.mean([r.worst <= POINT for r in results]) < SHARE:
        yield f"{name}: ψ within 0.5 % of full scale at every point"
    if not HELD[0] <= float(np.mean([r.held for r in results])) <= HELD[1]:
        yield f"{name}: intervals of ψ"
    for k, share in enumerate(SHARES):
        if np.quantile(np.abs([r.angle[k] for r in results]), SHARE) > ANGLE:
            yield f"{name}: MTPA angle at {share:.0%} of the current"
        if np.quantile(np.abs([r.torque[k] for r in results]), SHARE) > TORQUE:
            yield f"{name}: torque at {share:.0%} of the current"
    if results[0].locations <= 51 < READINGS < results[0].readings:
        yield f"{name}: readings"


def main() -> None:
    """Print the table, and what is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benches", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--table", type=Path, default=None)
    parser.add_argument(
        "--other", nargs=4, action="append", default=[], metavar=("FILE", "PAIRS", "OHM", "RAD_S"),
        help="another table, and its motor's pole pairs, resistance and electrical speed of the test",
    )  # fmt: skip
    parser.add_argument("--motors", nargs="*", default=None)
    parser.add_argument("--locations", type=int, default=51)
    parser.add_argument("--workers", type=int, default=1, help="processes of this machine")
    given = parser.parse_args()
    heads = (
        "map", "locations / readings", "worst point % median / 95 %", "benches within 0.5 %", "as a vector", "rms %", "ψ held",
        "MTPA 95 % °", "held", "torque 95 % %", "held", "residual variance", "taken as asymmetric",
    )  # fmt: skip
    print(f"| {' | '.join(heads)} |\n|{' --- |' * len(heads)}")
    others = tuple(OtherTable(Path(file), int(pairs), float(r), float(w)) for file, pairs, r, w in given.other)
    misses: list[str] = []
    with ProcessPoolExecutor(given.workers) as pool:
        for name in given.motors or true_motors(given.table, others):
            parts = [range(k, min(k + _BATCH, given.benches)) for k in range(0, given.benches, _BATCH)]
            promises = [
                pool.submit(batch, given.table, others, name, part, given.seed, given.locations) for part in parts
            ]
            results = [result for promise in promises for result in promise.result()]
            print(line(name, results), flush=True)
            misses += missed(name, results)
    print("\nmissed:\n  " + "\n  ".join(misses) if misses else "\nno demand is missed")


if __name__ == "__main__":
    # Small matrices: threads of the linear algebra would only wait for each other.
    if os.environ.get("OPENBLAS_NUM_THREADS") != "1":
        os.environ["OPENBLAS_NUM_THREADS"] = "1"
        os.execv(os.sys.executable, [os.sys.executable, "-m", "tests.studies.flux_map", *os.sys.argv[1:]])  # noqa: S606
    main()
