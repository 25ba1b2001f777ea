"""How often the intervals of sweeps and of resistances hold the truth when the world is not as the model says.

`python -m tests.studies.sweep_misfit [--records N] [--seed S] [--workers N] [--rows NAME …]`

Magnitudes are log-uniform from negligible to gross. "Total" adds a meter's gain limit of 0.2 %, drawn for each record.
"""

import argparse
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, Fit
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.winding.closing import read_again, unsettled
from procedures.estimation.winding.resistance import slope
from procedures.estimation.winding.sweep.rotor_sweep import axis_inductances, fit_rotor_sweep
from procedures.estimation.winding.sweep.timed_sweep import fit_timed_sweep

LIMIT = 0.002
Random = np.random.Generator
ROWS = (
    "hand, steady", "hand ±20 %", "hand ±20 %, two regrips", "hand, maxima cut", "hand, noise after the cut",
    "known angle", "run-out", "meter drifts",
    "run-out, 0.6 turn", "four-wire", "thermal voltage drifts", "resistance drifts under load",
    "lines stay", "winding cools", "contacts differ", "one reading wrong",
)  # fmt: skip
WIRED = ("four-wire", "thermal voltage drifts", "resistance drifts under load", "one reading wrong")
LINES = ("lines stay", "winding cools", "contacts differ")


@dataclass
class Row:
    """Counts of one row: records, those given, figures held by total interval and by scatter, beyond 3 U, warned."""

    records: int = 0
    given: int = 0
    figures: int = 0
    held: int = 0
    scatter: int = 0
    beyond: int = 0
    warned: int = 0
    width: list[float] = field(default_factory=list)
    causes: Counter[str] = field(default_factory=Counter)


def log(random: Random, low: float, high: float) -> float:
    """Draw a magnitude from negligible to gross."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


@dataclass(frozen=True)
class Estimate:
    """A figure with its interval from the scatter, and its truth."""

    value: float
    low: float
    high: float
    truth: float


Estimates = tuple[Misfit, dict[str, Estimate]]


def of_fit(fit: Fit, truths: dict[str, float]) -> Estimates:
    """Return a fit's estimates."""
    return fit.misfit, {name: Estimate(fit.value(name), *fit.interval(name), truth) for name, truth in truths.items()}


def turned(name: str, random: Random) -> Estimates:
    """Sweep by hand over two electrical turns of 80 readings each."""
    n = 160
    at = np.arange(n) / n
    wavering = 0.0 if name.endswith("steady") else 0.2
    speed = 1.0 + wavering * np.sin(2 * np.pi * (random.uniform(0.5, 2.0) * at + random.uniform()))
    if name.endswith("regrips"):
        for place in random.uniform(0.1, 0.9, 2):
            speed[(at > place) & (at < place + random.uniform(0.03, 0.08))] = 0.0
        if random.random() < 0.3:
            place = random.uniform(0.1, 0.9)
            speed[(at > place) & (at < place + 0.03)] = -0.5
    course = np.cumsum(speed)
    course = course * 8 * np.pi / course[-1] + random.uniform(0, 7)
    amplitude, noise = log(random, 0.005, 0.4), log(random, 2e-4, 5e-3)
    true, scatter = 1.0 - amplitude * np.cos(course), random.normal(0, noise, n)
    readings = true + scatter
    if name.endswith("cut"):
        # A bridge held in a range that ends below the maxima.
        end = 1.0 + amplitude * (1.0 - log(random, 0.01, 1.0))
        readings = np.minimum(true, end) + scatter if "after" in name else np.minimum(readings, end)
    return axes(fit_timed_sweep(20 * at, readings), amplitude)


def angled(name: str, random: Random) -> Estimates:
    """Readings at known mechanical angles, closed by the first one."""
    angle = np.linspace(0, 2 * np.pi * (0.6 if "0.6" in name else 1.0), int(random.integers(36, 90)))
    pairs, amplitude, noise = int(random.integers(2, 8)), log(random, 0.03, 0.3), log(random, 3e-4, 5e-3)
    readings = 1.0 - amplitude * np.cos(2 * pairs * angle + 1.0) + random.normal(0, noise, angle.size)
    size = log(random, 3e-4, 0.1)
    if name.startswith("run-out"):
        readings += size * np.cos(angle + random.uniform(0, 6)) + 0.3 * size * np.cos(2 * angle + random.uniform(0, 6))
    if name == "meter drifts":
        readings *= 1.0 + size * np.linspace(0.0, 1.0, angle.size) - 0.5 * size
    return axes(fit_rotor_sweep(angle, readings, pole_pairs=pairs), amplitude)


def axes(fit: Fit, amplitude: float) -> Estimates:
    """Return both axes and their truths."""
    truths = {"d_axis_inductance": 1.0 - amplitude, "q_axis_inductance": 1.0 + amplitude}
    return of_fit(axis_inductances(fit), truths)


def wired(name: str, random: Random) -> Estimates:
    """Ten four-wire readings: four levels and the first again, both polarities."""
    levels = np.array([1.0, 0.75, 0.5, 0.25, 1.0])
    current = np.concatenate((levels, -levels))
    risen = log(random, 1e-5, 0.05) * (1.0 - np.exp(-np.arange(10) / random.uniform(2, 20)))
    voltage = current + 1e-3 + random.normal(0, log(random, 1e-5, 1e-3), 10)
    if name.startswith("thermal"):
        voltage = voltage + risen
    if name.startswith("resistance"):
        voltage = voltage + risen * current
    if name == "one reading wrong":
        voltage[random.integers(10)] *= 1.0 + random.choice((-1.0, 1.0)) * log(random, 1e-4, 0.9)
    return of_fit(slope(voltage, current), {"resistance": 1.0})


def lines(name: str, random: Random) -> Estimates:
    """Three readings of three lines by a bridge, and each again 51 s later where the first has changed."""
    noise, at = log(random, 3e-6, 1e-4), np.array([0.0, 17.0, 34.0, 51.0, 68.0, 85.0])
    factors = np.ones(6)
    if name == "winding cools":
        factors = 1.0 + 0.0039 * log(random, 0.05, 70.0) * np.exp(-at / log(random, 300.0, 2000.0))
    if name == "contacts differ":
        factors = 1.0 + log(random, 1e-4, 0.1) * np.exp(0.5 * random.standard_normal(6))
    read = [factor * (1.0 + noise * random.standard_normal(3)) for factor in factors]
    again = [
        read_again(read[k], read[k + 3], [read[j] for j in range(3) if j != k], seconds=51.0, coarseness=1e-6)
        for k in range(3)
    ]
    found = unsettled(again if again[0].unexplained else again[:1], "resistance")
    value = float(np.mean(read[:3]))
    # Of the winding's temperature ±1 K is stated.
    value *= 1.0 + 0.0039 * random.uniform(-1.0, 1.0)
    scatter = float(np.hypot(2.0 * noise / 3.0, 2.0 * 0.0039 / np.sqrt(3.0)))
    return found.misfit, {"resistance": Estimate(value, value - scatter - found.excess * value, value + scatter, 1.0)}


def recorded(name: str, random: Random) -> Estimates:
    """Draw one record of a row, and return what is estimated from it."""
    way = turned if name.startswith("hand") else lines if name in LINES else wired if name in WIRED else angled
    return way(name, random)


Recorded = Callable[[str, Random], Estimates]


def take(row: Row, name: str, random: Random, way: Recorded) -> None:
    """Take one record into account."""
    row.records += 1
    gain = 1.0 + random.uniform(-LIMIT, LIMIT)
    try:
        misfit, estimates = way(name, random)
    except EstimationError:
        return
    row.warned += bool(misfit)
    row.causes.update({f.cause.value for f in misfit.findings})
    if any(misfit.withholding(each) for each in estimates):
        return
    row.given += 1
    for one in estimates.values():
        half, middle = 0.5 * (one.high - one.low), 0.5 * (one.high + one.low)
        total = float(np.hypot(half, 2.0 * LIMIT / np.sqrt(3.0) * one.value))
        off = abs(gain * middle - one.truth)
        row.figures += 1
        row.held += off <= total
        row.scatter += abs(middle - one.truth) <= half
        row.beyond += off > 3.0 * total
        row.width.append(total / one.truth)


def row_of(records: int, seed: int, rows: Sequence[str], way: Recorded, number: int) -> Row:
    """Return a row of so many records."""
    random, row = np.random.default_rng([seed, number]), Row()
    for _ in range(records):
        take(row, rows[number], random, way)
    return row


def line_of(name: str, row: Row) -> str:
    """Return a row of the table."""
    causes = ", ".join(f"{c} {n / row.records:.1%}" for c, n in row.causes.most_common())
    if not row.figures:
        return f"| {name} | – | – | 0 | – | {row.warned / row.records:.1%} | 100.0% | {causes} |"
    return (
        f"| {name} | {row.held / row.figures:.1%} | {row.scatter / row.figures:.1%} | {row.beyond} | "
        f"{np.median(row.width):.2%} | {row.warned / row.records:.1%} | {1 - row.given / row.records:.1%} | {causes} |"
    )


def tell(description: str | None, rows: Sequence[str], way: Recorded) -> None:
    """Print the table of a study whose records `way` draws, by the options of the command line."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--records", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1, help="processes of this machine")
    parser.add_argument("--rows", nargs="*", choices=rows, default=rows, metavar="NAME")
    given = parser.parse_args()
    numbers = [rows.index(name) for name in given.rows]
    print("| record | held, total | held, scatter | beyond 3 U | median U | warned | not given | named |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |")
    with ProcessPoolExecutor(given.workers) as pool:
        made = pool.map(partial(row_of, given.records, given.seed, rows, way), numbers)
        for name, row in zip(given.rows, made, strict=True):
            print(line_of(name, row), flush=True)


if __name__ == "__main__":
    tell(__doc__, ROWS, recorded)
