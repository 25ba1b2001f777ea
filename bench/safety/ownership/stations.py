"""Stations taken as a whole, each instrument of theirs before anything is opened."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager

from bench.safety.ownership.claims import claims_of
from bench.safety.ownership.owner import Owner, owning
from bench.safety.ownership.state_folder import state_folder
from bench.station.station_file import Station


@contextmanager
def owning_stations(stations: Collection[Station], what: str) -> Iterator[Owner | None]:
    """Give the one owner of all their instruments; `what` is the command that it runs.

    None where hands do everything and no contact's trip is to be kept. Raises HeldError naming who has one of them,
    InputError where that cannot be told.
    """
    claims = [claim for station in stations for claim in claims_of(station)]
    if not claims and not any(station.interlocks for station in stations):
        yield None
        return
    with owning(state_folder(), what) as owner:
        owner.claim(claims)
        yield owner
