"""Yields by motor: first pass, final and rolled, of all and by where, when and by which plan a motor was judged first."""

import datetime
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from sqlalchemy import Connection

from bench.eol.statistics.proportion import Proportion, proportion
from bench.eol.store.motor_tests import (
    ANY_OCCASION,
    STEP,
    MotorTest,
    Occasion,
    counted_tests,
    first_attempts,
    repeated_tests,
)
from bench.eol.store.selection import Selection
from bench.eol.verdict import Verdict
from bench.i18n.errors import UsageError
from drivers.interfaces.text import text

Grouping = Literal["station", "socket", "shift", "date", "plan"]
GROUPINGS: tuple[Grouping, ...] = get_args(Grouping)
#: The fields of an occasion that each goes by.
_TOLD_APART: Mapping[Grouping, tuple[str, ...]] = {
    "station": ("station",),
    "socket": ("station", "socket"),
    "shift": ("started",),
    "date": ("started",),
    "plan": ("plan",),
}
#: When shifts begin where nothing else is said.
SHIFTS = (datetime.time(6), datetime.time(14), datetime.time(22))
_JUDGED = (Verdict.PASS, Verdict.FAIL)
#: Tests or motors: where and when, whether they passed at once, whether they passed in the end, and how many.
_Counted = tuple[Occasion, bool, bool, int]


@dataclass(frozen=True)
class GroupYield:
    """The yields of the motors that were judged first within one group."""

    name: str
    first_pass: Proportion
    final: Proportion


@dataclass(frozen=True)
class RolledYield:
    """The product of the procedures' first-pass yields at a motor's first judged test; NaN where nothing was judged.

    `procedures` gives for each in how many motors it was tried, and of how many its first attempt passed.
    """

    share: float
    procedures: Mapping[str, Proportion]


@dataclass(frozen=True)
class MotorYields:
    """Yields of motors that were judged: a motor counts once however often it was tested.

    First pass: its first judged test ever is of the selection, and passed without a second attempt at anything. Final: its last
    judged test in the selection passed. `retested` motors have more than one judged test.
    """

    first_pass: Proportion
    final: Proportion
    rolled: RolledYield
    retested: int
    groups: Mapping[Grouping, tuple[GroupYield, ...]]


def shift_starts(names: Sequence[str]) -> tuple[datetime.time, ...]:
    """Return when shifts begin, from times of day as 06:00. Raises UsageError for anything else, and between five minutes."""
    starts = []
    for name in names:
        try:
            start = datetime.time.fromisoformat(name)
        except ValueError:
            start = None
        if start is None or start.second or start.microsecond or start.tzinfo or start.minute % (STEP.seconds // 60):
            raise UsageError(
                text("--shifts {name}: a time of day at full five minutes is allowed, as 06:00", name=name)
            )
        starts.append(start)
    return tuple(sorted(set(starts)))


def motor_yields(
    connection: Connection,
    selection: Selection,
    by: Sequence[Grouping] = (),
    shifts: Sequence[datetime.time] = SHIFTS,
    confidence: float = 0.95,
) -> MotorYields:
    """Return the yields of a selection by motor, and by groups of the motors' first judged tests in it."""
    repeated = repeated_tests(connection, selection)
    histories = _histories(repeated)
    counted = _counted(connection, selection, by) if by else _all_of(selection)
    # Tests of motors that have several are taken out, and the motors put in, each once.
    counted += [
        (test.occasion, _at_once(test.verdict, test.first_pass), test.verdict is Verdict.PASS, -1)
        for test in repeated
        if test.chosen and test.verdict in _JUDGED
    ]
    counted += [(each.first.occasion, each.first_pass, each.final, 1) for each in histories]
    names = {grouping: _namer(grouping, shifts) for grouping in by}
    later = [test.identifier for each in histories for test in each.tests if test is not each.first]
    return MotorYields(
        *_proportions(counted, confidence),
        rolled=_rolled(first_attempts(connection, selection, later), confidence),
        retested=sum(len(each.tests) > 1 for each in histories),
        groups={grouping: _grouped(counted, names[grouping], confidence) for grouping in by},
    )


def _counted(connection: Connection, selection: Selection, by: Sequence[Grouping]) -> list[_Counted]:
    told_apart = {field for grouping in by for field in _TOLD_APART[grouping]}
    return [
        (occasion, _at_once(verdict, first_pass), verdict is Verdict.PASS, count)
        for occasion, verdict, first_pass, count in counted_tests(connection, selection, told_apart)
        if verdict in _JUDGED
    ]


def _all_of(selection: Selection) -> list[_Counted]:
    passed, at_once = selection.verdicts[Verdict.PASS], selection.first_pass
    return [
        (ANY_OCCASION, True, True, at_once),
        (ANY_OCCASION, False, True, passed - at_once),
        (ANY_OCCASION, False, False, selection.verdicts[Verdict.FAIL]),
    ]


@dataclass(frozen=True)
class _History:
    """A motor that was tested more than once: its judged tests in the selection, and what became of it."""

    tests: tuple[MotorTest, ...]
    first_pass: bool

    @property
    def first(self) -> MotorTest:
        return self.tests[0]

    @property
    def final(self) -> bool:
        return self.tests[-1].verdict is Verdict.PASS


def _histories(repeated: Sequence[MotorTest]) -> list[_History]:
    by_serial: dict[str, list[MotorTest]] = {}
    for test in repeated:
        if test.verdict in _JUDGED:
            by_serial.setdefault(test.serial_number, []).append(test)
    histories = []
    for tests in by_serial.values():
        chosen = tuple(test for test in tests if test.chosen)
        if chosen:
            first = tests[0]
            histories.append(_History(chosen, first.chosen and _at_once(first.verdict, first.first_pass)))
    return histories


def _at_once(verdict: Verdict, first_pass: bool) -> bool:
    return first_pass and verdict is Verdict.PASS


def _proportions(counted: Sequence[_Counted], confidence: float) -> tuple[Proportion, Proportion]:
    motors = sum(count for *_, count in counted)
    first = sum(count for _, first_pass, _, count in counted if first_pass)
    final = sum(count for _, _, passed, count in counted if passed)
    return proportion(first, motors, confidence), proportion(final, motors, confidence)


def _grouped(
    counted: Sequence[_Counted], name_of: Callable[[Occasion], str], confidence: float
) -> tuple[GroupYield, ...]:
    groups: dict[str, list[_Counted]] = {}
    for each in counted:
        groups.setdefault(name_of(each[0]), []).append(each)
    yields = (GroupYield(name, *_proportions(groups[name], confidence)) for name in sorted(groups))
    return tuple(group for group in yields if group.first_pass.count)


def _namer(grouping: Grouping, shifts: Sequence[datetime.time]) -> Callable[[Occasion], str]:
    """Return what names an occasion's group; times are those of this computer's zone."""
    if grouping == "station":
        return lambda occasion: occasion.station
    if grouping == "socket":
        return lambda occasion: f"{occasion.station} · {occasion.socket}"
    if grouping == "plan":
        return lambda occasion: occasion.plan
    if grouping == "date":
        return lambda occasion: occasion.started.astimezone().date().isoformat()
    return lambda occasion: _shift(occasion.started.astimezone(), shifts)


def _shift(at: datetime.datetime, shifts: Sequence[datetime.time]) -> str:
    """Return a shift's name: the day on which it began, and when."""
    begun = [start for start in shifts if start <= at.time()]
    day = at.date() if begun else at.date() - datetime.timedelta(days=1)
    start = begun[-1] if begun else shifts[-1]
    return f"{day.isoformat()} {start:%H:%M}"


def _rolled(attempts: Mapping[str, tuple[int, int]], confidence: float) -> RolledYield:
    procedures = {name: proportion(tests - bad, tests, confidence) for name, (tests, bad) in attempts.items()}
    share = math.prod(each.share for each in procedures.values()) if procedures else math.nan
    return RolledYield(share, procedures)
