"""Waveforms of a run: one HDF5 file for each record, written at once, so that a killed run leaves no incomplete file.

A file holds a group for each channel, with datasets `time` and `values` and attributes `unit`, `resolution`, `channel`, `clipped`,
`full_scale` (0 where unknown).
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bench.journal.disk import write_file
from bench.journal.errors import RecordError

#: No record holds more samples; a broken file may claim any number.
MOST_SAMPLES = 100_000_000

FloatArray = NDArray[np.float64]


class WaveformLike(Protocol):
    """Anything with samples: time (s) and values (n,), unit, one converter step."""

    @property
    def time(self) -> FloatArray:
        """Time of each sample (s)."""

    @property
    def values(self) -> FloatArray:
        """Samples."""

    @property
    def unit(self) -> str:
        """Unit of the samples."""

    @property
    def resolution(self) -> float:
        """One step of the converter, in that unit."""


@dataclass(frozen=True)
class StoredWaveform:
    """Samples as read back: `time` (s) and `values` (n,) in `unit`; `resolution` one converter step;
    `channel` and `full_scale` 0 if unknown.
    """

    time: FloatArray
    values: FloatArray
    unit: str
    resolution: float
    channel: int = 0
    clipped: bool = False
    full_scale: float = 0.0


@dataclass(frozen=True)
class StoredRecord:
    """A file of waveforms: its path from the run's folder, its SHA-256 and its length (bytes)."""

    path: str
    sha256: str
    length: int

    def reference(self, name: str) -> str:
        """Return what finds one of its waveforms again."""
        return f"{self.path}#{name}"


class EveryWaveform:
    """Keeps the waveforms of a run, all of them."""

    def sink(self, folder: Path, *, durable: bool) -> "WaveformFolder":
        """Return a folder that stores each of them."""
        return WaveformFolder(folder, durable=durable)


class WaveformFolder:
    """The records of one run, numbered in the order they were taken; where `durable`, each is on the disk once stored."""

    def __init__(self, path: Path, *, durable: bool = True) -> None:
        self.path = Path(path)
        self._durable = durable

    def store(self, name: str, waveforms: Mapping[str, WaveformLike]) -> StoredRecord:
        """Keep the waveforms of one record, by channel name. Raises RecordError."""
        content = file_image(waveforms)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            # A record that a killed run had no time to note keeps its number.
            numbers = [found.name.partition("-")[0] for found in self.path.iterdir()]
        except OSError as error:
            raise RecordError(self.path, error) from error
        number = 1 + max((int(number) for number in numbers if number.isdecimal()), default=0)
        path = self.path / f"{number:04d}-{name}.h5"
        write_file(path, content, durable=self._durable)
        return StoredRecord(f"{self.path.name}/{path.name}", hashlib.sha256(content).hexdigest(), len(content))


class LateWaveforms:
    """Keeps records in memory until it is known whether they are needed; the journal lists them without a hash."""

    def __init__(self, path: Path, *, durable: bool = True) -> None:
        self._folder = WaveformFolder(path, durable=durable)
        self._held: list[tuple[str, Mapping[str, WaveformLike]]] = []

    def store(self, name: str, waveforms: Mapping[str, WaveformLike]) -> StoredRecord:
        """Hold the waveforms of one record."""
        self._held.append((name, waveforms))
        return StoredRecord(f"{self._folder.path.name}/{len(self._held):04d}-{name}.h5", "", 0)

    def write(self) -> list[StoredRecord]:
        """Write them, under the names that stand in the journal. Raises RecordError."""
        return [self._folder.store(name, waveforms) for name, waveforms in self._held]


class NoWaveforms:
    """Stores nothing: the journal lists the records, but there are no files."""

    def store(self, name: str, waveforms: Mapping[str, WaveformLike]) -> StoredRecord:
        """Keep nothing."""
        return StoredRecord("", "", 0)


def file_image(waveforms: Mapping[str, WaveformLike]) -> bytes:
    """Return an HDF5 file with these waveforms.

    It is made in memory: HDF5 that cannot write to its file leaves it broken, and may take the process with it.
    """
    # Slow to import, and most commands need no waveform.
    import h5py

    with h5py.File("waveforms.h5", "w", driver="core", backing_store=False) as file:
        axis: FloatArray | None = None
        times: Any = None
        for name, waveform in waveforms.items():
            group = file.create_group(name)
            if axis is not None and np.array_equal(axis, waveform.time):
                # One time axis serves all channels of a record.
                group["time"] = times
            else:
                axis, times = waveform.time, _dataset(group, "time", waveform.time)
                times.attrs["unit"] = "s"
            _dataset(group, "values", waveform.values)
            group.attrs["unit"] = waveform.unit
            group.attrs["resolution"] = float(waveform.resolution)
            group.attrs["channel"] = int(getattr(waveform, "channel", 0))
            group.attrs["clipped"] = bool(getattr(waveform, "clipped", False))
            group.attrs["full_scale"] = float(getattr(waveform, "full_scale", 0.0))
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def waveform_names(path: Path) -> list[str]:
    """Return the names of all waveforms in a file, in order. Raises OSError, or RuntimeError, where it is no whole HDF5 file."""
    import h5py

    result: list[str] = []

    def visit(name: str, item: Any) -> None:
        if "values" in getattr(item, "keys", list)():
            result.append(name)

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return sorted(result)


def read_waveform(path: Path, reference: str) -> StoredWaveform:
    """Return a waveform by name or reference.

    Raises KeyError where there is none of that name, ValueError where it is no waveform, OSError or RuntimeError where
    the file is no whole HDF5 file.
    """
    import h5py

    name = reference.rpartition("#")[2]
    with h5py.File(path, "r") as file:
        if name not in file:
            raise KeyError(f"no waveform '{name}' in {path.name}")
        group = file[name]
        return StoredWaveform(
            time=_samples(group, "time"),
            values=_samples(group, "values"),
            unit=str(group.attrs.get("unit", "")),
            resolution=float(group.attrs.get("resolution", 0.0)),
            channel=int(group.attrs.get("channel", 0)),
            clipped=bool(group.attrs.get("clipped", False)),
            full_scale=float(group.attrs.get("full_scale", 0.0)),
        )


def _samples(group: Any, name: str) -> FloatArray:
    result = group[name]
    shape, kind = getattr(result, "shape", None), getattr(getattr(result, "dtype", None), "kind", "")
    if shape is None or len(shape) != 1 or kind not in "iuf" or shape[0] > MOST_SAMPLES:
        raise ValueError(f"{group.name}/{name} is no list of up to {MOST_SAMPLES} numbers")
    return np.asarray(result, dtype=np.float64)


def _dataset(group: Any, name: str, values: FloatArray) -> Any:
    data = np.asarray(values, dtype=np.float64)
    return group.create_dataset(name, data=data, compression="gzip", compression_opts=1, shuffle=True)
