"""Back-EMF of a motor that runs down, or that a hand-held drill turns: is a figure given, and does its interval hold what is so?

`python -m tests.studies.drifting_emf --records 24 --seed 9`
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.analysis.back_emf import analyze_back_emf
from bench.captures import CaptureError

FloatArray = NDArray[np.float64]
SPEEDS = (
    "steady",
    "drifting by up to ±30 %",
    "running down to 22 … 82 %",
    "drifting, with a ripple of 0.2 … 5 %",
    "swinging by 0.1 … 5 %, 0.4 … 6 times",
)


def course(kind: str, place: FloatArray, turning: FloatArray, random: np.random.Generator) -> FloatArray:
    """Return the speed over its first at places 0 … 1 of a record; `turning` is the shaft's angle (rad) there at a steady speed."""
    result = np.ones(place.size)
    if kind.startswith("drifting"):
        result = result * (1.0 + random.uniform(-0.3, 0.3) * place)
    if kind.startswith("running"):
        result = result * np.exp(-place * random.uniform(0.2, 1.5))
    if kind.startswith("swinging"):
        swing, times, begin = random.uniform(0.001, 0.05), random.uniform(0.4, 6.0), random.uniform(0.0, 6.3)
        result = result * (1.0 + swing * np.sin(2.0 * np.pi * times * place + begin))
    if "ripple" in kind:
        result = result * (
            1.0
            + random.uniform(0.002, 0.05) * np.sin(random.choice([1.0, 2.0, 3.7]) * turning + random.uniform(0.0, 6.3))
        )
    return np.asarray(result)


def record(kind: str, random: np.random.Generator) -> tuple[FloatArray, list[FloatArray], str, float] | None:
    """Return time (s), three voltages by 8 bits, where their probes are, and the flux linkage (V·s/rad); None for less than 2.2 periods."""
    pairs, flux = int(random.choice([2, 3, 4, 5, 7, 10])), 10.0 ** random.uniform(-2.7, -0.8)
    first, rate, number = (
        random.uniform(30.0, 260.0),
        10.0 ** random.uniform(4.0, 5.0),
        int(random.uniform(4000, 40000)),
    )
    time = np.arange(number) / rate
    speed = pairs * first * course(kind, time / time[-1], first * time, random)
    angle = np.cumsum(speed) / rate + random.uniform(0.0, 2.0 * np.pi)
    if angle[-1] - angle[0] < 2.2 * 2.0 * np.pi:
        return None
    sizes, late = random.uniform(0.0, [0.1, 0.06, 0.04]), random.uniform(0.0, 6.3, 3)

    def phase(behind: float) -> FloatArray:
        own = angle - behind
        harmonics = sum(h * np.sin(k * own + p) for h, k, p in zip(sizes, (3, 5, 7), late, strict=True))
        return np.asarray(speed * flux * (np.sin(own) + harmonics))

    phases = [phase(2.0 * np.pi / 3.0 * k) for k in range(3)]
    where = str(random.choice(["line", "phase"]))
    waves = [a - b for a, b in zip(phases, phases[1:] + phases[:1], strict=True)]
    waves = waves if where == "line" else [each - sum(phases) / 3.0 for each in phases]
    read = []
    for wave in waves:
        step = float(np.ptp(wave)) * random.uniform(1.1, 2.0) / 256.0
        read.append(np.round(wave / step + random.normal(0.0, random.uniform(0.3, 1.5), number)) * step)
    return time, read, where, flux


def main() -> None:
    """Print a row for each course of the speed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=24)
    parser.add_argument("--seed", type=int, default=9)
    given = parser.parse_args()
    print("| speed | records | refused | withheld | held, % | beyond 3 U | median U, % |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "emf.csv"
        for kind in SPEEDS:
            figures: list[tuple[float, float, float]] = []
            count = refused = 0
            for number in range(given.records):
                made = record(kind, np.random.default_rng([given.seed, number]))
                if made is None:
                    continue
                time, read, where, flux = made
                table = np.column_stack((time, *read))
                np.savetxt(path, table, delimiter=",", fmt="%.7g", header="time (s),U (V),V (V),W (V)", comments="")
                count += 1
                try:
                    found = analyze_back_emf(path, connection=where, coupling={"": "dc"})["parameters"]  # type: ignore[arg-type]
                except CaptureError:
                    refused += 1
                    continue
                if "flux_linkage" in found:
                    low, high = found["flux_linkage"]["coverage_interval"]
                    figures.append((found["flux_linkage"]["value"] / flux, low / flux, high / flux))
            value, low, high = np.array(figures).T
            half, held = 0.5 * (high - low), (low <= 1.0) & (high >= 1.0)
            print(
                f"| {kind} | {count} | {refused} | {count - refused - value.size} | {100.0 * np.mean(held):.0f} "
                f"| {np.sum(np.abs(value - 1.0) > 3.0 * half)} | {100.0 * np.median(half):.3f} |"
            )


if __name__ == "__main__":
    main()
