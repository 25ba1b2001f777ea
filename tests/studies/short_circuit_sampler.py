"""Whether another sampler finds the same intervals for short circuits: dynesty's nested sampling, on the same posterior.

uv run --with dynesty python -m tests.studies.short_circuit_sampler [--tables 10] [--seed 1] [--torques no yes] [--live 400]

Source: Speagle, "dynesty: a dynamic nested sampling package for estimating Bayesian posteriors and evidences", MNRAS 493 (2020).
"""

import argparse
import time
from typing import Any

import numpy as np
from scipy.special import ndtri

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.population import sampled
from procedures.estimation.flux.short_currents import ShortPosterior, ShortRows
from tests.studies.worlds.short_circuit_worlds import constants

ROWS, NOISE, FLOOR = 9, 2e-3, 1e-4
FIGURES = ("limit", "q_axis", "resistance")


def rows_of(seed: int, index: int, torques: bool) -> ShortRows:
    """Return a table by formula of a random motor, with scattered readings."""
    random = np.random.default_rng([seed, index])
    motor = constants(random)
    speed = motor.speeds(ROWS)
    none = np.zeros(ROWS)
    current, heat, _ = motor.turned(speed, 1.0 + none, 1.0 - none, 0.0)
    scatter = 1.0 + NOISE * random.standard_normal((2, ROWS))
    power = heat * scatter[1] / 1.5 if torques else None
    return ShortRows(speed, current * scatter[0], motor.flux, power, friction=torques)


def quantiles(model: ShortPosterior, values: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """Return ends and middle of the 95 % interval (figures, 3) of samples (m, n)."""
    known = model.named(values)
    figures = (known["limit"], known["saliency"] - known["limit"], known["resistance"])
    shares = [0.025, 0.5, 0.975]
    if weight is None:
        return np.array([np.quantile(each, shares) for each in figures])
    result = []
    for each in figures:
        order = np.argsort(each)
        result.append(np.interp(shares, np.cumsum(weight[order]) / np.sum(weight), each[order]))
    return np.array(result)


def nested(model: ShortPosterior, live: int, random: np.random.Generator) -> FloatArray:
    """Return the quantiles that dynesty finds."""
    # Not a dependency: the command names it.
    import dynesty

    box = model.low.size

    def value(unit: FloatArray) -> FloatArray:
        flat = model.low[:, 0] + (model.high - model.low)[:, 0] * unit[:box]
        return np.concatenate((flat, model.centre[:, 0] + model.spread[:, 0] * ndtri(unit[box:])))

    def likely(values: FloatArray) -> float:
        return float(model.likelihood(values[:, None])[0])

    sampler: Any = dynesty.NestedSampler(
        likely, value, box + model.centre.size, nlive=live, sample="rwalk", rstate=random
    )
    sampler.run_nested(print_progress=False, dlogz=0.01)
    found = sampler.results
    return quantiles(model, found.samples.T, found.importance_weights())


def main() -> None:
    """Sample and print how far ends and middles lie from the other's, in halves of the other's interval."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tables", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--torques", nargs="*", default=["no", "yes"], choices=["no", "yes"])
    parser.add_argument("--live", type=int, default=400)
    given = parser.parse_args()
    print("| torques | figure | low end | middle | high end | width, ours / theirs | seconds, ours | theirs |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for torques in given.torques:
        away, widths, times = [], [], np.zeros(2)
        for index in range(given.tables):
            model = ShortPosterior(rows_of(given.seed, index, torques == "yes"), FLOOR)
            random = np.random.default_rng([given.seed, index, 1])
            begun = time.process_time()
            ours = quantiles(model, sampled(model.drawn(random), model.prior, model.likelihood, random))
            between = time.process_time()
            theirs = nested(model, given.live, random)
            times += (between - begun, time.process_time() - between)
            half = 0.5 * (theirs[:, 2] - theirs[:, 0])[:, None]
            away.append(np.abs(ours - theirs) / half)
            widths.append(0.5 * (ours[:, 2] - ours[:, 0]) / half[:, 0])
        for place, figure in enumerate(FIGURES):
            ends = np.median(np.array(away)[:, place], axis=0)
            most = np.max(np.array(away)[:, place], axis=0)
            apart = " | ".join(f"{middle:.2f}, at most {worst:.2f}" for middle, worst in zip(ends, most, strict=True))
            wide = np.median(np.array(widths)[:, place])
            print(
                f"| {torques} | {figure} | {apart} | {wide:.2f} | {times[0] / given.tables:.2g} | {times[1] / given.tables:.2g} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
