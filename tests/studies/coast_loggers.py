"""Coast-downs as loggers write them: does the interval hold what is so, when a speed is a mean over the time between pulses, or the record
begins with the drive's start?

`python -m tests.studies.coast_loggers --records 30 --seed 7`
"""

import argparse
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.analysis.coast_down import analyze_coast_down
from bench.captures import CaptureError

FloatArray = NDArray[np.float64]
RPM = 30.0 / np.pi


@dataclass(frozen=True)
class Coast:
    """A shaft (kg·m², N·m, N·m·s) that slows down: angle (rad) and speed (rad/s) over time (s), to the end of its record."""

    inertia: float
    coulomb: float
    viscous: float
    time: FloatArray
    angle: FloatArray
    speed: FloatArray

    @classmethod
    def drawn(cls, random: np.random.Generator) -> "Coast":
        """Return one of a random motor, that ends before the shaft stands still."""
        inertia, top, tau = (
            10.0 ** random.uniform(-5.0, -3.3),
            random.uniform(150.0, 420.0),
            10.0 ** random.uniform(0.0, 1.3),
        )
        share = random.uniform(0.2, 0.8)
        coulomb, viscous = inertia * top / tau * share, inertia / tau * (1.0 - share)
        rate, level = viscous / inertia, coulomb / viscous
        time = np.linspace(0.0, np.log1p(top / level) / rate * random.uniform(0.8, 0.97), 200_001)
        away = (top + level) * np.exp(-rate * time)
        return cls(inertia, coulomb, viscous, time, (top + level - away) / rate - level * time, away - level)

    def when(self, angle: FloatArray) -> FloatArray:
        """Return when (s) the shaft passes angles (rad) within the record."""
        return np.interp(angle[angle <= self.angle[-1]], self.angle, self.time)


def pulse_a_turn(coast: Coast, _: np.random.Generator) -> Iterator[str]:
    """Give time and speed of each turn, at its end."""
    passed = coast.when(2.0 * np.pi * np.arange(1e6))
    return (f"{t:.6f},{n:.3f}" for t, n in zip(passed[1:], 2.0 * np.pi * RPM / np.diff(passed), strict=True))


def missing_tooth(teeth: int) -> Callable[[Coast, np.random.Generator], Iterator[str]]:
    """Return a logger of each of so many teeth a turn, one of which is missing, that takes every interval for one tooth's."""

    def rows(coast: Coast, random: np.random.Generator) -> Iterator[str]:
        number = np.arange(teeth * 100_000)
        passed = coast.when(2.0 * np.pi / teeth * number[number % teeth != random.integers(1, teeth)])
        return (
            f"{t:.6f},{n:.2f}" for t, n in zip(passed[1:], 2.0 * np.pi / teeth * RPM / np.diff(passed), strict=True)
        )

    return rows


def hall_edges(coast: Coast, random: np.random.Generator) -> Iterator[str]:
    """Give time and speed of each of 24 edges a turn, which are placed up to 3° (electrical, 4 pole pairs) off."""
    angle = 2.0 * np.pi / 24.0 * np.arange(1_000_002) + np.resize(
        np.radians(random.uniform(-3.0, 3.0, 6) / 4.0), 1_000_002
    )
    passed = coast.when(angle - angle[0])
    return (f"{t:.6f},{n:.1f}" for t, n in zip(passed[1:], 2.0 * np.pi / 24.0 * RPM / np.diff(passed), strict=True))


def counted(coast: Coast, random: np.random.Generator) -> Iterator[str]:
    """Give the teeth of 60 that passed within 0.1 s, as a speed, at the end of each 0.1 s."""
    time = np.arange(0.0, coast.time[-1], 0.1)
    teeth = np.floor(np.interp(time, coast.time, coast.angle) / (2.0 * np.pi) * 60.0 + random.uniform())
    return (f"{t:.1f},{n:.0f}" for t, n in zip(time[1:], np.diff(teeth) * 10.0, strict=True))


def whole_run(coast: Coast, random: np.random.Generator) -> Iterator[str]:
    """Give even rows of a run from standstill: the drive's voltage limits its rise, it holds or not, and lets go."""
    top = float(coast.speed[0])
    step = float(coast.time[-1]) / random.integers(800, 4000)
    rest = np.zeros(int(random.uniform(0.0, 400.0)))
    rise = float(coast.time[-1]) * random.uniform(0.05, 0.5)
    near = random.uniform(2.0, 5.0)
    start = top * -np.expm1(-near * np.arange(0.0, rise, step) / rise) / -np.expm1(-near)
    held = np.full(int(random.choice([0.0, random.uniform(20.0, 800.0)])), top)
    falls = np.interp(np.arange(0.0, coast.time[-1], step), coast.time, coast.speed)
    speed = np.concatenate((rest, start, held, falls)) * RPM
    speed = speed + random.normal(0.0, 1e-4 * top * RPM, speed.size)
    return (f"{k * step:.6f},{n:.2f}" for k, n in enumerate(speed))


LOGGERS: dict[str, Callable[[Coast, np.random.Generator], Iterator[str]]] = {
    "a pulse a turn": pulse_a_turn,
    "24 Hall edges a turn": hall_edges,
    "60 teeth, counted for 0.1 s": counted,
    "a whole run from standstill": whole_run,
    "24 teeth, one missing": missing_tooth(24),
    "60 teeth, one missing": missing_tooth(60),
}


def main() -> None:
    """Print a row for each logger."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=30)
    parser.add_argument("--seed", type=int, default=7)
    given = parser.parse_args()
    print("| logger | figure | given | held, % | beyond 3 U | median U, % | records told of |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "coast.csv"
        for name, rows in LOGGERS.items():
            figures: dict[str, list[tuple[float, float, float]]] = {"coulomb_friction": [], "viscous_friction": []}
            told = 0
            for number in range(given.records):
                random = np.random.default_rng([given.seed, number])
                coast = Coast.drawn(random)
                path.write_text("\n".join(("time (s),speed (rpm)", *rows(coast, random))))
                try:
                    found = analyze_coast_down(path, inertia=coast.inertia)
                except CaptureError as error:
                    print(f"record {number}: {error}")
                    continue
                told += bool(found["misfit"])
                for figure, truth in (("coulomb_friction", coast.coulomb), ("viscous_friction", coast.viscous)):
                    if figure in found["parameters"]:
                        low, high = (limit / truth for limit in found["parameters"][figure]["coverage_interval"])
                        figures[figure].append((found["parameters"][figure]["value"] / truth, low, high))
            for figure, values in figures.items():
                value, low, high = np.array(values).T
                half, held = 0.5 * (high - low), (low <= 1.0) & (high >= 1.0)
                print(
                    f"| {name} | {figure} | {value.size} of {given.records} | {100.0 * np.mean(held):.0f} "
                    f"| {np.sum(np.abs(value - 1.0) > 3.0 * half)} | {100.0 * np.median(half):.2f} | {told} |"
                )


if __name__ == "__main__":
    main()
