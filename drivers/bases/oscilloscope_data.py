"""Data of a SCPI oscilloscope: abilities and accuracies of its family, and the options of a station."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.interfaces import Accuracy, ProbeKind
from drivers.interfaces.full_scale import FULL_SCALE_READING
from drivers.interfaces.text import text

#: A channel whose gain is known worse than this says next to nothing.
LARGEST_GAIN = 0.5


@dataclass(frozen=True)
class OscilloscopeData:
    """Data of a family of oscilloscopes.

    `ranges` are the least and the greatest whole screen, `divisions` high (V at the input), `records` the shortest and the longest
    (s), `attenuations` the least and the greatest factor of a probe. A screen is `steps` of the converter high, one of which is
    `codes_per_step` of a record, or `fine_steps` times finer in the high-resolution mode; a code up to the first or from the second of
    `clipped` on is clipped. Limits of error: `gain` of full scale, `offset` in divisions, in V at the input, and as a share of the
    offset that is set, with where they are stated; `time_base` of a frequency.
    """

    ranges: tuple[float, float]
    records: tuple[float, float]
    maximum_sample_rate: float
    maximum_points: int
    clipped: tuple[int, int]
    steps: int
    gain: float
    gain_source: str
    offset: tuple[float, float, float]
    offset_source: str
    time_base: Accuracy
    codes_per_step: int = 1
    fine_steps: int = 1
    divisions: int = 8
    attenuations: tuple[float, float] = (1e-3, 1e4)

    @property
    def source(self) -> str:
        """The source of the limits of gain and offset."""
        return f"{self.gain_source}; {FULL_SCALE_READING}; {self.offset_source}"


@dataclass(frozen=True)
class Probe:
    """The probe on a channel: `attenuation` is what it senses (V or A) per volt at the oscilloscope's input.

    `gain` (relative) and `offset` (V or A at the tip) are its limits of error, `source` where they are stated. `serial_number` tells it
    from another of its kind: a verification holds for the one it was made with. `maximum_voltage` (V, peak) is what a voltage probe
    may be on by its data sheet.
    """

    kind: ProbeKind
    attenuation: float
    gain: float = 0.0
    offset: float = 0.0
    source: str = ""
    serial_number: str = ""
    maximum_voltage: float | None = None


@dataclass(frozen=True)
class OscilloscopeOptions:
    """Settings of an oscilloscope: the probe on each channel used, and calibrations.

    `full_scale_gain` (share of full scale) or `gain` (relative, of the reading) replaces the data sheet's limit of gain, for all
    channels; `gain_source` says who states it. `calibration` replaces, for a channel, the accuracy of oscilloscope and probe together.
    `poll_interval` (s) is the longest time between two looks at the acquisition's state once the record can be complete.
    """

    probes: Mapping[int, Probe] = field(default_factory=dict)
    serial_number: str | None = None
    calibration: Mapping[int, Accuracy] = field(default_factory=dict)
    poll_interval: float = 0.02
    full_scale_gain: float | None = None
    gain: float | None = None
    gain_source: str = ""

    def __post_init__(self) -> None:
        if self.gain is not None and self.full_scale_gain is not None:
            raise ValueError(
                text(
                    "gain and full_scale_gain: both limit the same error; give the calibrated gain (of the reading), or the data sheet's "
                    "(of full scale)"
                )
            )
        for name, limit in (("gain", self.gain), ("full_scale_gain", self.full_scale_gain)):
            if limit is not None and not 0.0 < limit <= LARGEST_GAIN:
                raise ValueError(
                    text(
                        "{name} = {limit:g}: allowed is a share above 0, up to {most:g}; 0.02 is 2 %",
                        name=name,
                        limit=limit,
                        most=LARGEST_GAIN,
                    )
                )
