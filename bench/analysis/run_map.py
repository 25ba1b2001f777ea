"""The flux map of a run's journal: what was read until the run ended, however it ended and was gone on with."""

from pathlib import Path

from bench.i18n.errors import InputError, at
from bench.journal.earlier_attempts import attempts_of
from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder
from drivers.interfaces.text import text
from procedures.estimation.flux.estimator import FluxMapEstimate
from procedures.estimation.flux.session_ties import BrokenTie
from procedures.techniques.maps.earlier import earlier_points, earlier_readings
from procedures.techniques.maps.estimates import joined
from procedures.techniques.maps.readings import MapReadings

_NAME, _STANDSTILL = "flux-map", "flux-map-standstill"


def map_of_run(path: Path) -> tuple[FluxMapEstimate, BrokenTie | None]:
    """Return the map of the readings in a run's journal, those of all sessions that belong together, and the contradiction where they do
    not: the map is then of the session that read most.

    Raises InputError where there is no journal or no reading, EstimationError where they are too few for a map.
    """
    events = read_journal(RunFolder(path).journal).events
    found = attempts_of(events, [_NAME, _STANDSTILL])
    attempts = found.get(_NAME, ())
    taken = earlier_readings(attempts)
    if not taken.points:
        # None has enough of them to be tied to another.
        alone = max((earlier_points(attempt, 0) for attempt in attempts), key=len, default=())
        taken = MapReadings(list(alone))
    if not taken.points and _STANDSTILL in found:
        raise InputError(
            at(
                str(path),
                text(
                    "the run has strokes of flux-map-standstill only, of which its procedure alone makes a map: measure it again with "
                    "motorbench run --resume {path}; a run that was aborted has its flux_map.csv already",
                    path=str(path),
                ),
            )
        )
    if not taken.points:
        raise InputError(
            at(str(path), text("the run has no readings of flux-map; name a run of that procedure, or a table"))
        )
    _, made, broken = joined(taken, symmetric=None)
    return made, broken
