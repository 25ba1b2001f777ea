"""How soon everything is off, and what safety costs: `python -m tests.studies.safety --rounds 10`.

Reactions are asked of a served bench in a process of its own, a request to it taking some milliseconds itself. The cost is
that of whole runs, alternately with and without guardian, interlocks and limits; on the virtual bench in process
there are neither guardian nor interlocks, and only the limits are left out.
"""

import argparse
import os
import signal
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

from rich.console import Console

from bench.motor.motor_file import load_motor
from bench.plugins.catalogues import installed
from bench.run.request import RunRequest
from bench.run.run import run
from tests.studies.energised.held import Run, Served

#: What ends a run, by name.
ENDS = ("kill -9", "SIGSTOP", "guardian killed", "SIGTERM", "Ctrl-C", "emergency stop (Modbus)", "door (CAN)")
#: Runs in process are short: so many times more of them.
_IN_PROCESS_TIMES = 5
#: A run to be measured that does not end well is made again so often: on a busy machine an instrument may not answer in time.
_TRIES = 3
ON_WIRES = ("pole-pairs-static", "stator-resistance-dc")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--only", choices=("reactions", "cost"), help="one half of the study")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        if options.only != "cost":
            _reactions(Path(name), options.rounds)
        if options.only != "reactions":
            _costs(Path(name), options.rounds)


def _reactions(folder: Path, rounds: int) -> None:
    print("until everything is off (s, from the cause; frozen: from SIGSTOP, heartbeat included)")
    print(f"  {'':<26}{'median':>8}{'worst':>8}   interrupted after (ms): median, worst")
    for end in ENDS:
        _print_reaction(end, [reaction(folder, end, number) for number in range(rounds)])


def _costs(folder: Path, rounds: int) -> None:
    print("time of a run (s): of the wall on wires, of the processor in process")
    print(f"  {'least of each':<44}{'with':>8}{'without':>9}{'cost':>8}   of the medians; half of the pairs within")
    _print_cost(f"served at 20 ×: {', '.join(ON_WIRES)}", *on_wires(folder, rounds))
    _print_cost("in process: all", *in_process(folder, _IN_PROCESS_TIMES * rounds))


def reaction(folder: Path, end: str, number: int) -> tuple[float, float | None]:
    """End a run with everything energised; return how long (s) until all is off, and until the run was interrupted."""
    here = folder / f"{end.split()[0]}-{end.split()[-1].strip('()')}-{number}"
    here.mkdir()
    served = Served(here)
    try:
        one = Run(served, here / "runs", "wait")
        time.sleep(0.3)  # noqa: TID251  the run is to be in the midst of waiting
        _ending(one, served, end)
        off = served.seconds_until_off()
        if end in ("kill -9",):
            one.guardian_left()
            one.process.communicate()
            return off, None
        if end == "SIGSTOP":
            one.signal(signal.SIGCONT)
        one.ended()
        (started,) = (event.data for event in one.journal if event.kind == "way_down_started")
        return off, None if end == "SIGSTOP" else float(started["interrupted_after"])
    finally:
        served.end()


def _ending(one: Run, served: Served, end: str) -> None:
    match end:
        case "kill -9":
            one.signal(signal.SIGKILL)
        case "SIGSTOP":
            one.signal(signal.SIGSTOP)
        case "guardian killed":
            os.kill(one.guardian_pid, signal.SIGKILL)
        case "SIGTERM":
            one.signal(signal.SIGTERM)
        case "Ctrl-C":
            one.signal(signal.SIGINT)
        case "emergency stop (Modbus)":
            served.contact("emergency_stop", closed=False)
        case "door (CAN)":
            served.contact("door", closed=False)


def on_wires(folder: Path, rounds: int) -> tuple[list[float], list[float]]:
    """Return wall times (s) of runs on a served bench, with and without guardian, interlocks and limits."""
    here = folder / "wires"
    here.mkdir()
    served = Served(here)
    bare = here / "bare.toml"
    content = served.station.read_text(encoding="utf-8")
    bare.write_text(content[: content.index("[interlocks")], encoding="utf-8")
    try:
        return _alternately(
            rounds,
            lambda: _run(here, ON_WIRES, str(served.station), guardian=True),
            lambda: _run(here, ON_WIRES, str(bare), guardian=False),
        )
    finally:
        served.end()


def in_process(folder: Path, rounds: int) -> tuple[list[float], list[float]]:
    """Return processor times (s) of runs on the virtual bench in process, with and without limits."""
    return _alternately(
        rounds,
        lambda: _run(folder, ("all",), "virtual", timer=time.process_time),
        lambda: _run(folder, ("all",), "virtual", timer=time.process_time),
    )


def _alternately(
    rounds: int, guarded: Callable[[], float], bare: Callable[[], float]
) -> tuple[list[float], list[float]]:
    found: tuple[list[float], list[float]] = ([], [])
    guarded()  # what is imported late is imported now
    for _ in range(rounds):
        found[0].append(guarded())
        with _without_limits():
            found[1].append(bare())
    return found


@contextmanager
def _without_limits() -> Iterator[None]:
    def as_it_is(_role: object, instrument: object, *_: object, **__: object) -> object:
        return instrument

    with mock.patch("bench.safety.station_instruments.guarded", as_it_is):
        yield


def _run(
    folder: Path,
    procedures: tuple[str, ...],
    station: str,
    *,
    guardian: bool = True,
    timer: Callable[[], float] = time.perf_counter,
) -> float:
    wishes = RunRequest(
        procedures=procedures,
        motor=load_motor("lg-400w"),
        station=station,
        language="en",
        runs=folder / "runs",
        operator="virtual",
        guardian=guardian,
    )
    for _ in range(_TRIES):
        with open(os.devnull, "w", encoding="utf-8") as nowhere:
            begun = timer()
            done = run(wishes, installed().procedures, Console(file=nowhere))
            taken = timer() - begun
        if done.view.status == "completed":
            return taken
        print(f"  made again: a run that was to be measured {done.view.status}: {done.view.cause}", flush=True)
    sys.exit(f"no run has ended well in {_TRIES} tries: the machine is too busy to measure on")


def _print_reaction(end: str, found: list[tuple[float, float | None]]) -> None:
    off = [each for each, _ in found]
    heard = [each * 1e3 for _, each in found if each is not None]
    told = f"{statistics.median(heard):>8.1f}{max(heard):>8.1f}" if heard else f"{'–':>8}"
    print(f"  {end:<26}{statistics.median(off):>8.3f}{max(off):>8.3f}   {told}", flush=True)


def _print_cost(what: str, guarded: list[float], bare: list[float]) -> None:
    # The least of several is what the work itself takes; what else the machine did comes on top.
    least, bare_least = min(guarded), min(bare)
    medians = statistics.median(guarded) / statistics.median(bare) - 1.0
    pairs = sorted(one / other - 1.0 for one, other in zip(guarded, bare, strict=True))
    quarter = len(pairs) // 4
    spread = f"{medians:>+11.1%}, {pairs[quarter]:+.1%} to {pairs[-1 - quarter]:+.1%}"
    print(f"  {what:<44}{least:>8.3f}{bare_least:>9.3f}{least / bare_least - 1.0:>+8.1%}{spread}", flush=True)


if __name__ == "__main__":
    main()
