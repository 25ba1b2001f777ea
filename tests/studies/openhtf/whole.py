"""`python -m tests.studies.openhtf.whole`: motors a second through the whole of three frameworks, durable in each, in turns.

OpenHTF and HardPy are installed into an environment of their own (`--environment`), made where there is none. Between the first
motor's record and the last one's; what starting and ending a batch costs is not counted. Processor time is that of the framework's
processes that have ended and were waited for.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.studies.openhtf.__main__ import HERE, ROOT, VERSION, acknowledged

HARDPY = "0.25.2"
WHICH = ("OpenHTF", "HardPy", "motorbench")


def environment(folder: Path) -> Path:
    """Return the Python that has both, installed now where they are not there."""
    python = folder / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        wanted = (f"openhtf=={VERSION}", f"hardpy=={HARDPY}")
        subprocess.run([str(python), "-m", "pip", "install", "-q", *wanted], check=True)
    return python


def rate(which: str, python: Path, motors: int, measurements: int) -> tuple[float, float]:
    """Return motors a second, and processor time (s) a motor of everything that took part."""
    with tempfile.TemporaryDirectory() as folder:
        command = {
            "OpenHTF": [str(python), str(HERE / "whole_theirs.py")],
            "HardPy": [str(python), str(HERE / "whole_hardpy.py")],
            "motorbench": [sys.executable, "-m", "tests.studies.openhtf.whole_ours"],
        }[which]
        before = os.times()
        with subprocess.Popen(
            [*command, folder, str(motors), str(measurements)],
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        ) as process:
            assert process.stdout is not None
            serials = acknowledged(process.stdout)
            next(serials)
            began, count, took = time.perf_counter(), 0, 0.0
            for _ in serials:
                count, took = count + 1, time.perf_counter() - began
        after = os.times()
    if count != motors - 1 or process.returncode != 0:
        raise SystemExit(f"{which} ended with {process.returncode} after {count + 1} motors")
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    return count / took, spent


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motors", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--measurements", type=int, nargs="+", default=[5, 30])
    parser.add_argument("--frameworks", nargs="+", choices=WHICH, default=WHICH)
    parser.add_argument("--environment", type=Path, default=Path(tempfile.gettempdir()) / "motorbench-frameworks")
    given = parser.parse_args()
    python = environment(given.environment)
    for measurements in given.measurements:
        rates: dict[str, list[float]] = {which: [] for which in given.frameworks}
        times: dict[str, list[float]] = {which: [] for which in given.frameworks}
        # In turn, so that a busy machine is busy for all.
        for _ in range(given.rounds):
            for which in given.frameworks:
                # Of a short batch and a longer one the difference: starting and ending fall out.
                _, spent_few = rate(which, python, 2, measurements)
                rated, spent = rate(which, python, given.motors, measurements)
                rates[which].append(rated)
                times[which].append((spent - spent_few) / (given.motors - 2))
                print(f"{measurements:3} values, {which}: {rated:.2f} motors/s", flush=True)
        for which in given.frameworks:
            shown = ", ".join(f"{each:.2f}" for each in rates[which])
            print(
                f"{measurements:3} values, {which:10} {shown} motors/s; {1e3 * statistics.median(times[which]):.0f} ms processor a motor"
            )
        for which in [each for each in given.frameworks if each != "motorbench"]:
            ratios = sorted(ours / theirs for ours, theirs in zip(rates["motorbench"], rates[which], strict=True))
            print(
                f"{measurements:3} values, motorbench / {which}: {', '.join(f'{each:.2f}' for each in ratios)}",
                flush=True,
            )


if __name__ == "__main__":
    main()
