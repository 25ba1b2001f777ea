"""The oscilloscope whose records are handed over as files, as a driver."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.catalogue import Driver
from drivers.interfaces import Role
from drivers.manual.options import ManualOscilloscopeOptions


@dataclass(frozen=True)
class CaptureFilesOptions(ManualOscilloscopeOptions):
    """An oscilloscope set by a person, whose records come as files.

    A record is what is new in `folder` once the person has saved it; or `files` are taken one after the other, several of one record
    joined by `+`. `columns` names a channel's column where it is not CH1, C1 …; `scales` multiplies a channel, for a probe that was set
    wrongly. `amplitude_accuracy` is that of the samples.
    """

    model: str = "oscilloscope read from files"
    folder: str = "captures"
    files: tuple[str, ...] = ()
    columns: Mapping[int, str] = field(default_factory=dict)
    scales: Mapping[int, float] = field(default_factory=dict)


CAPTURE_FILES = Driver(
    "capture-files",
    Role.OSCILLOSCOPE,
    CaptureFilesOptions,
    "bench.captures.oscilloscope:open_capture_files",
    needs_address=False,
)
