"""One run with a fault, as `motorbench run` does it, and what became of it beside the undisturbed one."""

import io
import math
import re
import signal
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any

from rich.console import Console

from bench.motor.motor_file import load_motor
from bench.plugins.catalogues import installed
from bench.run.request import Finished, RunRequest
from bench.run.run import run
from bench.virtual.fault_file import GivenFault
from procedures.core.result import Parameter
from sim_instruments.faults.catalogue import FAULT
from tests.studies.faulty.fault_cases import SETTINGS, Case

#: What becomes of a run; WRONG is all that must not be.
RIGHT, WARNED, REFUSED, TOLD, WRONG = "right", "warned", "refused", "still on, told", "WRONG"
#: A run hangs that has not ended after so much of the processor's time (s), or of the wall's on a machine with other work.
LONGEST, LONGEST_WAIT = 60.0, 600.0
_TIMERS = ((signal.ITIMER_PROF, signal.SIGPROF, LONGEST), (signal.ITIMER_REAL, signal.SIGALRM, LONGEST_WAIT))
#: An error whose kind is part of the message: nobody has made a sentence of it.
_PROGRAM_FAULT = re.compile(r"(?:[a-z-]+: )?[A-Z]\w*(?:Error|Exception|Warning): ")
_NOT_SAFE = "could not be made safe"


@dataclass(frozen=True)
class Ended:
    """What became of a case: one of the outcomes, and in words what is wrong, said or off."""

    case: Case
    outcome: str
    words: str = ""
    named: bool = True


class Hung(BaseException):
    """The run does not come to its end."""


def judge(case: Case, seed: int) -> Ended:
    """Run a case and the undisturbed one and compare them."""
    try:
        undisturbed = reference(case.motor, case.procedure, seed)
        with _watchdog():
            ended = _run(case.motor, case.procedure, seed, case.described)
    except Hung:
        # What it was in the middle of may have been the handling of signals.
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        return Ended(case, WRONG, "hangs")
    except Exception as error:  # noqa: BLE001  whatever gets out is what the study looks for
        return Ended(case, WRONG, f"gets out: {type(error).__name__}: {_plain(str(error))}")
    view, cause = ended.view, ended.view.cause
    if any(_PROGRAM_FAULT.match(line) for line in cause.splitlines()):
        return Ended(case, WRONG, f"a fault of the program: {_plain(cause)}")
    if ended.left["energised"]:
        if view.status == "completed" or _NOT_SAFE not in cause:
            return Ended(case, WRONG, f"left on and not told: {_plain(cause) or 'completed'}")
        return Ended(case, TOLD, _plain(cause))
    if view.status != "completed":
        return Ended(case, REFUSED, _plain(cause), case.role.replace("_", " ") in cause.replace("_", " ").lower())
    off = _off(ended, undisturbed)
    if not off:
        return Ended(case, RIGHT)
    said = {notice.identifier for _, notice in view.warnings()} - undisturbed.warned
    return Ended(case, WARNED if said else WRONG, off + (f"; warned: {', '.join(sorted(said))}" if said else ""))


@dataclass(frozen=True)
class Reference:
    """What an undisturbed run gives: its figures by name, and the warnings it has."""

    figures: Mapping[str, Parameter]
    warned: frozenset[str]


@cache
def reference(motor: str, procedure: str, seed: int) -> Reference:
    """Return the undisturbed run. Raises RuntimeError where even that does not complete."""
    ended = _run(motor, procedure, seed, None)
    if ended.view.status != "completed" or ended.left["energised"]:
        raise RuntimeError(f"{procedure} on {motor} does not complete without a fault: {ended.view.cause}")
    return Reference(_figures(ended), frozenset(notice.identifier for _, notice in ended.view.warnings()))


def _run(motor: str, procedure: str, seed: int, fault: Mapping[str, Any] | None) -> Finished:
    faults = () if fault is None else (GivenFault(FAULT.validate_python(fault), "the study"),)
    with tempfile.TemporaryDirectory(prefix="fault-study-", dir=_memory()) as runs:
        wishes = RunRequest(
            [procedure],
            load_motor(motor),
            "virtual",
            "en",
            Path(runs),
            assignments=SETTINGS.get(procedure, ()),
            seed=seed,
            faults=faults,
        )
        return run(wishes, installed().procedures, Console(file=io.StringIO()))


def _memory() -> str | None:
    # A run is written durably, and thousands of them shall not wear a disk.
    return "/dev/shm" if Path("/dev/shm").is_dir() else None  # noqa: S108


def _figures(ended: Finished) -> dict[str, Parameter]:
    return {parameter.name: parameter for result in ended.view.finished.values() for parameter in result.parameters}


def _off(ended: Finished, undisturbed: Reference) -> str:
    """Return which figures are off the undisturbed ones by more than both intervals allow, empty for none."""
    figures, found = _figures(ended), []
    for name, right in undisturbed.figures.items():
        if name not in figures:
            found.append(f"{name} is missing")
            continue
        allowed = math.hypot(_half_width(figures[name]), _half_width(right))
        # Infinite uncertainty is a width that says nothing.
        error = abs(figures[name].value - right.value)
        if not error <= allowed + 1e-9 * abs(right.value) or math.isinf(allowed):
            found.append(f"{name} is {figures[name].value:.4g} instead of {right.value:.4g}")
    return ", ".join(found)


def _half_width(figure: Parameter) -> float:
    low, high = figure.coverage_interval
    return 0.5 * (high - low)


def _plain(words: str) -> str:
    """Return the sentence on one line, without the figures that differ from step to step."""
    return re.sub(r"[-+−]?\b\d[\d.,]*(e[-+]?\d+)?\b", "#", " ".join(words.split()))[:300]


@contextmanager
def _watchdog() -> Iterator[None]:
    def late(_number: int, _frame: FrameType | None) -> None:
        raise Hung

    before = [signal.signal(number, late) for _, number, _ in _TIMERS]
    for timer, _, longest in _TIMERS:
        signal.setitimer(timer, longest)
    try:
        yield
    finally:
        for (timer, number, _), handler in zip(_TIMERS, before, strict=True):
            signal.setitimer(timer, 0.0)
            signal.signal(number, handler)
