"""Oscilloscope (IviScope)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from drivers.interfaces.declarations import in_units, question, reading, setting
from drivers.interfaces.identity import Accuracy, Instrument, Reading

if TYPE_CHECKING:
    # Every command imports the interfaces; most of them need no arrays.
    import numpy as np
    from numpy.typing import NDArray


class ProbeKind(Enum):
    """Quantity that a channel's probe senses."""

    VOLTAGE = "V"
    CURRENT = "A"


class AcquisitionType(Enum):
    """Kind of a sample: one of the converter's, or the mean of all since the last."""

    NORMAL = "NORM"
    HIGH_RESOLUTION = "HRES"


class Slope(Enum):
    """Edge that starts the record."""

    RISING = "POS"
    FALLING = "NEG"
    EITHER = "EITH"


@dataclass(frozen=True)
class ChannelSettings:
    """Full-scale `range` (peak to peak over the screen, V or A at the probe's tip) and `offset` (value at mid-screen)."""

    range: float
    offset: float = 0.0


@dataclass(frozen=True)
class Trigger:
    """Edge trigger: channel, level (V or A) and slope; `None` for the channel starts at once."""

    channel: int | None
    level: float = 0.0
    slope: Slope = Slope.RISING


@dataclass(frozen=True)
class Waveform:
    """Samples of one channel: `time` (s, shape (n,), 0 at the trigger) and `values` (V or A, shape (n,)).

    `resolution` is one step of the converter, `full_scale` the range in use (V or A, the whole screen; 0 where
    unknown). `clipped` tells that samples reached an end of the range.
    """

    channel: int
    time: "NDArray[np.float64]"
    values: "NDArray[np.float64]"
    unit: str
    resolution: float
    accuracy: Accuracy = field(default_factory=Accuracy)
    clipped: bool = False
    full_scale: float = 0.0


class Oscilloscope(Instrument, Protocol):
    """A digital oscilloscope with voltage and current probes fixed to its channels by the station file."""

    @property
    @question
    def gives_waveforms(self) -> bool:
        """True if `fetch` can give samples; otherwise (a person reads the screen) only the `measure_…` methods can be used."""

    @question
    def channels(self, kind: ProbeKind) -> Sequence[int]:
        """Return the numbers of the channels that have a probe of this kind, in order."""

    @question
    def maximum_voltage(self, channel: int) -> float | None:
        """Return the largest voltage (V, peak) allowed at the voltage probe of a channel, None if it is not stated."""

    @question
    def attenuation(self, channel: int) -> float | None:
        """Return what a channel's probe senses (V or A) per volt at the input, None if it is not stated."""
        return None

    @in_units(range="V|A", offset="V|A")
    @setting
    def configure_channel(self, channel: int, settings: ChannelSettings) -> None:
        """Set the vertical range and offset of a channel and switch it on."""

    @in_units(record_time="s")
    @setting
    def configure_acquisition(
        self,
        record_time: float,
        points: int,
        pre_trigger: float = 0.0,
        acquisition: AcquisitionType = AcquisitionType.NORMAL,
    ) -> None:
        """Set the record's length (s), the least number of points, and the share of it (0…1) before the trigger.

        In high resolution each sample is the mean of the converter's since the last, finer than one of its steps, where it has that.
        """

    @in_units(level="V|A")
    @setting
    def configure_trigger(self, trigger: Trigger) -> None:
        """Set the edge trigger."""

    @setting
    def initiate(self) -> None:
        """Arm for one record; returns as soon as the instrument waits for its trigger.

        Raises MeasurementError where no record was set up.
        """

    @in_units(timeout="s")
    @reading("V|A")
    def fetch(self, channels: Sequence[int], timeout: float) -> dict[int, Waveform]:
        """Wait for the record (at most `timeout` s of bench time) and return it.

        Raises MeasurementError where no trigger came, naming the channel and level waited for.
        """

    @reading("Hz")
    def measure_frequency(self, channel: int) -> Reading:
        """Return the frequency (Hz) of the trace of a channel.

        Raises MeasurementError where the screen shows none.
        """

    @reading("V|A")
    def measure_amplitude(self, channel: int) -> Reading:
        """Return half the peak-to-peak value (V or A) of the trace of a channel.

        Raises MeasurementError where the screen shows none, OverloadError where the trace leaves the screen.
        """
