"""Options that say which batch is meant where several have one name; every command that takes batches by name has them."""

import sys
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import Parameter

from bench.i18n.errors import UsageError
from drivers.interfaces.text import Text, Translate, text

if TYPE_CHECKING:
    from bench.eol.narrowing import Narrowing


@Parameter(name="*")
@dataclass(frozen=True)
class NarrowingOptions:
    """Which of the batches of one name are meant.

    Parameters
    ----------
    station
        Only tests at the station of this name.
    since
        Only tests begun on this day or later, YYYY-MM-DD.
    until
        Only tests begun on this day or earlier, YYYY-MM-DD.
    runs
        Only the batches whose folders are in this folder of runs.

    """

    station: str = ""
    since: str = ""
    until: str = ""
    runs: Path | None = None

    def read(self) -> "Narrowing":
        """Return what was typed. Raises UsageError."""
        # Not before a command asks for records: a page of help needs no database.
        from bench.eol.narrowing import Narrowing

        since, until = _day("--since", self.since), _day("--until", self.until)
        if since is not None and until is not None and since > until:
            raise UsageError(text("--since {since} --until {until}: no day lies there", since=since, until=until))
        return Narrowing(self.station, since, until, self.runs)


#: Nothing is left out.
ALL_RECORDS = NarrowingOptions()


def tell_joined(joined: Text | None, translate: Translate) -> None:
    """Say on the standard error stream that several batches of one name are taken together, if they are, and how one is chosen."""
    if joined is not None:
        words = text(
            "{joined}. To choose one: --station NAME, --since DAY and --until DAY, or --runs with the folder of its runs",
            joined=joined,
        )
        print(f"motorbench: {words.render(translate)}", file=sys.stderr)


def _day(option: str, typed: str) -> date | None:
    try:
        return date.fromisoformat(typed) if typed else None
    except ValueError:
        raise UsageError(
            text("{option} {typed}: give a day as YYYY-MM-DD, as in 2026-11-24", option=option, typed=typed)
        ) from None
