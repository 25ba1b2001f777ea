"""`motorbench station reset`: runs are allowed again after an interlock was open."""

from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path

from bench.cli.options import Json, Language
from bench.cli.output import print_json
from bench.eol.line.preparation.line_file import load_line
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from bench.safety.interlocks import closed, stood
from bench.safety.ownership.claims import interlock_claims
from bench.safety.ownership.owner import owning
from bench.safety.ownership.state_folder import StateFolder, state_folder
from bench.safety.trip_latch import Latch, Trip
from bench.station.station_file import Station
from drivers.interfaces.text import text


def reset(station: Path, *, by: str, json: Json = False, language: Language = "auto") -> int:
    """Allow runs again after an interlock was open; all interlocks must be closed.

    Parameters
    ----------
    station
        The station file.
    by
        Name of the person who removed the cause, for the record.

    """
    if not by.strip():
        raise UsageError(text("--by NAME is missing: only a person resets an interlock, and the record keeps the name"))
    stations = [socket.station for socket in load_line(str(station), None).sockets if socket.station is not None]
    state = state_folder()
    with owning(state, "motorbench station reset") as owner, ExitStack() as watching:
        owner.claim(claim for read in stations for claim in interlock_claims(read))
        for read in stations:
            watching.enter_context(closed(read))
        trips = [trip for read in stations if (trip := _reset(state, read, by.strip())) is not None]
    if not trips and not any(read.interlocks for read in stations):
        raise UsageError(text("{station}: the station has no [interlocks]; there is nothing to reset", station=station))
    trip = trips[0] if trips else None
    if json:
        print_json({"reset": trip is not None, "trip": None if trip is None else asdict(trip)})
    else:
        was = (
            text("nothing to reset: no interlock has been open")
            if trip is None
            else text("reset by {person}: {stood}", person=by.strip(), stood=stood(trip))
        )
        print(was.render(translator(language_of(language))))
    return 0


def _reset(state: StateFolder, station: Station, by: str) -> Trip | None:
    """Reset what holds a station up. Raises InputError where its file names no contact that could be looked at."""
    latch = Latch(state, station)
    trip = None if station.interlocks else latch.standing()
    if trip is not None:
        raise UsageError(
            text(
                "{station}: {stood}, and this station file has no [interlocks]. Reset it with the station file "
                "that names the interlock",
                station=station.source,
                stood=stood(trip),
            )
        )
    return latch.reset(by)
