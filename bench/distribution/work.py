"""Work that can be distributed."""

import os
from collections.abc import Callable
from typing import Protocol, TypeVar

Task = tuple[int, ...]
Result = TypeVar("Result", covariant=True)

#: Who dies this often with one and the same part in hand has it to blame.
DEATHS = 3


class Work(Protocol[Result]):
    """Work of parts, each named by whole numbers; it is sent to where it is done, and must bear that."""

    def begin(self) -> Callable[[Task], Result]:
        """Make, once in each process, what does one part; the same part gives the same result wherever it is done."""


def one_thread_each() -> None:
    """Limit libraries that are started from here on to one thread: small matrices gain nothing from more."""
    os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
