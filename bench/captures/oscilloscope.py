"""An oscilloscope whose records are the files that a person saved of it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from bench.captures.capture import Capture, CaptureChannel, CaptureError
from bench.captures.catalogue import CaptureFilesOptions
from bench.captures.reading import read_captures
from bench.i18n.errors import InputError
from drivers.catalogue import Surroundings
from drivers.interfaces import Accuracy, ChannelSettings, Clock, MeasurementError, Waveform
from drivers.interfaces.text import Text, lines, text
from drivers.manual.oscilloscope import ManualOscilloscope
from drivers.manual.prompt import ATTEMPTS, Prompt

#: A file that has not grown for so long (s) is complete.
_COMPLETE = 0.5


class CaptureFilesOscilloscope(ManualOscilloscope):
    """An oscilloscope set by hand whose records are read from files."""

    def __init__(
        self, prompt: Prompt, clock: Clock, options: CaptureFilesOptions, *, name: str = "oscilloscope"
    ) -> None:
        super().__init__(prompt, clock, options, name=name)
        self._files = options
        self._left = list(options.files)
        self._seen: dict[Path, tuple[int, int]] = {}

    @property
    def gives_waveforms(self) -> bool:
        """The files hold samples."""
        return True

    def configure_channel(self, channel: int, settings: ChannelSettings) -> None:
        """Ask for a channel to be switched on, its trace filling the screen; raises SetpointError for one without a probe."""
        unit = self._unit(channel)
        self._questions.confirm(
            text(
                "Switch channel {channel} on, DC coupled. Set its range so that the trace fills the screen without leaving it; "
                "expected is {range:.3g} {unit} over the whole screen, {offset:.3g} {unit} in its middle.",
                channel=channel,
                range=settings.range,
                offset=settings.offset,
                unit=unit,
            )
        )

    def initiate(self) -> None:
        """Ask for the instrument to be armed; files that are in the folder already are not the coming record."""
        self._seen = self._present()
        super().initiate()

    def fetch(self, channels: Sequence[int], timeout: float) -> dict[int, Waveform]:
        """Ask for the record to be saved, and return it (V or A, time in s from the trigger as the file has it).

        Raises MeasurementError where no file came that holds these channels, naming what was wrong with the last one, or where
        no accuracy is stated.
        """
        stated = {channel: self._stated(channel) for channel in channels}
        if self._files.files:
            if not self._left:
                count = len(self._files.files)
                raise self._failed(text("all {count} files are used, and one more record is needed", count=count))
            taken = self._left.pop(0)
            try:
                return self._waveforms(read_captures(taken.split("+")), stated)
            except InputError as error:
                raise self._failed(error.text) from error
        said: Text | None = None
        task = text(
            "Save the record with channels {channels} as CSV into the folder {folder}.",
            channels=list(channels),
            folder=str(self._folder),
        )
        for _ in range(ATTEMPTS):
            self._questions.confirm(task if said is None else lines((said, task), " "))
            new = self._new()
            try:
                if not new:
                    raise CaptureError(str(self._folder), text("there is no new file"))
                return self._waveforms(read_captures(new), stated)
            except InputError as error:
                said = error.text
        raise self._failed(said or task)

    @property
    def _folder(self) -> Path:
        return Path(self._files.folder).expanduser()

    def _present(self) -> dict[Path, tuple[int, int]]:
        """Return size and time of change of each file in the folder."""
        try:
            files = [path for path in self._folder.iterdir() if path.is_file() and not path.name.startswith((".", "~"))]
            return {path: (path.stat().st_size, path.stat().st_mtime_ns) for path in files}
        except OSError:
            # A folder that is not there holds no file; who saves into it makes it, or is told below that nothing came.
            return {}

    def _new(self) -> list[Path]:
        """Return the files that came or changed since, by name, once they do not grow any more."""
        present = self._present()
        while True:
            self._clock.sleep(_COMPLETE)
            later = self._present()
            if later == present:
                break
            present = later
        new = sorted(path for path, state in present.items() if self._seen.get(path) != state)
        self._seen = present
        return new

    def _stated(self, channel: int) -> Accuracy:
        self._unit(channel)
        result = self._options.amplitude_accuracy.get(channel)
        return self._questions.stated(result, text("amplitude on channel {channel}", channel=channel))

    def _waveforms(self, capture: Capture, stated: dict[int, Accuracy]) -> dict[int, Waveform]:
        even = capture.evenly_sampled()
        return {channel: self._waveform(even, channel, accuracy) for channel, accuracy in stated.items()}

    def _waveform(self, capture: Capture, channel: int, accuracy: Accuracy) -> Waveform:
        unit = self._unit(channel)
        column = self._column(capture, channel)
        if column.unit not in ("", unit):
            raise CaptureError(
                capture.source,
                text(
                    "column {column} is in {given}, and the station's probe on channel {channel} in {unit}; correct "
                    "columns.{channel} or probes.{channel} in the station file",
                    column=column.name,
                    given=column.unit,
                    channel=channel,
                    unit=unit,
                ),
            )
        if column.coupling == "ac":
            raise CaptureError(
                capture.source, text("column {column} is AC coupled; record it with DC coupling", column=column.name)
            )
        scale = self._files.scales.get(channel, 1.0)
        return Waveform(
            channel,
            capture.times(),
            scale * column.values,
            unit,
            abs(scale) * column.resolution,
            replace(accuracy, gain=accuracy.gain + column.rounding),
            clipped=column.clipped is True,
        )

    def _column(self, capture: Capture, channel: int) -> CaptureChannel:
        named = self._files.columns.get(channel)
        try:
            return capture.channel(named or f"CH{channel}")
        except CaptureError:
            names = [each.name for each in capture.channels]
            raise CaptureError(
                capture.source,
                text(
                    "no column {column} was found for channel {channel}; the columns are {names}. Name the right "
                    "one as columns.{channel} in the station file",
                    column=named or f"CH{channel}",
                    channel=channel,
                    names=names,
                ),
            ) from None

    def _failed(self, said: Text) -> MeasurementError:
        return MeasurementError(
            self._name, said, remedy=text("Save the record again, or check folder and files in the station file")
        )


def open_capture_files(
    _: str, options: CaptureFilesOptions, surroundings: Surroundings, name: str
) -> CaptureFilesOscilloscope:
    """Return the oscilloscope; there is no connection, so that an address says nothing."""
    return CaptureFilesOscilloscope(surroundings.person(), surroundings.clock, options, name=name)
