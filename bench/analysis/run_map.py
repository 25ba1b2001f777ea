"""The flux map of a run's journal: what was read until the run ended, however it ended and was gone on with."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bench.analysis.run_strokes import STANDSTILL, kept_strokes, standstill_map
from bench.i18n.errors import InputError, at
from bench.journal.codec import RecordedEvent
from bench.journal.earlier_attempts import attempts_of
from bench.journal.finished_run import read_run
from drivers.interfaces.text import text
from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit
from procedures.estimation.flux.flux_map import MeasuredFluxMap
from procedures.estimation.flux.session_ties import BrokenTie
from procedures.techniques.maps.earlier import earlier_points, earlier_readings
from procedures.techniques.maps.estimates import joined
from procedures.techniques.maps.readings import MapReadings
from procedures.techniques.maps.shaft_torque import ShaftTorque, shaft_torque

_NAME = "flux-map"


@dataclass(frozen=True)
class RunMap:
    """A map made of a run's journal, with what its readings show beyond the model.

    `pole_pairs` are those that were given, else the run's, None where neither has them. `torque` compares the shaft's with the map's,
    where there is one; `broken` is the contradiction of sessions that do not belong together: the map is then of the one that read most.
    """

    map: MeasuredFluxMap
    pole_pairs: float | None
    details: Mapping[str, Any]
    misfit: Misfit = NO_MISFIT
    torque: ShaftTorque | None = None
    broken: BrokenTie | None = field(default=None)


def map_of_run(path: Path, pole_pairs: float | None = None, *, standstill: bool = False) -> RunMap:
    """Return the map of the readings of flux-map in a run's journal; of the strokes of flux-map-standstill where there are none of
    the former, or where `standstill` asks for these.

    Raises InputError where there is no journal or nothing of a map in it, EstimationError where it is too little for a map.
    """
    run = read_run(str(path), path.parent)
    counted = run.view.parameters().parameters.get("pole_pairs")
    plate = run.nameplate.pole_pairs or run.nameplate.expected.get("pole_pairs")
    pairs = pole_pairs or (counted.value if counted else plate)
    taken = MapReadings() if standstill else _readings(run.events)
    if taken.points:
        kept, made, broken = joined(taken, symmetric=None)
        torque = None if pairs is None else shaft_torque(made, kept, pairs)
        details = {
            "readings": made.fit.residuals.size // 2,
            "symmetric": made.symmetric,
            "symmetry_tested": made.symmetry_tested,
            **({} if torque is None else {"torque_ratio": torque.ratio}),
        }
        whole = made.map if torque is None else torque.held_by(made.map)
        return RunMap(whole, pairs, details, made.misfit, torque, broken)
    strokes = kept_strokes(run.events)
    if not strokes:
        raise InputError(
            at(
                str(path),
                text(
                    "the run has no readings of {procedure}; name a run of that procedure, or a table",
                    procedure=STANDSTILL if standstill else _NAME,
                ),
            )
        )
    still = standstill_map(path, strokes)
    return RunMap(still.map, pairs, {"trains": len(strokes), "symmetric": True, "symmetry_tested": False})


def _readings(events: Sequence[RecordedEvent]) -> MapReadings:
    """Return the readings of all sessions that can be tied, else those of the session that has most."""
    attempts = attempts_of(events, [_NAME]).get(_NAME, ())
    taken = earlier_readings(attempts)
    if taken.points:
        return taken
    # None has enough of them to be tied to another.
    alone = max((earlier_points(attempt, 0) for attempt in attempts), key=len, default=())
    return MapReadings(list(alone))
