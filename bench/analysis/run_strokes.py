"""The map at standstill of a run's journal: of the records of strokes that its procedure had kept until the run ended."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.i18n.errors import InputError, at
from bench.journal.codec import RecordedEvent
from bench.journal.events.instruments import ReadingTaken, WaveformsTaken
from bench.journal.events.run import ProcedureStarted
from bench.journal.waveforms import StoredWaveform, read_waveform
from drivers.interfaces import DqSample
from drivers.interfaces.text import text, text_of
from procedures.core.events import StrokesKept
from procedures.estimation.flux.gain_ratio import KnownResistance
from procedures.estimation.flux.standstill import StandstillGains, StandstillMap, fit_standstill
from procedures.estimation.flux.stroke_train import StrokeTrain
from procedures.techniques.maps.stroke_records import train_of

STANDSTILL = "flux-map-standstill"
_STROKES = "alternate_dq_current"


@dataclass(frozen=True)
class KeptStrokes:
    """A record that counts: what the inverter reported of its strokes, the record's event, and what the map takes besides."""

    samples: Sequence[Any]
    record: WaveformsTaken
    kept: StrokesKept


def kept_strokes(events: Iterable[RecordedEvent]) -> Sequence[KeptStrokes]:
    """Return the records of the attempt at a map at standstill that has most of them, the latest of such; none where there are none."""
    attempts: list[list[KeptStrokes]] = [[]]
    samples: Sequence[Any] = ()
    record: WaveformsTaken | None = None
    for recorded in events:
        match recorded.event:
            case ProcedureStarted():
                attempts.append([])
            case ReadingTaken(call=call, value=value) if call == _STROKES:
                samples, record = value, None
            case WaveformsTaken() as taken:
                record = taken
            case StrokesKept() as kept if record is not None:
                attempts[-1].append(KeptStrokes(samples, record, kept))
    return max(reversed(attempts), key=len)


def standstill_map(folder: Path, strokes: Sequence[KeptStrokes]) -> StandstillMap:
    """Return the map of records of strokes in a run's folder.

    Raises InputError where a record is not there or not whole, EstimationError where they are too few for a map.
    """
    last = strokes[-1].kept
    gains = StandstillGains(last.voltage_gain, last.current_gain, last.u_flux_linkage)
    known = KnownResistance(last.resistance, last.u_resistance) if last.resistance else None
    return fit_standstill([_train(folder, each) for each in strokes], last.flux_linkage, gains, known)


def _train(folder: Path, strokes: KeptStrokes) -> StrokeTrain:
    file = folder / strokes.record.file.path
    channel_gains = strokes.kept.channel_gains
    try:
        waves = [
            _divided(read_waveform(file, strokes.record.value[channel]["waveform"]), gain)
            for channel, gain in channel_gains.items()
        ]
        samples = [DqSample(**{name: float(value) for name, value in each.items()}) for each in strokes.samples]
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        message = text("no whole record of the strokes is here: {why}", why=text_of(error))
        raise InputError(at(str(file), message)) from error
    count = min(values.size for _, values, _ in waves)
    step = max(resolution for _, _, resolution in waves)
    return train_of(
        waves[0][0], np.array([values[:count] for _, values, _ in waves]), samples, step, locked=strokes.kept.locked
    )


def _divided(wave: StoredWaveform, gain: float) -> tuple[Any, Any, float]:
    return wave.time, wave.values / gain, wave.resolution / gain
