"""A bench that is ended, disturbed and lied to in every manner, tried from outside.

Every run speaks through real sockets to a virtual bench in a process of its own, which is asked itself whether anything is
still energised. `--kind` names what is done, each repeated until there are enough trials of it.
"""

import argparse
import json
import os
import random
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from bench.safety.ownership.state_folder import VARIABLE
from tests.studies.kills import ends, measuring, panel_server, records, wires
from tests.studies.kills.held_trials import hold
from tests.studies.kills.quick import bursts
from tests.studies.kills.report import ENERGISED, TRIALS, good, summary, table
from tests.studies.kills.trial import Trial
from tests.studies.kills.victim import Bench

#: Share of the trials of each kind.
SHARES = {"ends": 0.36, "wires": 0.48, "measuring": 0.12, "records": 0.03, "panel": 0.01}
Work = Callable[[Path, int, random.Random, Path | None], Iterator[Trial]]


def held(plans: Callable[..., Iterator[object]]) -> Work:
    """Return the trials with a run that holds everything energised."""

    def work(folder: Path, count: int, draw: random.Random, kept: Path | None) -> Iterator[Trial]:
        bench = Bench(folder)
        try:
            for plan, _ in zip(plans(draw), range(count), strict=False):
                yield hold(bench, plan, draw, kept)
        finally:
            bench.close()

    return work


WORKS: dict[str, Work] = {
    "ends": held(ends.plans),
    "wires": held(wires.plans),
    "measuring": measuring.trials,
    "records": records.trials,
    "panel": panel_server.trials,
}


def study(
    counts: dict[str, int], seed: int, workers: int, tell: Callable[[Trial], None], kept: Path | None = None
) -> list[Trial]:
    """Return what became of every trial; `counts` by kind are dealt out to the workers, `tell` gets each as it is there."""
    found: list[Trial] = []
    lock = threading.Lock()

    def lead(number: int) -> None:
        for kind, count in counts.items():
            own = count // workers + (number < count % workers)
            if not own:
                continue
            draw = random.Random(f"{seed}-{number}-{kind}")  # noqa: S311  moments, no secrets
            here = Path(folder) / f"{kind}-{number}"
            here.mkdir()
            for trial in WORKS[kind](here, own, draw, kept):
                with lock:
                    found.append(trial)
                    tell(trial)

    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(workers) as pool:
        _use_own_state(Path(folder))
        for _ in pool.map(lead, range(workers)):
            pass
    return found


def _use_own_state(folder: Path) -> None:
    """Keep what this computer's benches share out of the study, where nobody has named a folder for it."""
    if VARIABLE not in os.environ:
        state = folder / "state"
        state.mkdir()
        state.chmod(0o1777)
        os.environ[VARIABLE] = str(state)


def _report(found: list[Trial]) -> None:
    print(table(found))
    print()
    print(summary(found))
    for trial in found:
        if not trial.good:
            print(f"\n{trial}")


def main() -> None:
    """Run the study as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=520)
    parser.add_argument("--kind", choices=SHARES, action="append", help="these only, all trials being of them")
    parser.add_argument(
        "--quick", type=int, default=10_000, help="bursts of two to four signals at the stop logic alone"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--keep", type=Path, help="folder for the records of trials that broke a promise")
    parser.add_argument("--log", type=Path, help="file that gets every trial as a line of JSON, as soon as it is there")
    parser.add_argument("--report", type=Path, help="no trials: report on those in a file that --log wrote")
    given = parser.parse_args()
    if given.report:
        _report([Trial(**json.loads(line)) for line in given.report.read_text(encoding="utf-8").splitlines()])
        return
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    kinds = given.kind or list(SHARES)
    whole = sum(SHARES[kind] for kind in kinds)
    counts = {kind: round(given.trials * SHARES[kind] / whole) for kind in kinds}

    def tell(trial: Trial) -> None:
        if given.log:
            with given.log.open("a", encoding="utf-8") as log:
                log.write(json.dumps(asdict(trial)) + "\n")

    with ThreadPoolExecutor(1) as beside:
        bursting = beside.submit(bursts, given.quick, f"{given.seed}-quick")
        found = study(counts, given.seed, given.workers, tell, given.keep)
        quick = bursting.result()
    print(f"The stop logic alone: {quick.bursts} bursts of two to four signals, {quick.hangs} of them hung.")
    print("\n".join([*quick.found, ""]))
    _report(found)
    enough = given.kind or (len(found) >= TRIALS and sum(trial.energised for trial in found) >= ENERGISED)
    sys.exit(0 if good(found) and enough and not quick.hangs and not quick.found else 1)


if __name__ == "__main__":
    main()
