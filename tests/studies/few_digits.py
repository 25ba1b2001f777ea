"""Steps and back-EMF in a Rigol's file of few digits: does the interval hold what is so, when the file rounds the converter's steps?

`python -m tests.studies.few_digits --records 40 --seed 1`
"""

import argparse
import tempfile
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.analysis.back_emf import analyze_back_emf
from bench.analysis.step_response import analyze_step_response
from bench.captures import CaptureError

FloatArray = NDArray[np.float64]
READINGS = 6000
#: Digits of the file's numbers, of which the maker writes three.
DIGITS = (3, 6)


class FigureGiven(NamedTuple):
    """A figure with its 95 % interval and its truth (all in one unit)."""

    name: str
    value: float
    low: float
    high: float
    truth: float


def converted(values: FloatArray, random: np.random.Generator, noise: float) -> FloatArray:
    """Return what 8 bits make of values in a range that holds them, somewhere on the screen, with noise (steps)."""
    full_scale = float(np.ptp(values)) * random.uniform(1.15, 2.4)
    step, offset = full_scale / 256.0, random.uniform(0.0, 0.1) * full_scale
    read = values + random.normal(0.0, noise * step, values.size) + offset
    return np.asarray(np.round(read / step) * step - offset)


def write(path: Path, time: FloatArray, channels: Sequence[FloatArray], units: Sequence[str], digits: int) -> None:
    """Write a capture as a DS1000Z does, its numbers with so many digits."""
    names = ",".join(f"CH{k + 1}" for k in range(len(channels)))
    head = f"X,{names},Start,Increment,\nSequence,{','.join(units)},{time[0]:.6e},{time[1] - time[0]:.6e}\n"
    rows = (",".join(f"{value:.{digits - 1}e}" for value in row) for row in zip(*channels, strict=True))
    path.write_text(head + "".join(f"{k},{row},\n" for k, row in enumerate(rows)))


def step(path: Path, random: np.random.Generator, digits: int) -> list[FigureGiven]:
    """Return name, value, interval and truth of each figure of a step's record."""
    resistance, tau, voltage = 10.0 ** random.uniform((-1.0, -3.3, -0.3), (1.0, -2.0, 1.2))
    time = (np.arange(READINGS) - 800) * tau * 8.0 / 5200.0
    on = time > 0.0
    current = voltage / resistance * np.where(on, 1.0 - np.exp(-np.maximum(time, 0.0) / tau), 0.0)
    noise = 10.0 ** random.uniform(-0.6, 0.2)
    channels = [converted(each, random, noise) for each in (np.where(on, voltage, 0.0), current)]
    write(path, time, channels, ("Volt", "Ampere"), digits)
    found = analyze_step_response(path, reading="line")
    return _figures(found, {"loop_resistance": resistance, "loop_inductance": resistance * tau})


def back_emf(path: Path, random: np.random.Generator, digits: int) -> list[FigureGiven]:
    """Return name, value, interval and truth of the flux linkage of three line voltages with a fifth harmonic."""
    flux, frequency = 10.0 ** random.uniform((-3.0, 0.8), (-1.0, 2.3))
    time = np.arange(READINGS) / READINGS * random.uniform(3.0, 12.0) / frequency
    angle = 2.0 * np.pi * frequency * time + random.uniform(0.0, 2.0 * np.pi)
    noise = 10.0 ** random.uniform(-0.6, 0.2)
    channels = []
    for behind in 2.0 * np.pi / 3.0 * np.arange(3):
        wave = np.sin(angle - behind) + 0.03 * np.sin(5.0 * (angle - behind))
        channels.append(converted(np.sqrt(3.0) * 2.0 * np.pi * frequency * flux * wave, random, noise))
    write(path, time, channels, ("Volt",) * 3, digits)
    found = analyze_back_emf(path, connection="line", coupling={"": "dc"})
    return _figures(found, {"flux_linkage": flux})


def _figures(found: dict[str, Any], truths: dict[str, float]) -> list[FigureGiven]:
    given = [(name, found["parameters"][name], truth) for name, truth in truths.items() if name in found["parameters"]]
    return [FigureGiven(name, each["value"], *each["coverage_interval"], truth) for name, each, truth in given]


def main() -> None:
    """Print a row for each figure and number of digits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    print("| figure | digits | given | held, % | beyond 3 U | median U, % |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    records: tuple[Callable[[Path, np.random.Generator, int], list[FigureGiven]], ...]
    records = (step, back_emf)
    with tempfile.TemporaryDirectory() as folder:
        for record, digits in product(records, DIGITS):
            figures: list[FigureGiven] = []
            for number in range(given.records):
                try:
                    figures += record(Path(folder) / "record.csv", np.random.default_rng([given.seed, number]), digits)
                except CaptureError as error:
                    print(f"record {number}: {error}")
            for name in dict.fromkeys(figure.name for figure in figures):
                value, low, high, truth = np.array([figure[1:] for figure in figures if figure.name == name]).T
                half, held = 0.5 * (high - low), (low <= truth) & (truth <= high)
                print(
                    f"| {name} | {digits} | {value.size} of {given.records} | {100.0 * np.mean(held):.1f} "
                    f"| {np.sum(np.abs(value - truth) > 3.0 * half)} | {100.0 * np.median(half / truth):.2f} |"
                )


if __name__ == "__main__":
    main()
