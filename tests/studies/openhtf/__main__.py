"""`python -m tests.studies.openhtf`: motors a second of both, and what each has after kill -9 at random moments.

OpenHTF is installed into an environment of its own (`--environment`), made where there is none.
"""

import argparse
import json
import os
import random
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from bench.eol.store.database import open_database
from bench.eol.store.records import Records

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
VERSION = "1.6.3"


def environment(folder: Path) -> Path:
    """Return the Python that has OpenHTF, installed now where it is not there."""
    python = folder / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        subprocess.run([str(python), "-m", "pip", "install", "-q", f"openhtf=={VERSION}"], check=True)
    return python


def writer(which: str, python: Path, folder: Path, motors: int) -> subprocess.Popen[str]:
    command = (
        [str(python), str(HERE / "theirs.py")]
        if which == "OpenHTF"
        else [sys.executable, "-m", "tests.studies.openhtf.ours"]
    )
    return subprocess.Popen(
        [*command, str(folder), str(motors)],
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )


def acknowledged(lines: Iterable[str]) -> Iterator[str]:
    """Give the serial numbers that a writer prints whole, among whatever else it prints."""
    for line in lines:
        if re.fullmatch(r"P-\d{7}\n", line):
            yield line.strip()


def rate(which: str, python: Path, motors: int) -> float:
    """Return motors a second, from the first one's end to the last one's: what starting and ending cost is not counted."""
    with tempfile.TemporaryDirectory() as folder, writer(which, python, Path(folder), motors) as process:
        assert process.stdout is not None
        serials = acknowledged(process.stdout)
        next(serials)
        began = time.perf_counter()
        count, took = 0, 0.0
        for _ in serials:
            # What ending costs is no motor's either.
            count, took = count + 1, time.perf_counter() - began
    if count != motors - 1 or process.returncode != 0:
        raise SystemExit(f"{which} ended with {process.returncode} after {count + 1} motors")
    return count / took


def killed(which: str, python: Path, after: float) -> tuple[int, int, int]:
    """Kill a writer so long (s) after its first motor; return how many it acknowledged, of these whole records found, torn files."""
    with tempfile.TemporaryDirectory() as name, writer(which, python, Path(name), 0) as process:
        assert process.stdout is not None
        serials = acknowledged(process.stdout)
        told = [next(serials)]
        time_out = time.perf_counter() + after
        while time.perf_counter() < time_out:
            told.append(next(serials))
        process.send_signal(signal.SIGKILL)
        told += serials
        process.wait()
        found, torn = whole_records(which, Path(name))
    return len(told), len(set(told) & found), torn


def whole_records(which: str, folder: Path) -> tuple[set[str], int]:
    if which != "OpenHTF":
        engine = open_database(str(folder / "records.sqlite"))
        kept = {each.serial_number for each in Records(engine).read() if len(each.measured) == 30}
        torn = Records(engine).count() - len(kept)
        engine.dispose()
        return kept, torn
    found, torn = set(), 0
    for path in folder.iterdir():
        try:
            told = json.loads(path.read_bytes())
            found |= {told["dut_id"]} if len(told["phases"][-1]["measurements"]) == 30 else set()
        except (ValueError, KeyError, IndexError):
            torn += 1
    return found, torn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motors", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--environment", type=Path, default=Path(tempfile.gettempdir()) / f"openhtf-{VERSION}")
    given = parser.parse_args()
    python = environment(given.environment)
    both = ("OpenHTF", "motorbench")
    # In turn, so that a busy machine is busy for both.
    rates = [{which: rate(which, python, given.motors) for which in both} for _ in range(given.rounds)]
    for which in both:
        print(f"{which:11} {', '.join(f'{each[which]:.0f}' for each in rates)} motors/s")
    ratios = sorted(each["motorbench"] / each["OpenHTF"] for each in rates)
    print(f"ratio       {', '.join(f'{ratio:.1f}' for ratio in ratios)}, median {statistics.median(ratios):.1f}")
    moments = random.Random(1)  # noqa: S311  no secret
    afters = [moments.uniform(0.05, 1.0) for _ in range(given.kills)]
    for which in both:
        if not afters:
            break
        sums = [sum(column) for column in zip(*(killed(which, python, after) for after in afters), strict=True)]
        print(f"{which:11} {given.kills} kills: {sums[0]} acknowledged, {sums[1]} of them found whole, {sums[2]} torn")


if __name__ == "__main__":
    main()
