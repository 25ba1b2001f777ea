"""Every fault at every step of every procedure: what becomes of the run.

`python -m tests.studies.faults [--workers K] [--seed S] [--motor NAME] [--procedure NAME …] [--step ID …] [--fault NAME …]`

Each case is a run of one procedure on the virtual bench, as `motorbench run --station virtual --fault …` does it, in virtual
time. It ends in one of these:

- right: it completed, and every figure agrees with the undisturbed run's within both 95 % intervals;
- refused: it failed with a reason, and by the world's truth everything is off;
- still on, told: an output could not be switched off, and the run failed saying so;
- warned: a figure is off, and a warning stands beside it that the undisturbed run has not;
- WRONG: a figure is off and nothing says so, an output is on and nothing says so, a program's error instead of a reason, or
  no end.

The result depends on seed and motor only, however many workers there are.
"""

import argparse
import logging
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import partial

from tests.studies.faulty.fault_cases import Case, cases
from tests.studies.faulty.faulty_run import REFUSED, RIGHT, TOLD, WARNED, WRONG, Ended, judge
from tests.studies.forked import context

OUTCOMES = (RIGHT, REFUSED, TOLD, WARNED, WRONG)
_EVERY = 100


def judge_quietly(case: Case, seed: int) -> Ended:
    """Judge a case, and let the libraries' logs go: they complain of what the study has broken."""
    logging.getLogger().addHandler(logging.NullHandler())
    return judge(case, seed)


def judge_all(given: Sequence[Case], seed: int, workers: int) -> Iterator[Ended]:
    """Give what became of each case, in their order, judged by processes of this machine."""
    if workers == 0:
        yield from map(partial(judge_quietly, seed=seed), given)
        return
    # Cases of one procedure go to one process, which then knows the undisturbed run; a fresh process now and then.
    with context().Pool(workers, maxtasksperchild=400) as pool:
        yield from pool.imap(partial(judge_quietly, seed=seed), given, chunksize=10)


def table(ended: Iterable[Ended]) -> Iterator[str]:
    """Give the table by fault as Markdown, then by procedure, then what is wrong."""
    all_ended = list(ended)
    by_fault, by_procedure = defaultdict[str, Counter[str]](Counter), defaultdict[str, Counter[str]](Counter)
    for one in all_ended:
        by_fault[one.case.name][one.outcome] += 1
        by_procedure[one.case.procedure][one.outcome] += 1
    for title, rows in (("fault", by_fault), ("procedure", by_procedure)):
        yield f"| {title} | cases | {' | '.join(OUTCOMES)} |"
        yield f"| --- |{' ---: |' * (len(OUTCOMES) + 1)}"
        for name, counted in rows.items():
            yield f"| {name} | {counted.total()} | {' | '.join(str(counted[outcome]) for outcome in OUTCOMES)} |"
        yield ""
    yield from _told("wrong", (one for one in all_ended if one.outcome == WRONG))
    yield from _told("warned", (one for one in all_ended if one.outcome == WARNED))
    yield from _told("instrument not named", (one for one in all_ended if one.outcome == REFUSED and not one.named))


def _told(title: str, ended: Iterable[Ended]) -> Iterator[str]:
    steps = defaultdict[tuple[str, str, str], list[str]](list)
    for one in ended:
        what = f"{one.case.role}: {one.case.name}" if one.case.role else one.case.name
        steps[one.case.procedure, what, one.words].append(one.case.step)
    for (procedure, what, words), where in steps.items():
        yield f"- {title}: {procedure} at {', '.join(where)}, {what}: {words}"


def main() -> None:
    """Run the study and print its tables; the exit status is 1 where anything is wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=1, help="processes of this machine, 0 for none")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--motor", default="lg-400w")
    for name, metavar in (("procedure", "NAME"), ("step", "ID"), ("fault", "NAME")):
        parser.add_argument(
            f"--{name}", action="append", default=[], metavar=metavar, help="only this; may be repeated"
        )
    parser.add_argument("--every", type=int, default=1, metavar="N", help="only every N-th case")
    given = parser.parse_args()
    chosen = list(cases(given.motor, given.procedure, given.step, given.fault))[:: given.every]
    started, ended = time.monotonic(), list[Ended]()
    for one in judge_all(chosen, given.seed, given.workers):
        ended.append(one)
        if len(ended) % _EVERY == 0:
            print(f"{len(ended)} of {len(chosen)} after {time.monotonic() - started:.0f} s", flush=True)
    print("\n".join(table(ended)))
    wrong = sum(one.outcome == WRONG for one in ended)
    print(f"\n{len(ended)} cases in {time.monotonic() - started:.0f} s, {wrong} wrong")
    raise SystemExit(1 if wrong else 0)


if __name__ == "__main__":
    main()
