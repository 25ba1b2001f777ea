"""The flux map of a run's journal: what was read until the run ended, however it ended."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bench.i18n.errors import InputError, at
from bench.journal.events.instruments import InstrumentCall, ReadingTaken
from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder
from drivers.interfaces.text import text
from procedures.core.events import StepStarted
from procedures.estimation.flux.estimator import FluxMapEstimate, estimate_flux_map
from procedures.estimation.flux.flux_map import TRUSTED_DELAY, GainLimits
from procedures.estimation.flux.readings import FluxReadings

#: The step of `flux-map` in which its readings are taken.
_READS = "M1/3"
_SETS = ("driving_dq_current", "set_dq_current")


@dataclass
class _Taken:
    """Readings of one attempt, with the currents (A) that were asked for."""

    readings: list[dict[str, Any]] = field(default_factory=list)
    wanted: list[tuple[float, float]] = field(default_factory=list)


def map_of_run(path: Path) -> FluxMapEstimate:
    """Return the map of the readings in a run's journal, of the attempt that has most of them.

    Raises InputError where there is no journal or no reading, EstimationError where they are too few for a map.
    """
    folder = RunFolder(path)
    taken = max(_attempts(folder), key=lambda each: len(each.readings), default=_Taken())
    if not taken.readings:
        raise InputError(
            at(str(path), text("the run has no readings of flux-map; name a run of that procedure, or a table"))
        )

    def column(name: str) -> list[float]:
        return [float(reading[name]) for reading in taken.readings]

    readings = FluxReadings.of(
        column("time"), column("d_current"), column("q_current"), column("d_voltage"), column("q_voltage"),
        column("electrical_speed"),
    )  # fmt: skip
    last = taken.readings[-1]
    voltage, current = (float(last[name].get("gain", 0.0)) for name in ("voltage_accuracy", "current_accuracy"))
    gains = GainLimits(voltage, current, delay=TRUSTED_DELAY)
    return estimate_flux_map(readings, gains=gains, wanted=np.array(taken.wanted))


def _attempts(folder: RunFolder) -> Iterator[_Taken]:
    taken: _Taken | None = None
    wanted = (0.0, 0.0)
    for recorded in read_journal(folder.journal).events:
        event = recorded.event
        if isinstance(event, StepStarted):
            if taken is not None:
                yield taken
            taken = _Taken() if event.step == _READS else None
        elif taken is None or not isinstance(event, InstrumentCall) or event.instrument != "inverter":
            continue
        elif event.call in _SETS and len(event.arguments) == 2:
            wanted = (float(event.arguments[0]), float(event.arguments[1]))
        elif isinstance(event, ReadingTaken) and event.call == "measure_dq":
            taken.readings.append(event.value)
            taken.wanted.append(wanted)
    if taken is not None:
        yield taken
