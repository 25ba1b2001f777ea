"""How often the intervals of decelerations at named speeds hold the truth, which follows from no law that the estimator knows.

`python -m tests.studies.deceleration [--records N] [--seed S] [--rows NAME …]`

Printed by row and share of the top speed: figures given, share of the 95 % intervals that hold, beyond 3 U, median half-width.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bench.analysis.decelerations import behind_filter
from procedures.estimation.fitting.fit import EstimationError, coverage_interval
from procedures.estimation.mechanics.deceleration import deceleration
from tests.studies.mechanics_misfit import (
    both,
    cogging,
    dropouts,
    eccentricity,
    log,
    nothing,
    quiet,
    speed_filter,
    stribeck,
    thinning,
    to_share,
    windage,
)
from tests.studies.worlds.shaft_records import Motion, Shaft, draw, fit_coast_down, move, record

SHARES = (0.25, 0.5, 0.75)
Random = np.random.Generator


def fan(s: Shaft, r: Random) -> None:
    s.quadratic = log(r, 1.0, 30.0) * s.coulomb / s.top**2
    s.torque += s.quadratic * s.top**2


def hump(s: Shaft, r: Random) -> None:
    """More friction at low speeds, up to three times the Coulomb friction."""
    s.stribeck, s.stribeck_power = log(r, 0.1, 3.0) * s.coulomb, 2.0
    s.stribeck_speed = log(r, 0.05, 0.5) * s.top
    s.torque += s.stribeck


def much_thinner(s: Shaft, r: Random) -> None:
    s.thinning = log(r, 0.1, 0.8)


ROWS: dict[str, Callable[[Shaft, Random], None]] = {
    "clean": nothing,
    "down to 5 %": to_share(0.05),
    "quiet speed": quiet,
    "windage": windage,
    "fan": fan,
    "Stribeck": stribeck,
    "hump": hump,
    "grease, up to 30 %": thinning,
    "grease, up to 80 %": much_thinner,
    "speed filter": speed_filter,
    "eccentricity": eccentricity,
    "cogging": cogging,
    "dropouts": dropouts,
    "steps of up to 3 %": nothing,
    "speed filter, eccentricity": both(speed_filter, eccentricity),
    "fan, eccentricity": both(fan, eccentricity),
    "hump, grease": both(hump, thinning),
}


def truth(shaft: Shaft, motion: Motion, speed: float) -> float:
    """Return the deceleration (rad/s²) of the shaft as it passes a speed, without what its cogging swings by."""
    if shaft.cogging:
        return shaft.friction(speed) / shaft.inertia
    # The motion lies on a grid; its ends are one-sided.
    time, falling = motion.time[motion.released :], motion.speed[motion.released :]
    return float(np.interp(speed, falling[-3:2:-1], -np.gradient(falling, time)[-3:2:-1]))


def judge(name: str, shaft: Shaft, motion: Motion, random: Random) -> list[tuple[float, float] | None]:
    """Return for each share the error over the interval's half-width, and that over the truth; None where no figure is given."""
    ramp = record(shaft, motion, random)[1]
    if name.startswith("steps"):
        step = shaft.top * log(random, 1e-3, 3e-2)
        ramp = replace(ramp, speed=step * np.round(ramp.speed / step), speed_resolution=step)
    try:
        misfit = fit_coast_down(ramp.time, ramp.speed, speed_resolution=ramp.speed_resolution).misfit
        run = behind_filter(ramp, misfit)
    except EstimationError:
        return [None] * len(SHARES)
    judged: list[tuple[float, float] | None] = []
    for share in SHARES:
        found = deceleration(run, share * shaft.top)
        if found is None or not found.told:
            judged.append(None)
            continue
        low, high = coverage_interval(found.value, found.uncertainty, found.degrees_of_freedom)
        true = truth(shaft, motion, found.speed)
        judged.append((2.0 * abs(found.value - true) / (high - low), 0.5 * (high - low) / true))
    return judged


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rows", nargs="*", default=list(ROWS))
    given = parser.parse_args()
    print("| record | at | given | held | beyond 3 U | median U |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    for name in given.rows:
        random = np.random.default_rng([given.seed, sum(map(ord, name))])
        shafts = [draw(random) for _ in range(given.records)]
        for shaft in shafts:
            ROWS[name](shaft, random)
        found = [
            judge(name, shaft, motion, random)
            for shaft, motion in zip(shafts, move(shafts), strict=True)
            if motion.released < motion.time.size
        ]
        for share, column in zip(SHARES, zip(*found, strict=True), strict=True):
            told = np.array([each for each in column if each is not None])
            print(
                f"| {name} | {share:.0%} | {len(told)} of {len(column)} | {np.mean(told[:, 0] <= 1.0):.1%} "
                f"| {np.sum(told[:, 0] > 3.0)} | {np.median(told[:, 1]):.2%} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
