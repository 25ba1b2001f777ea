"""Coverage of the 95 % intervals over random motors and random instruments.

`python -m tests.studies.coverage --motors N --seed S [--workers K] [--dask ADDRESS] [--procedures NAME …] [--hostile]`
`python -m tests.studies.coverage --disturbed [CAUSE …] [--two] [--procedures NAME …] --motors N --seed S [--workers K]`

Every motor is drawn (see `random_motors`), stands on a virtual bench whose instruments have errors drawn from their
specifications, and goes through the procedures by the real drivers. Printed for each parameter and procedure:

- coverage: share of the 95 % intervals that hold the truth;
- width / ideal: mean half-width of the intervals over that of the ideal interval, the shortest that would have held the truth
  for 95 % of these motors. Motors differ, so both are taken in units of each motor's stated standard uncertainty u: mean(U / u)
  over the 95 % quantile of |error| / u. It is 1 where the intervals are as wide as they must be, whatever the errors'
  distribution, above 1 where they are wider, below 1 where they are too narrow; a few outliers do not change it;
- bias / u and rms / u: mean and root mean square of error / u;
- mean U: mean half-width relative to the truth.

With `--hostile` the instruments begin as a last user may have left them, and only what a driver refuses by name is put right
beforehand (see `hostile_states`).

With `--disturbed` every motor's bench is made dirty with one cause, or with two, from negligible to gross (see `causes`), goes
through the procedures that the cause concerns, and a table for each cause says what became of their figures, those first that are
off without a word:

- sure and wrong: share of the figures given whose interval excludes the truth, nothing being said against them;
- held: share whose interval holds it; beyond 3 U: how many are off by more than three half-widths;
- warned: share with a notice or a finding against them; withheld: figures not given; refused: procedures that gave none.

Causes of a drive that regulates currents (group `drive`) are on a bench that has one. A flux map's figures are its flux linkages at all
currents and what it reports; `--procedures` chooses rows.

The result depends on seed and number of motors only, however many workers there are.
"""

import argparse
import gc
import resource
import time
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

from tests.studies.disturbances.causes import BY_ROW, named
from tests.studies.disturbances.disturbed import Row, add, measure_disturbed, table
from tests.studies.forked import context
from tests.studies.tally import Tally, lines
from tests.studies.worlds.measured_motor import Measured, measure, study_plan
from tests.studies.worlds.pressed_keys import press_all

#: Motors handed to a cluster's worker at a time, and handfuls under way at once.
_HANDFUL, _UNDER_WAY = 20, 200
_MEBIBYTE = 1 << 20


def measure_some(
    seed: int,
    indices: Iterable[int],
    procedures: tuple[str, ...] = (),
    spent: Counter[str] | None = None,
    hostile: bool = False,
) -> list[Measured]:
    """Measure these motors one after the other, by these procedures or by all; `spent` sums up processor time (s).

    With `hostile` the instruments begin as a last user may have left them.
    """
    plan = study_plan(procedures)
    measured = []
    # What was imported lives as long as the process; what a motor leaves behind is looked for once, after it.
    gc.freeze()
    gc.disable()
    try:
        for index in indices:
            measured.append(measure(seed, index, plan, spent, press_all if hostile else None))
            gc.collect()
    finally:
        gc.enable()
        gc.unfreeze()
    return measured


@dataclass
class Cost:
    """What a study's processes have used: processor time (s) in all, and memory (MiB).

    `early` and `late` are what a process held after the first tenth of the motors and after the last, `most` what any held
    for a moment.
    """

    seconds: float = 0.0
    early: float = 0.0
    late: float = 0.0
    most: float = 0.0


def _worked(
    seed: int, indices: Iterable[int], procedures: tuple[str, ...], hostile: bool
) -> tuple[list[Measured], Cost]:
    begun = time.process_time()
    measured = measure_some(seed, indices, procedures, hostile=hostile)
    held = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * resource.getpagesize() / _MEBIBYTE
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return measured, Cost(time.process_time() - begun, held, held, most)


def by_workers(
    seed: int,
    motors: int,
    workers: int,
    procedures: tuple[str, ...] = (),
    cost: Cost | None = None,
    hostile: bool = False,
) -> Iterator[Measured]:
    """Give all motors in order, measured by processes of this machine; `cost` sums up what that takes."""
    cost = cost or Cost()
    handfuls = [range(k, min(k + 4, motors)) for k in range(0, motors, 4)]
    # A fresh process now and then, so that nothing that a library keeps can add up.
    with context().Pool(workers, maxtasksperchild=100) as pool:
        for some, took in pool.imap(partial(_worked, seed, procedures=procedures, hostile=hostile), handfuls):
            cost.seconds, cost.late, cost.most = cost.seconds + took.seconds, took.late, max(cost.most, took.most)
            if some[0].index <= motors / 10:
                cost.early = took.early
            yield from some


def by_cluster(
    seed: int, motors: int, address: str, procedures: tuple[str, ...] = (), hostile: bool = False
) -> Iterator[Measured]:
    """Give all motors in order, measured by a Dask cluster whose scheduler is at `address`; "local" makes one here.

    Raises SystemExit where dask.distributed is not installed.
    """
    try:
        from distributed import Client
    except ImportError:
        raise SystemExit(
            "--dask needs dask.distributed: install the extra, `pip install motorbench[cluster]`"
        ) from None
    handfuls = iter([range(k, min(k + _HANDFUL, motors)) for k in range(0, motors, _HANDFUL)])
    # Over TCP on loopback: dask's way without sockets looks for a route to the internet.
    here = {"processes": False, "n_workers": 2, "threads_per_worker": 1, "protocol": "tcp://"}
    with Client(**here) if address == "local" else Client(address) as client:

        def submitted(number: int) -> Iterator[Any]:
            for some in islice(handfuls, number):
                yield client.submit(measure_some, seed, some, procedures, hostile=hostile, pure=False)

        # A window of futures, so that neither the scheduler nor this process ever holds a million results.
        waiting = deque(submitted(_UNDER_WAY))
        while waiting:
            yield from waiting.popleft().result()
            waiting.extend(submitted(1))


def study(measured: Iterable[Measured]) -> Tally:
    """Return the sums over all motors."""
    tally = Tally()
    for one in measured:
        tally.add(one)
    return tally


def disturbed(
    seed: int,
    motors: int,
    workers: int,
    names: tuple[str, ...] = (),
    two: bool = False,
    procedures: tuple[str, ...] = (),
) -> dict[str, Row]:
    """Return what became of the figures of each cause; `names` are causes, or groups of them, `procedures` those whose rows are wanted."""
    wanted = [cause for cause in named(names) if not procedures or set(cause.procedures) & set(procedures)]
    work = [(cause.row, index) for cause in wanted for index in range(motors)]
    rows: dict[str, Row] = {}
    with context().Pool(workers, maxtasksperchild=100) as pool:
        for (name, _), row in zip(work, pool.imap(partial(_soiled, seed, two), work, chunksize=4), strict=True):
            add(rows.setdefault(name, Row()), row)
    return rows


def _soiled(seed: int, two: bool, work: tuple[str, int]) -> Row:
    row, index = work
    return measure_disturbed(seed, index, BY_ROW[row], two)


def main() -> None:
    """Run the study and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motors", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1, help="processes of this machine")
    parser.add_argument("--dask", metavar="ADDRESS", help="scheduler of a Dask cluster, or local")
    parser.add_argument(
        "--procedures", nargs="+", default=(), metavar="NAME", help="these only, in the catalogue's order"
    )
    parser.add_argument(
        "--times", action="store_true", help="only print each procedure's processor time, with one process"
    )
    parser.add_argument(
        "--disturbed", nargs="*", metavar="CAUSE", help="benches that something disturbs: these causes, or all"
    )
    parser.add_argument("--hostile", action="store_true", help="instruments as a last user may have left them")
    parser.add_argument("--two", action="store_true", help="with --disturbed: two causes at once")
    given = parser.parse_args()
    if given.disturbed is not None:
        started = time.monotonic()
        names, wanted = tuple(given.disturbed), tuple(given.procedures)
        rows = disturbed(given.seed, given.motors, given.workers, names, given.two, wanted)
        print("\n".join(table(rows)))
        print(f"\n{given.motors} motors a cause in {time.monotonic() - started:.0f} s")
        return
    if given.times:
        _print_times(given.seed, given.motors)
        return
    procedures = tuple(given.procedures)
    started, cost = time.monotonic(), Cost()
    if given.dask:
        tally = study(by_cluster(given.seed, given.motors, given.dask, procedures, given.hostile))
    else:
        tally = study(by_workers(given.seed, given.motors, given.workers, procedures, cost, given.hostile))
    print("\n".join(lines(tally)))
    print(f"\n{tally.motors} motors in {time.monotonic() - started:.0f} s", end="")
    # What a cluster's workers used is not known here.
    if not given.dask:
        print(f"; {cost.seconds / tally.motors:.2f} s of processor time a motor", end="")
        print(
            f"; a process held {cost.early:.0f} MiB after the first tenth, {cost.late:.0f} MiB after the last", end=""
        )
        print(f", {cost.most:.0f} MiB at most", end="")
    print()


def _print_times(seed: int, motors: int) -> None:
    # The first motor pays for what is imported late.
    measure_some(seed, [motors])
    spent = Counter[str]()
    measure_some(seed, range(motors), spent=spent)
    print(f"{spent.total() / motors:.3f} s of processor time a motor:")
    for name, seconds in spent.most_common():
        print(f"  {seconds / motors:.3f}  {name}")


if __name__ == "__main__":
    main()
