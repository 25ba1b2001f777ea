"""Report by `station check` of each procedure: whether the station has what it needs, and its questions to people."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from bench.run.console import console_on
from bench.run.needs import asked, unmet
from bench.run.plan import make_plan
from bench.station.station_file import Station
from drivers.interfaces.text import Text, Translate, lines, text


@dataclass(frozen=True)
class ProcedureNeeds:
    """A procedure held against a station: what is missing, what people are asked, and whether it takes instruments."""

    name: str
    missing: Sequence[Text]
    asked: Sequence[Text]
    instruments: bool

    def as_dict(self, translate: Translate) -> dict[str, Any]:
        """Return it in JSON's types."""
        return {
            "missing": [one.render(translate) for one in self.missing],
            "asked": [one.render(translate) for one in self.asked],
        }


def outlooks(station: Station, names: Sequence[str], assignments: Sequence[str]) -> list[ProcedureNeeds]:
    """Return the outlook of the procedures named, of all measurements where none is. Raises UsageError, InputError as a run does."""
    catalogue = station.catalogues.procedures
    plan = make_plan(names or ("all",), assignments, catalogue)
    return [
        ProcedureNeeds(each.name, unmet(each, station), asked(each, station), bool(each.procedure.roles))
        for each in plan
    ]


def good(found: Sequence[ProcedureNeeds], *, named: bool) -> bool:
    """Tell whether every procedure that was named can run, or any that takes instruments where none was."""
    if named:
        return not any(each.missing for each in found)
    return any(not each.missing and each.instruments for each in found)


def print_outlooks(found: Sequence[ProcedureNeeds], translate: Translate) -> None:
    """Print a line a procedure: what it asks of people, or what the station lacks for it."""
    console = console_on(sys.stdout)
    console.print(text("Procedures, by the station file").render(translate), style="bold", markup=False)
    for each in found:
        mark, said = ("✗", each.missing) if each.missing else ("✓", each.asked)
        console.print(
            f"  {mark} {each.name:<30}{lines(said, between='; ').render(translate)}", markup=False, soft_wrap=True
        )
    rest = text("For the limits of a certain motor: motorbench run PROCEDURE … --rehearse")
    console.print(f"  {rest.render(translate)}", markup=False)
