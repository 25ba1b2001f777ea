"""What a killed unit leaves of a run and its guardian, by a real systemd: `python -m tests.studies.scope --rounds 3`, as root.

A user manager is started in a mount namespace of its own, with a served bench beside it. A run that has everything energised is a service
of it; the whole service is then killed at once, as an out-of-memory kill of its group would. With a scope of its own the guardian
switches off; without, only watchdogs do, and the supply, which has none, stays on.
"""

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path

from pyvisa import ResourceManager

from bench.journal.guardian_record import read_guardian
from tests.studies.energised.held import PATIENCE, Served, quiet
from tests.studies.energised.held_run import hold

SYSTEMD = "/lib/systemd/systemd"
RUNTIME = Path("/run/user/0")


def main() -> None:
    """Enter the namespace, then measure with a scope and without one."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--rounds", type=int, default=3)
    asked.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    asked.add_argument("--hold", nargs=2, metavar=("STATION", "RUNS"), help=argparse.SUPPRESS)
    given = asked.parse_args()
    if given.hold:
        station, runs = given.hold
        hold(station, Path(runs), ("wait",))
    elif given.inside:
        _measure(given.rounds)
    else:
        unshare = shutil.which("unshare")
        if unshare is None or not Path(SYSTEMD).exists():
            sys.exit("unshare and systemd are needed")
        words = (sys.executable, "-m", "tests.studies.scope", "--inside", "--rounds", str(given.rounds))
        os.execv(unshare, [unshare, "--mount", "--propagation", "private", *words])  # noqa: S606  this study itself


def _measure(rounds: int) -> None:
    with tempfile.TemporaryDirectory() as folder, _manager(Path(folder)) as environment:
        served = Served(Path(folder))
        try:
            for scope in (True, False):
                seen = [
                    _killed(served, Path(folder) / f"{scope}{number}", environment, scope) for number in range(rounds)
                ]
                off = [seconds for seconds in seen if seconds is not None]
                found = f"off after {statistics.median(off):.3f} s, longest {max(off):.3f} s" if off else "-"
                print(f"guardian {'in a scope' if scope else 'beside the run'}: off {len(off)} of {rounds}; {found}")
        finally:
            served.end()


@contextmanager
def _manager(folder: Path) -> Iterator[Mapping[str, str]]:
    """Have a user manager for the length of the block."""
    subprocess.run(["mount", "-t", "tmpfs", "tmpfs", "/run"], check=True)
    for path in (Path("/run/systemd/system"), RUNTIME):
        path.mkdir(parents=True)
    RUNTIME.chmod(0o700)
    environment = {**quiet(), "XDG_RUNTIME_DIR": str(RUNTIME)}
    with (folder / "systemd.log").open("wb") as log:
        manager = subprocess.Popen([SYSTEMD, "--user", "--unit=basic.target"], env=environment, stdout=log, stderr=log)
        try:
            _until(lambda: (RUNTIME / "systemd" / "private").exists(), "no user manager: see its log")
            yield environment
        finally:
            manager.terminate()
            manager.wait(PATIENCE)


def _killed(served: Served, folder: Path, environment: Mapping[str, str], scope: bool) -> float | None:
    """Return how long (s) after its service was killed a run had everything off; None where something stays on."""
    folder.mkdir()
    runs, said = folder / "runs", folder / "said"
    # Without a manager that it can reach, a run falls back.
    seen = {"XDG_RUNTIME_DIR": str(RUNTIME if scope else folder)}
    setting = [f"--setenv={name}={value}" for name, value in {**environment, **seen}.items()]
    command = [sys.executable, "-m", "tests.studies.scope", "--hold", str(served.station), str(runs)]
    _systemd(
        environment,
        "systemd-run",
        "--user",
        "--quiet",
        "--collect",
        "--unit=motorbench-study",
        f"--working-directory={Path.cwd()}",
        f"--property=StandardOutput=file:{said}",
        f"--property=StandardError=file:{folder / 'errors'}",
        *setting,
        *command,
    )
    _until(lambda: said.exists() and "energised" in said.read_text(), "nothing was energised")
    assert served.world.truth()["energised"]
    begun = time.monotonic()
    _systemd(environment, "systemctl", "--user", "kill", "--signal=KILL", "motorbench-study.service")
    try:
        _until(lambda: not served.world.truth()["energised"], "it stays on", 8.0)
    except TimeoutError:
        _switch_off(served)
        return None
    took = time.monotonic() - begun
    kinds = [event.kind for event in read_guardian(next(runs.iterdir()))]
    assert scope == ("took" in kinds), kinds
    return took


def _switch_off(served: Served) -> None:
    """Switch off what was left on: the supply, which nothing else does."""
    with closing(ResourceManager("@py").open_resource(served.told["addresses"]["supply"]["socket"])) as supply:
        supply.write_termination = "\n"
        supply.write("OUTP OFF,(@1)")
    _until(lambda: not served.world.truth()["energised"], "it stays on although it is told off")


def _systemd(environment: Mapping[str, str], tool: str, *words: str) -> None:
    subprocess.run([tool, *words], env=dict(environment), check=True)


def _until(true: Callable[[], bool], otherwise: str, patience: float = PATIENCE) -> None:
    begun = time.monotonic()
    while not true():
        if time.monotonic() - begun > patience:
            raise TimeoutError(otherwise)
        time.sleep(0.01)  # noqa: TID251  what is waited for is another process'


if __name__ == "__main__":
    main()
