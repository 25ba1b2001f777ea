"""Report by `station check` of simulated instruments that the station's drivers name and that do not exist."""

import sys
from collections.abc import Mapping
from typing import Any

from bench.run.console import console_on
from bench.station.station_file import Station
from bench.virtual.simulated_units import MissingCounterpart, missing_counterpart
from drivers.interfaces.text import Translate, text

Missing = Mapping[str, MissingCounterpart]


def missing_counterparts(station: Station) -> Missing:
    """Return what is missing by role. The bench itself needs none of it; only a slip of a declaration is to be put right."""
    found = {role.value: missing_counterpart(entry, station.catalogues) for role, entry in station.entries.items()}
    return {role: one for role, one in found.items() if one is not None}


def as_dict(missing: Missing, translate: Translate) -> dict[str, Any]:
    """Return it in JSON's types."""
    return {role: {"error": one.why.render(translate), "slip": one.slip} for role, one in missing.items()}


def print_missing(missing: Missing, translate: Translate) -> None:
    """Print a line for each: a slip is an error, what may not be installed is none."""
    for role, one in missing.items():
        said = (
            text("{role}: {why}; correct Driver(simulated=…)", role=role, why=one.why)
            if one.slip
            else text("{role}: {why}; until it is installed the station cannot be rehearsed", role=role, why=one.why)
        )
        mark = "✗" if one.slip else "!"
        console_on(sys.stdout).print(f"  {mark} {said.render(translate)}", markup=False, soft_wrap=True)
