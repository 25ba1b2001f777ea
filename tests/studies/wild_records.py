"""`python -m tests.studies.wild_records`: records that no model explains end soon, with a figure or the documented error."""

import argparse
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from time import process_time

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.mechanics.cogging import fit_cogging
from procedures.estimation.mechanics.inertia import fit_ramps
from procedures.estimation.mechanics.turning import SpeedRamp
from procedures.estimation.winding.current_step.repeats import StepReading, fit_repeats
from procedures.estimation.winding.resistance import slope
from procedures.estimation.winding.sweep.rotor_sweep import fit_rotor_sweep
from procedures.estimation.winding.sweep.timed_sweep import fit_timed_sweep
from tests.studies.fuzz.target import TooSlowError, in_time
from tests.studies.worlds.shaft_records import fit_coast_down

#: The longest that one record may take (s of processor time): a search among the causes of ramps takes up to 6 s.
LONGEST = 20.0

Array = NDArray[np.float64]
Random = np.random.Generator


def spoiled(random: Random, values: Array) -> Array:
    """Return a curve of height 1 with up to three things done to it that no estimator knows, read in steps."""
    n, place = values.size, np.arange(values.size)
    deeds: Sequence[Callable[[Array], Array]] = (
        lambda x: x + 0.3 * random.uniform() * np.sin(2.0 * np.pi * place / random.uniform(2.0, n)),
        lambda x: np.clip(x, random.uniform(-1.0, 0.5), random.uniform(0.5, 1.1)),
        lambda x: x - np.mean(x),
        lambda x: x + 0.01 * np.cumsum(random.normal(0.0, 1.0, n)),
        lambda x: x * np.exp(-place / n / random.uniform(0.05, 3.0)),
        lambda x: np.roll(x, int(random.integers(-n // 4, n // 4 + 1))),
        lambda x: np.where(place < random.integers(n), x, x[0]),
        lambda x: -x,
        lambda x: x + (place % 7 == 0) * random.uniform(),
        lambda x: x * random.uniform(0.8, 1.2, n),
        lambda x: np.interp(place + random.integers(1, 2 + n // 3) * (place > random.integers(n)), place, x),
        lambda x: x + 0.2 * np.exp(-place / n * 20.0) * np.sin(place * random.uniform(0.01, 3.0)),
        lambda x: np.full(n, x[n // 2]),
        lambda x: np.repeat(x[::8], 8)[:n],
    )
    for _ in range(int(random.integers(4))):
        values = deeds[int(random.integers(len(deeds)))](values)
    step = 10.0 ** random.uniform(-5.0, -1.0)
    noise = random.normal(0.0, 10.0 ** random.uniform(-5.0, -1.0), n)
    return np.asarray(np.round((values + noise) / step) * step)


def step_response(random: Random) -> None:
    """Fit repeats of a current step."""
    n = _count(random, 60, 6000)
    since = np.maximum(np.arange(n) - int(n * random.uniform(0.0, 0.6)), 0) / (n * random.uniform(0.01, 0.6))
    time = np.arange(n) * 10.0 ** random.uniform(-7.0, -3.0)
    steps = [
        StepReading(time, spoiled(random, np.sign(since)), spoiled(random, -np.expm1(-since)))
        for _ in range(int(random.integers(1, 4)))
    ]
    fit_repeats(steps)


def back_emf(random: Random) -> None:
    """Fit one to three channels of a turning machine."""
    n = _count(random, 30, 8000)
    turned = np.arange(n) / n * 10.0 ** random.uniform(-0.5, 1.7)
    channels = [spoiled(random, np.sin(2.0 * np.pi * (turned + phase / 3.0))) for phase in range(random.integers(1, 4))]
    fit_back_emf(np.arange(n) * 1e-5, channels)


def ramps(random: Random) -> None:
    """Fit a driven ramp and a coast-down."""
    n = _count(random, 8, 800)
    time = np.arange(n) * 0.02
    top = 10.0 ** random.uniform(0.0, 3.0)
    rising, falling = spoiled(random, time / time[-1]), spoiled(random, np.exp(-3.0 * time / time[-1]))
    torque = 0.1 if random.uniform() < 0.5 else 0.1 * spoiled(random, np.ones(n))
    fit_ramps([SpeedRamp(time, top * rising, torque), SpeedRamp(time, top * falling)])


def coast_down(random: Random) -> None:
    """Fit a coast-down alone."""
    n = _count(random, 8, 2000)
    time = np.arange(n) * 0.01
    fit_coast_down(time, 100.0 * spoiled(random, np.exp(-3.0 * time / time[-1])))


def sweep(random: Random) -> None:
    """Fit inductances at known angles and over time."""
    n = _count(random, 4, 200)
    angle = 2.0 * np.pi * np.arange(n) / n
    values = 1e-3 * (2.0 + spoiled(random, np.cos(2.0 * random.integers(1, 5) * angle)))
    if random.uniform() < 0.5:
        fit_rotor_sweep(angle, values, pole_pairs=int(random.integers(1, 5)))
    else:
        fit_timed_sweep(angle, values)


def four_wire(random: Random) -> None:
    """Fit four-wire readings of both polarities."""
    n = _count(random, 4, 60)
    current = np.where(np.arange(n) % 2, -1.0, 1.0) * (1.0 + np.arange(n) // 2)
    slope(current * (1.0 + 0.1 * spoiled(random, np.ones(n))), current)


def cogging(random: Random) -> None:
    """Fit torque over two turns."""
    n = _count(random, 16, 3000)
    angle = 4.0 * np.pi * np.arange(n) / n
    fit_cogging(angle, 0.01 * spoiled(random, np.cos(12.0 * angle)))


ESTIMATORS: dict[str, Callable[[Random], None]] = {
    each.__name__: each for each in (step_response, back_emf, ramps, coast_down, sweep, four_wire, cogging)
}


def outcome(name: str, seed: int) -> str:
    """Run an estimator on one record; return whether it gave a figure. Raises whatever is no EstimationError, and TooSlowError."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            with in_time(LONGEST):
                ESTIMATORS[name](np.random.default_rng(seed))
        except EstimationError as refused:
            if not str(refused).strip():
                raise AssertionError(f"{name}, seed {seed}: refused without words") from refused
            return "refused"
    return "figure"


def _count(random: Random, least: int, most: int) -> int:
    return int(np.exp(random.uniform(np.log(least), np.log(most))))


def main() -> None:
    """Print, for each estimator, how many records gave a figure, and the slowest; every other end with its seed."""
    parser = argparse.ArgumentParser(prog="python -m tests.studies.wild_records", description=__doc__)
    parser.add_argument("--records", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--estimators", nargs="+", choices=list(ESTIMATORS), default=list(ESTIMATORS))
    given = parser.parse_args()
    for name in given.estimators:
        ends, slowest = Counter[str](), (0.0, 0)
        for number in range(given.records):
            seed, begun = given.seed * 1_000_000 + number, process_time()
            try:
                end = outcome(name, seed)
            except (Exception, TooSlowError) as fault:  # noqa: BLE001  it is printed, and the study goes on
                end = type(fault).__name__
                print(f"{name}, seed {seed}: {''.join(traceback.format_exception(fault, limit=-3))}", flush=True)
            ends[end] += 1
            slowest = max(slowest, (process_time() - begun, seed))
        print(f"{name}: {dict(ends)}; slowest {slowest[0]:.2f} s (seed {slowest[1]})", flush=True)


if __name__ == "__main__":
    main()
