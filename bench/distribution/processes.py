"""Work done by processes of this machine."""

import multiprocessing
import os
import signal
import threading
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from bench.distribution.work import DEATHS, Result, Task, Work, one_thread_each
from bench.i18n.errors import InputError
from drivers.interfaces.text import text

#: Parts handed to a process ahead of time.
_AHEAD = 3

_DO: list[Callable[[Task], Any]] = []


def by_processes(work: Work[Result], tasks: Sequence[Task], jobs: int) -> Generator[Result, None, None]:
    """Give the results as they come; what a process that died had in hand is done by another.

    Raises InputError where one part has ended several.
    """
    one_thread_each()
    waiting, deaths = list(reversed(tasks)), Counter[Task]()
    while waiting:
        pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("forkserver"), _begin, (work,))
        under_way: dict[Future[Result], Task] = {}
        try:
            while waiting or under_way:
                while waiting and len(under_way) < jobs * _AHEAD:
                    under_way[pool.submit(_do, waiting[-1])] = waiting[-1]
                    waiting.pop()
                for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                    yield future.result()
                    del under_way[future]
        except BrokenProcessPool:
            # Which of them it was, nobody knows: all are done again.
            again = [task for future, task in under_way.items() if future.exception() is not None or not future.done()]
            yield from (future.result() for future in under_way if future.done() and future.exception() is None)
            deaths.update(again)
            waiting += reversed(again)
            if max(deaths.values(), default=0) >= DEATHS:
                raise InputError(
                    text(
                        "processes ended by themselves {deaths} times, possibly because memory ran out; try "
                        "--jobs {jobs}",
                        deaths=DEATHS,
                        jobs=max(1, jobs // 2),
                    )
                ) from None
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _begin(work: Work[Any]) -> None:
    """Make what this process works with; Ctrl-C is its parent's to take, and it ends with that."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _DO[:] = [work.begin()]


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _do(task: Task) -> Any:
    return _DO[0](task)
