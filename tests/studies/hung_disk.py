"""How soon all is off while the disk of a run's record does not answer: `python -m tests.studies.hung_disk --rounds 3`, as root.

A file system of its own, on a loop device, is frozen once everything is energised: whoever writes to it from then on waits until
the study thaws it. Then the run gets on no more by itself, is interrupted, or is killed.
"""

import argparse
import os
import signal
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.studies.energised.held import Run, Served

_SIZE = 64 << 20
#: A run gets on no more when it has not for this time (s).
_STALLED = 8.0
_THEN: dict[str, tuple[tuple[str, ...], Callable[[Run], None]]] = {
    f"the run gets on no more (stalled = {_STALLED:g} s)": (("lose", "supply"), lambda _: None),
    "Ctrl-C": (("wait",), lambda run: run.signal(signal.SIGINT)),
    "Ctrl-C while it writes": (("lose", "supply"), lambda run: run.signal(signal.SIGINT)),
    "kill -9 while it writes": (("lose", "supply"), lambda run: run.signal(signal.SIGKILL)),
}


def main() -> None:
    """Freeze, end and measure."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--rounds", type=int, default=3)
    rounds = asked.parse_args().rounds
    if os.geteuid():
        sys.exit("a file system is mounted and frozen: run it as root")
    with tempfile.TemporaryDirectory() as folder, _mounted(Path(folder)) as disk:
        served = Served(Path(folder))
        try:
            impatient = Path(folder) / "impatient.toml"
            impatient.write_text(
                f"{served.station.read_text(encoding='utf-8')}\n[guardian]\nstalled = {_STALLED}\n", encoding="utf-8"
            )
            for number, (words, (then, end)) in enumerate(_THEN.items()):
                seconds = [
                    _once(served, disk, disk / f"runs{number}-{one}", impatient, then, end) for one in range(rounds)
                ]
                print(
                    f"{words}: off after {statistics.median(seconds):.2f} s, longest {max(seconds):.2f} s", flush=True
                )
        finally:
            served.end()


def _once(
    served: Served, disk: Path, runs: Path, station: Path, then: tuple[str, ...], end: Callable[[Run], None]
) -> float:
    runs.mkdir()
    run = Run(served, runs, *then, station=station)
    try:
        if then[0] == "lose":
            assert run.process.stdout.readline() == "measuring\n"
        with _frozen(disk):
            end(run)
            off = served.seconds_until_off()
        run.process.join(60.0)
        took = [event.data["cause"] for event in run.guardian_left() if event.kind == "took"]
        assert took, "the guardian's record does not say what it did"
    finally:
        run.drop()
    return off


@contextmanager
def _mounted(folder: Path) -> Iterator[Path]:
    image, place = folder / "disk", folder / "mounted"
    with image.open("wb") as file:
        file.truncate(_SIZE)
    place.mkdir()
    _call("mkfs.ext4", "-q", str(image))
    _call("mount", "-o", "loop", str(image), str(place))
    try:
        yield place
    finally:
        _call("umount", str(place))


@contextmanager
def _frozen(disk: Path) -> Iterator[None]:
    _call("fsfreeze", "--freeze", str(disk))
    try:
        yield
    finally:
        _call("fsfreeze", "--unfreeze", str(disk))


def _call(*words: str) -> None:
    subprocess.run(words, check=True)


if __name__ == "__main__":
    main()
