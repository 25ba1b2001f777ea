"""Yields by motor: first pass, final and rolled, of all and by where, when and by which plan a motor was judged first."""

import datetime
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Literal, get_args

from sqlalchemy import Connection

from bench.eol.statistics.proportion import Proportion, proportion
from bench.eol.store.motor_tests import first_attempts, repeated_tests
from bench.eol.store.occasions import ANY_OCCASION, STEP, CountedTests, Occasion, counted_by_place, counted_by_time
from bench.eol.store.selection import Selection
from bench.eol.verdict import Verdict
from bench.i18n.errors import UsageError
from drivers.interfaces.text import text

Grouping = Literal["station", "socket", "shift", "date", "plan"]
GROUPINGS: tuple[Grouping, ...] = get_args(Grouping)
#: What each goes by, `step` being the time.
_TOLD_APART: Mapping[Grouping, tuple[str, ...]] = {
    "station": ("station",),
    "socket": ("station", "socket"),
    "shift": ("step",),
    "date": ("step",),
    "plan": ("plan",),
}
#: When shifts begin where nothing else is said.
SHIFTS = (datetime.time(6), datetime.time(14), datetime.time(22))


@dataclass(frozen=True)
class GroupYield:
    """The yields of the motors that were judged first within one group."""

    name: str
    first_pass: Proportion
    final: Proportion


@dataclass(frozen=True)
class RolledYield:
    """The product of the procedures' first-pass yields at motors' first judged tests ever; NaN where there are none.

    `procedures` gives for each in how many motors it was tried, and of how many its first attempt passed.
    """

    share: float
    procedures: Mapping[str, Proportion]


@dataclass(frozen=True)
class MotorYields:
    """Yields of motors that were judged: a motor counts once however often it was tested.

    First pass, of the motors whose first judged test ever is of the selection: it passed without a second attempt at anything.
    Final, of all: its last judged test in the selection passed. `retested` motors have more than one judged test.
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
    told_apart = list(dict.fromkeys(field for grouping in by for field in _TOLD_APART[grouping]))
    repeated = repeated_tests(connection, selection, ())
    places = [field for field in told_apart if field != "step"]
    by_place: list[CountedTests] = []
    by_time: list[CountedTests] = []
    if places:
        by_place += counted_by_place(connection, selection, places)
        by_place += repeated_tests(connection, selection, places).counted
    if "step" in told_apart:
        by_time += counted_by_time(connection, selection)
        by_time += repeated_tests(connection, selection, ("step",)).counted
    return MotorYields(
        *_proportions([*_all_of(selection), *repeated.counted], confidence),
        rolled=_rolled(first_attempts(connection, selection), confidence),
        retested=repeated.retested,
        groups={
            grouping: _grouped(
                by_time if "step" in _TOLD_APART[grouping] else by_place, _namer(grouping, shifts), confidence
            )
            for grouping in by
        },
    )


def _all_of(selection: Selection) -> list[CountedTests]:
    passed, at_once = selection.verdicts[Verdict.PASS], selection.first_pass
    return [
        CountedTests(ANY_OCCASION, True, True, at_once),
        CountedTests(ANY_OCCASION, False, True, passed - at_once),
        CountedTests(ANY_OCCASION, False, False, selection.verdicts[Verdict.FAIL]),
    ]


def _proportions(counted: Iterable[CountedTests], confidence: float) -> tuple[Proportion, Proportion]:
    motors = final = new = at_once = 0
    for each in counted:
        motors += each.count
        final += each.count if each.passed else 0
        new += each.count if each.first_ever else 0
        at_once += each.count if each.first_ever and each.at_once else 0
    return proportion(at_once, new, confidence), proportion(final, motors, confidence)


def _grouped(
    counted: Iterable[CountedTests], name_of: Callable[[Occasion], str], confidence: float
) -> tuple[GroupYield, ...]:
    groups: dict[str, list[CountedTests]] = {}
    for each in counted:
        groups.setdefault(name_of(each.occasion), []).append(each)
    yields = (GroupYield(name, *_proportions(groups[name], confidence)) for name in sorted(groups))
    return tuple(group for group in yields if group.final.count)


def _namer(grouping: Grouping, shifts: Sequence[datetime.time]) -> Callable[[Occasion], str]:
    """Return what names an occasion's group; times are those of this computer's zone."""
    if grouping == "station":
        return lambda occasion: occasion.station
    if grouping == "socket":
        return lambda occasion: f"{occasion.station} · {occasion.socket}"
    if grouping == "plan":
        return lambda occasion: occasion.plan
    # Very many tests began within the same few minutes.
    when = cache(_date if grouping == "date" else partial(_shift, shifts))
    return lambda occasion: when(occasion.started)


def _date(at: datetime.datetime) -> str:
    return at.astimezone().date().isoformat()


def _shift(shifts: Sequence[datetime.time], started: datetime.datetime) -> str:
    """Return a shift's name: the day on which it began, and when."""
    at = started.astimezone()
    begun = [start for start in shifts if start <= at.time()]
    day = at.date() if begun else at.date() - datetime.timedelta(days=1)
    start = begun[-1] if begun else shifts[-1]
    return f"{day.isoformat()} {start:%H:%M}"


def _rolled(attempts: Mapping[str, tuple[int, int]], confidence: float) -> RolledYield:
    procedures = {name: proportion(tests - bad, tests, confidence) for name, (tests, bad) in attempts.items()}
    share = math.prod(each.share for each in procedures.values()) if procedures else math.nan
    return RolledYield(share, procedures)
