"""motorbench's own waveforms, as a run keeps them."""

from pathlib import Path

import numpy as np

from bench.captures.capture import Capture, CaptureChannel, CaptureError
from bench.captures.text import BEYOND
from bench.journal.waveforms import StoredWaveform, read_waveform, waveform_names
from drivers.interfaces.text import text


def read_hdf5(path: Path, selected: str = "") -> Capture:
    """Return the waveforms of a file, or those under the group `selected`. Raises CaptureError where times differ."""
    try:
        there = waveform_names(path)
        names = [n for n in there if not selected or n == selected or n.startswith(selected.rstrip("/") + "/")]
        waveforms = {name: read_waveform(path, name) for name in names}
    except (OSError, KeyError, ValueError, TypeError, RuntimeError) as error:
        raise CaptureError(str(path), text("cannot be read as HDF5 with waveforms: {error}", error=error)) from error
    if not there:
        raise CaptureError(
            str(path),
            text(
                "holds no waveforms as motorbench writes them, and of HDF5 nothing else is read; save the arrays as .mat (v7), .npz or CSV"
            ),
        )
    if not waveforms:
        raise CaptureError(
            str(path),
            text(
                "the file contains no waveform '{selected}'; choose one of: {names}",
                selected=selected,
                names=list(there),
            ),
        )
    reference = next(iter(waveforms.values()))
    for name, waveform in waveforms.items():
        _check(path, name, waveform)
        if waveform.time.shape != reference.time.shape or not np.allclose(
            waveform.time, reference.time, rtol=0, atol=1e-12
        ):
            raise CaptureError(
                str(path),
                text(
                    "waveforms {first} and {name} have different times; choose one record by {file}#NAME, of: {names}",
                    first=names[0],
                    name=name,
                    file=path.name,
                    names=names,
                ),
            )
    # Every driver couples DC, and says where a record clipped.
    channels = tuple(
        CaptureChannel(name, w.unit, w.values, w.resolution, w.clipped, "dc", w.full_scale)
        for name, w in waveforms.items()
    )
    return Capture(channels, reference.time, str(path), "motorbench HDF5")


def _check(path: Path, name: str, waveform: StoredWaveform) -> None:
    if waveform.time.size < 2:
        raise CaptureError(str(path), text("waveform {name} holds fewer than two samples", name=name))
    if not (np.all(np.abs(waveform.time) < BEYOND) and np.all(np.abs(waveform.values) < BEYOND)):
        raise CaptureError(
            str(path), text("waveform {name} holds values that are not finite numbers; retake it", name=name)
        )
    if np.any(np.diff(waveform.time) <= 0):
        raise CaptureError(str(path), text("waveform {name}: time does not increase; retake it", name=name))
