"""ASAM MDF4: every waveform of a run, a channel group a record, with the parameters as the file's comment."""

import io
from collections.abc import Iterable
from datetime import datetime

from reports.exports.files import csv_file
from reports.exports.target import Recorded, Target

#: The version of MDF4 that every tool reads: without compression of later ones.
_VERSION = "4.10"


def write_records(comment: str, started: str, records: Iterable[Recorded]) -> bytes:
    """Return the file's content; `started` is when the run began (ISO 8601). Raises ImportError without asammdf.

    Time is each record's own, in s.
    """
    # An extra, and slow to import.
    from asammdf import MDF, Signal

    stream = io.BytesIO()
    with MDF(version=_VERSION) as file:
        file.start_time = datetime.fromisoformat(started)
        file.header.comment = comment
        for record in records:
            # One time axis a group: channels of others stand in groups of their own.
            groups: dict[bytes, list[Signal]] = {}
            for name, waveform in record.waveforms.items():
                words = [f"resolution {waveform.resolution:.6g} {waveform.unit}"] if waveform.resolution else []
                words += ["clipped"] if waveform.clipped else []
                signal = Signal(waveform.values, waveform.time, name=name, unit=waveform.unit, comment=", ".join(words))
                groups.setdefault(waveform.time.tobytes(), []).append(signal)
            for signals in groups.values():
                file.append(signals, acq_name=record.name, comment=record.name, common_timebase=True)
        file.save(stream, overwrite=True)
    return stream.getvalue()


TARGET = Target("mdf4", "ASAM MDF4, waveforms", ".mf4", (), csv_file.write, write_records=write_records)
