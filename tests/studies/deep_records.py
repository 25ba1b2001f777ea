"""Records of an oscilloscope's whole memory: how long `motorbench analyze` takes, and how much memory.

`python -m tests.studies.deep_records --rows 1000000`: each command in a process of its own, on a file that is drawn here. The step has
hum and a flat top, the coast-down a ripple, so that causes are looked for.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

#: Most rows of a torque or an inductance over the angle.
_ANGLES = 100_000


def step(rows: int, random: np.random.Generator) -> tuple[str, np.ndarray]:
    """A winding of 0.5 Ω and 3 ms."""
    time = np.linspace(0.0, 0.1, rows)
    risen = np.where(time > 0.01, -np.expm1(-np.maximum(time - 0.01, 0.0) / 3e-3), 0.0)
    current = np.minimum(4.0 * risen + 0.05 * np.sin(100.0 * np.pi * time), 3.9) + random.normal(0.0, 0.01, rows)
    voltage = 2.0 * (time > 0.01) + random.normal(0.0, 0.002, rows)
    return "time (s),voltage (V),current (A)", np.column_stack((time, voltage, current))


def coast(rows: int, _: np.random.Generator) -> tuple[str, np.ndarray]:
    """A shaft that runs out with a ripple once a turn."""
    time = np.linspace(0.0, 20.0, rows)
    speed = np.maximum(320.0 * np.exp(-time / 12.0) - 20.0, 0.0)
    speed = speed * (1.0 + 0.01 * np.sin(np.cumsum(speed) * (time[1] - time[0])))
    return "time (s),speed (rpm)", np.column_stack((time, np.round(speed * 30.0 / np.pi)))


def emf(rows: int, random: np.random.Generator) -> tuple[str, np.ndarray]:
    """Three lines at 120 Hz."""
    time = np.linspace(0.0, 0.2, rows)
    lines = [9.0 * np.cos(240.0 * np.pi * time - k * 2.0 * np.pi / 3.0) for k in range(3)]
    read = np.round(10.0 * (np.array(lines) + random.normal(0.0, 0.02, (3, rows)))) / 10.0
    return "time (s),CH1 (V),CH2 (V),CH3 (V)", np.column_stack((time, *read))


def cogging(rows: int, random: np.random.Generator) -> tuple[str, np.ndarray]:
    """Two turns of 24 periods."""
    angle = np.linspace(0.0, 720.0, min(rows, _ANGLES))
    torque = 0.1 + 0.02 * np.sin(np.radians(24.0 * angle)) + random.normal(0.0, 0.001, angle.size)
    return "angle (deg),torque (Nm)", np.column_stack((angle, torque))


def sweep(rows: int, random: np.random.Generator) -> tuple[str, np.ndarray]:
    """A turn of a rotor of four pole pairs."""
    angle = np.linspace(0.0, 360.0, min(rows, _ANGLES))
    inductance = 1.0 + 0.2 * np.cos(np.radians(8.0 * angle)) + random.normal(0.0, 0.001, angle.size)
    return "angle (deg),L (mH)", np.column_stack((angle, inductance))


RECORDS: Mapping[str, tuple[Callable[[int, np.random.Generator], tuple[str, np.ndarray]], tuple[str, ...]]] = {
    "step-response": (step, ()),
    "coast-down": (coast, ("--inertia", "0.0012")),
    "back-emf": (emf, ("--pole-pairs", "4", "--connection", "line")),
    "cogging": (cogging, ("--pole-pairs", "4")),
    "rotor-sweep": (sweep, ("--pole-pairs", "4")),
}


def _measured(command: str, file: Path, options: tuple[str, ...]) -> tuple[float, float]:
    """Return processor time (s) and peak memory (MiB) of a command in a process of its own."""
    code = (
        "import resource, sys\nfrom bench.cli.main import main\n"
        "try:\n    main()\nexcept SystemExit:\n    ...\n"
        "used = resource.getrusage(resource.RUSAGE_SELF)\n"
        "print(used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "analyze", command, str(file), *options],
        capture_output=True,
        text=True,
        check=True,
    )
    seconds, size = map(float, done.stderr.split()[-2:])
    return seconds, size


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=RECORDS, nargs="*", default=list(RECORDS))
    given = parser.parse_args()
    print("| command | rows | processor time, s | memory, MiB |\n| --- | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as folder:
        for name in given.only:
            draw, options = RECORDS[name]
            heading, table = draw(given.rows, np.random.default_rng(given.seed))
            file = Path(folder) / f"{name}.csv"
            np.savetxt(file, table, fmt="%.8g", delimiter=",", header=heading, comments="")
            seconds, size = _measured(name, file, options)
            print(f"| `analyze {name}` | {len(table)} | {seconds:.1f} | {size:.0f} |", flush=True)


if __name__ == "__main__":
    main()
