"""Waveforms of a run in one HDF5 file: a group each, with datasets `time` and `values` and attributes `unit`, `resolution`."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

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
    """Samples as read back: `time` (s) and `values` (n,) in `unit`; `resolution` one converter step; `channel` 0 if unknown."""

    time: FloatArray
    values: FloatArray
    unit: str
    resolution: float
    channel: int = 0
    clipped: bool = False


class WaveformStore:
    """One file of waveforms, opened for each access only, so that a killed run leaves it whole between writes."""

    def __init__(self, path: Path) -> None:
        self.path = Path(path)

    @contextmanager
    def _file(self, mode: str) -> Iterator[Any]:
        # Slow to import, and most commands need no waveform.
        import h5py

        with h5py.File(self.path, mode) as file:
            yield file

    def write(self, name: str, waveform: WaveformLike) -> str:
        """Keep a waveform under a name ("back_emf/1"; numbered where taken) and return its reference `file.h5#name`."""

        def free(file: Any) -> str:
            chosen, number = name, 1
            while chosen in file:
                number += 1
                chosen = f"{name}-{number}"
            return chosen

        return self._write(free, waveform)

    def store(self, name: str, waveform: WaveformLike) -> str:
        """Keep one of an instrument's many waveforms under its name, numbered in order, and return the reference."""
        channel = int(getattr(waveform, "channel", 0))
        return self._write(lambda file: f"{name}/{1 + len(file.get(name, ())):04d}-channel{channel}", waveform)

    def _write(self, choose: Callable[[Any], str], waveform: WaveformLike) -> str:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self._file("a") as file:
            name = choose(file)
            group = file.create_group(name)
            for part in ("time", "values"):
                data = np.asarray(getattr(waveform, part), dtype=np.float64)
                group.create_dataset(part, data=data, compression="gzip", compression_opts=1, shuffle=True)
            group["time"].attrs["unit"] = "s"
            group.attrs["unit"] = waveform.unit
            group.attrs["resolution"] = float(waveform.resolution)
            group.attrs["channel"] = int(getattr(waveform, "channel", 0))
            group.attrs["clipped"] = bool(getattr(waveform, "clipped", False))
        return f"{self.path.name}#{name}"

    def names(self) -> list[str]:
        """Return the names of all waveforms, in order; none where the file does not exist yet."""
        if not self.path.exists():
            return []
        found: list[str] = []

        def visit(name: str, item: Any) -> None:
            if "values" in getattr(item, "keys", list)():
                found.append(name)

        with self._file("r") as file:
            file.visititems(visit)
        return sorted(found)

    def read(self, reference: str) -> StoredWaveform:
        """Return a waveform by name or reference. Raises KeyError where there is none of that name."""
        name = reference.rpartition("#")[2]
        with self._file("r") as file:
            if name not in file:
                raise KeyError(f"no waveform '{name}' in {self.path.name}")
            group = file[name]
            return StoredWaveform(
                time=np.asarray(group["time"], dtype=np.float64),
                values=np.asarray(group["values"], dtype=np.float64),
                unit=str(group.attrs.get("unit", "")),
                resolution=float(group.attrs.get("resolution", 0.0)),
                channel=int(group.attrs.get("channel", 0)),
                clipped=bool(group.attrs.get("clipped", False)),
            )
