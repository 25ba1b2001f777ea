"""Settings left by an instrument's last user: read when the instrument is opened, set as needed, and restored at the end."""

import math
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass

from drivers.interfaces import InstrumentError, ReportedError
from drivers.interfaces.found_state import FoundSetting
from drivers.interfaces.text import Text, text

_AT_THE_INSTRUMENT = text("Set it at the instrument, and see who else controls it")


@dataclass(frozen=True)
class WantedSetting:
    """One row of a driver's table: a `query`, the permitted answers, and the effect of any other on a figure.

    The first of `wanted` is what is set, by `command` with `{value}` in it; without a command it may not be set, and `remedy`
    says what a person does, as where it is one of `busy`: somebody is at work there. Without `wanted` it is told only. An `optional`
    one that the instrument refuses to tell it has not. `rounded` are answers that mean the first of `wanted`, as the instrument keeps it.
    """

    query: str
    wanted: tuple[str, ...]
    effect: Text
    command: str = ""
    remedy: Text | str = ""
    optional: bool = False
    busy: tuple[str, ...] = ()
    rounded: tuple[str, ...] = ()


class FoundState:
    """The settings of one instrument as they were found; `ask` returns a row's answer, `put` sets a row to a value.

    Without `put` no row may have a command. `name` stands for the instrument in messages.
    """

    def __init__(
        self, name: str, ask: Callable[[WantedSetting], str], put: Callable[[WantedSetting, str], None] | None = None
    ) -> None:
        self._name = name
        self._ask = ask
        self._put = put or _nothing
        self._changed: list[tuple[WantedSetting, str]] = []
        self._found: list[FoundSetting] = []

    @property
    def settings(self) -> tuple[FoundSetting, ...]:
        """Settings as found, in the order in which they were asked."""
        return tuple(self._found)

    def take_over(self, rows: Iterable[WantedSetting]) -> None:
        """Ask every row, and set what may be set.

        Raises ReportedError where a setting is wrong that may not be set, or that does not stay as it was set; what was set
        before is then put back.
        """
        try:
            for row in rows:
                self._take_over(row)
        except BaseException:
            self.give_back()
            raise

    def verify(self, rows: Iterable[WantedSetting]) -> None:
        """Check that no setting has changed since; raises ReportedError if one is not as required."""
        for row in rows:
            found = self._answer(row)
            if found is not None and row.wanted and not matches(found, (*row.wanted, *row.rounded)):
                raise self._refused(row, found, row.remedy or _AT_THE_INSTRUMENT)

    def give_back(self) -> None:
        """Set everything back as it was found, where the instrument still answers; may be called twice."""
        changed, self._changed = self._changed, []
        for row, value in reversed(changed):
            with suppress(InstrumentError):
                self._put(row, value)

    def _take_over(self, row: WantedSetting) -> None:
        found = self._answer(row)
        if found is None:
            return
        right = not row.wanted or matches(found, row.wanted)
        wanted = row.wanted[0] if row.wanted else ""
        shown = wanted if right and wanted else found
        if right:
            self._found.append(FoundSetting(row.query, shown, wanted, row.effect))
            return
        if not row.command or matches(found, row.busy):
            raise self._refused(row, found, row.remedy)
        self._changed.append((row, found))
        self._put(row, wanted)
        kept = self._ask(row).strip()
        if not matches(kept, (*row.wanted, *row.rounded)):
            raise self._refused(row, kept, row.remedy or _AT_THE_INSTRUMENT)
        self._found.append(FoundSetting(row.query, found, wanted, row.effect, changed=True))

    def _answer(self, row: WantedSetting) -> str | None:
        try:
            return self._ask(row).strip()
        except ReportedError:
            if row.optional:
                return None
            raise

    def _refused(self, row: WantedSetting, found: str, remedy: Text | str) -> ReportedError:
        return ReportedError(
            self._name,
            text(
                "it is set to {found}, but {wanted} is needed: {effect}",
                found=found,
                wanted=" or ".join(row.wanted),
                effect=row.effect,
            ),
            command=row.query,
            remedy=remedy,
        )


def matches(found: str, wanted: Iterable[str]) -> bool:
    """Say whether an answer is one of those wanted: as a number, or as a word in its short or its long form."""
    return any(_same(found.strip('" '), value) for value in wanted)


def _same(found: str, wanted: str) -> bool:
    try:
        numbers = float(found), float(wanted)
        return numbers[0] == numbers[1] or all(map(math.isnan, numbers))
    except ValueError:
        pass
    found, wanted = found.upper(), wanted.upper()
    # A long form begins with the short one; two letters (ON) have no long form.
    return found == wanted or (len(wanted) > 2 and wanted.isalpha() and found.startswith(wanted) and found.isalpha())


def _nothing(row: WantedSetting, value: str) -> None:
    """Set nothing: for tables that only tell."""
