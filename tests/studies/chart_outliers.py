"""`python -m tests.studies.chart_outliers`: how often a chart of an unchanged process signals when motors far off are left out.

Statistics tell by the test of normality whether a chart has limits for single points; motors far off are left out of that test
(`bulk`), for they are what a chart is for. Simulated as `line_statistics` does it: rows of neighbours decide, the last points are
charted. Printed for each process: how often the test rejects, with the filter and without, and how often the chart signals.
"""

import argparse

import numpy as np
from numpy.typing import NDArray

from bench.eol.line_statistics import NORMALITY_ALPHA
from bench.eol.statistics.control_chart import individuals_chart
from bench.eol.statistics.normality import anderson_darling, bulk
from bench.eol.statistics.proportion import proportion

Values = NDArray[np.float64]


def normal(random: np.random.Generator, count: int) -> Values:
    return random.normal(size=count)


def one_far_off(random: np.random.Generator, count: int) -> Values:
    """Normal; the motor in the middle lies 30 standard deviations away, among those charted none does."""
    values = random.normal(size=count)
    values[count // 2] = 30.0
    return values


def one_in_two_hundred(random: np.random.Generator, count: int) -> Values:
    """Normal, and one motor of 200 with a defect that moves it by 10 standard deviations."""
    return random.normal(size=count) + 10.0 * (random.random(count) < 0.005)


def log_normal(random: np.random.Generator, count: int) -> Values:
    return random.lognormal(0.0, 0.5, count)


def heavy_tails(random: np.random.Generator, count: int) -> Values:
    """Student's t of 4 degrees of freedom."""
    return random.standard_t(4.0, count)


PROCESSES = (normal, one_far_off, one_in_two_hundred, log_normal, heavy_tails)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--charts", type=int, default=1000)
    parser.add_argument("--motors", type=int, nargs="+", default=[300, 2000])
    parser.add_argument("--points", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    for motors in given.motors:
        for process in PROCESSES:
            random = np.random.default_rng(given.seed)
            plain = filtered = signals = 0
            for _ in range(given.charts):
                values = process(random, motors)
                plain += anderson_darling(values).rejected(NORMALITY_ALPHA)
                skewed = anderson_darling(bulk(values)).rejected(NORMALITY_ALPHA)
                filtered += skewed
                signals += bool(individuals_chart(values[-given.points :], normal=not skewed).signals)
            shares = [proportion(each, given.charts) for each in (plain, filtered, signals)]
            shown = "; ".join(
                f"{name} {100 * each.share:.1f} % ({100 * each.interval[0]:.1f} … {100 * each.interval[1]:.1f})"
                for name, each in zip(("all: not normal", "filtered: not normal", "chart signals"), shares, strict=True)
            )
            print(f"{motors:5} motors, {process.__name__}: {shown}", flush=True)


if __name__ == "__main__":
    main()
