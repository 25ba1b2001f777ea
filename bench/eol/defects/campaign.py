"""All motors of a check, measured by as many processes as there are cores."""

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass

from bench.eol.defects.cases import DefectCases
from bench.eol.defects.trial import MotorTrial, TrialSetup, begin, measured
from bench.i18n.errors import InputError
from drivers.interfaces.text import text

#: Motors handed to a process ahead of time.
_AHEAD = 3

Task = tuple[int, int, int]


@dataclass(frozen=True)
class Campaign:
    """What was measured, in the order of the motors' numbers; not `complete` where somebody stopped it. `planned` motors there are."""

    trials: tuple[MotorTrial, ...]
    planned: int

    @property
    def complete(self) -> bool:
        """Whether every motor was measured."""
        return len(self.trials) == self.planned


def tasks_of(cases: DefectCases, each: int, sound: int) -> tuple[Task, ...]:
    """Return case, motor of it and number of `each` motors of every case and of so many `sound` ones, evenly mixed."""
    every = len(cases.cases)
    places = [((motor + 0.5) / sound, -1, motor) for motor in range(sound)]
    places += [((motor + (case + 0.5) / every) / each, case, motor) for case in range(every) for motor in range(each)]
    places.sort()
    return tuple((case, motor, number) for number, (_, case, motor) in enumerate(places, 1))


def measure_all(
    setup: TrialSetup, tasks: Sequence[Task], jobs: int, progress: Callable[[int], None] = lambda _: None
) -> Campaign:
    """Measure these motors by so many processes; `progress` hears how many are done.

    Ctrl-C ends it with those that are done. Raises InputError where a process died.
    """
    # Small matrices gain nothing from threads of their own.
    os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("forkserver"), begin, (setup,))
    done: list[MotorTrial] = []
    try:
        for trial in _as_done(pool, tasks, jobs * _AHEAD):
            done.append(trial)
            progress(len(done))
    except KeyboardInterrupt:
        pass
    except BrokenProcessPool:
        raise InputError(
            text(
                "a process of the check ended by itself, perhaps for want of memory; try --jobs {jobs}",
                jobs=max(1, jobs // 2),
            )
        ) from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
    return Campaign(tuple(sorted(done, key=lambda trial: trial.number)), len(tasks))


def _as_done(pool: ProcessPoolExecutor, tasks: Sequence[Task], most: int) -> Iterator[MotorTrial]:
    waiting = iter(tasks)
    under_way: set[Future[MotorTrial]] = set()
    for task in waiting:
        under_way.add(pool.submit(measured, *task))
        if len(under_way) >= most:
            ready, under_way = wait(under_way, return_when=FIRST_COMPLETED)
            yield from (future.result() for future in ready)
    while under_way:
        ready, under_way = wait(under_way, return_when=FIRST_COMPLETED)
        yield from (future.result() for future in ready)
