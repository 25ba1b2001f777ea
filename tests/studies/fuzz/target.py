"""What is fuzzed: a parser, what it may raise, and bytes to begin with."""

import os
import signal
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any

#: The longest that one input may take (s of processor time: a busy machine changes nothing).
LONGEST = 5.0


@dataclass(frozen=True)
class Target:
    """`run` takes any bytes and raises nothing but `allowed`; `seeds` are inputs that get it started."""

    name: str
    what: str
    run: Callable[[bytes], object]
    allowed: tuple[type[Exception], ...]
    seeds: tuple[bytes, ...]


class TooSlowError(BaseException):
    """An input took longer than LONGEST; nothing that is fuzzed may catch it."""


def check(target: Target, data: bytes) -> None:
    """Run one input; whatever else it raises is a finding, and so is an error without words or a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            target.run(data)
        except target.allowed as error:
            _has_words(error)


@contextmanager
def in_time(longest: float | None = None) -> Iterator[None]:
    """Raise TooSlowError in the block where it takes longer (s) than this, or than LONGEST; for the main thread only."""
    longest = LONGEST if longest is None else longest

    def late(_number: int, _frame: FrameType | None) -> None:
        raise TooSlowError(f"longer than {longest:g} s")

    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, longest)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def each(calls: list[Callable[[], Any]], allowed: tuple[type[Exception], ...]) -> None:
    """Do all of them, whatever of the allowed errors some of them raise."""
    for call in calls:
        try:
            call()
        except allowed as error:
            _has_words(error)


def _has_words(error: Exception) -> None:
    if not str(error).strip():
        raise AssertionError(f"{type(error).__name__} without words")


@cache
def _folder() -> Path:
    # In memory where the system has a place for that: a fuzzer writes thousands of files a second.
    shared = Path("/dev/shm")  # noqa: S108  only looked for; the folder in it is made by mkdtemp
    return Path(tempfile.mkdtemp(prefix="motorbench-fuzz-", dir=shared if os.access(shared, os.W_OK) else None))


def as_file(data: bytes, name: str) -> Path:
    """Return a file that holds these bytes, written over at each call."""
    path = _folder() / name
    path.write_bytes(data)
    return path


def pieces(data: bytes) -> Iterator[bytes]:
    """Give the pieces that stand between bytes 0x1E (record separator), for a dialogue of several replies."""
    yield from data.split(b"\x1e")
