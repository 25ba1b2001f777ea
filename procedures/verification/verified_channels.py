"""Gains of the oscilloscope's channels, probes included, as a verification on this bench found them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, cast

from drivers.interfaces import Accuracy, ChannelSettings, Oscilloscope, Waveform
from drivers.interfaces.text import Text, text

if TYPE_CHECKING:
    from procedures.core.result import Parameter

#: The procedure that finds them.
PROBE_VERIFICATION = "probe-verification"
#: The warning of a figure that rests on a record in another range.
RANGE_WARNING = "range-not-verified"
#: Two ranges are one within this, relative.
_SAME = 0.01
#: A range this much wider than the one asked for is taken where it is verified: the next of steps of 1, 2, 5, and one to spare.
_WIDER = 2.6
#: What a budget says of a record in another range than those verified.
_ELSEWHERE_SOURCE = "not verified in this range"
#: The procedure's setting of ranges by the unit of what a channel shows.
_SETTINGS = {"V": "voltage_ranges", "A": "current_ranges"}


@dataclass(frozen=True)
class VerifiedGain:
    """A channel's verified gain, known within ± `limit` (relative), in one range (full scale, V or A).

    `reference` says what it was held against.
    """

    channel: int
    range: float
    gain: float
    limit: float
    reference: str


class VerifiedChannels:
    """The gains that later measurements correct by; empty before a verification."""

    def __init__(self, gains: Sequence[VerifiedGain] = (), serial_number: str = "") -> None:
        self._gains = tuple(gains)
        self._serial_number = serial_number
        #: Channel, full scale and unit of the records that no verified range was there for.
        self._elsewhere: list[tuple[int, float, str]] = []

    def __bool__(self) -> bool:
        return bool(self._gains)

    @classmethod
    def of_findings(cls, findings: Mapping[str, Any]) -> "VerifiedChannels":
        """Return those that a verification's result holds; raises KeyError or TypeError for a result that is none."""
        return cls([VerifiedGain(**row) for row in findings["gains"]], findings["oscilloscope"])

    def findings(self) -> dict[str, Any]:
        """Return them as a result holds them."""
        return {"gains": [asdict(gain) for gain in self._gains], "oscilloscope": self._serial_number}

    def on(self, bare: Oscilloscope, stated: Oscilloscope) -> Oscilloscope:
        """Return the oscilloscope with its verified ranges corrected, where it is the one verified; the others are as `stated`."""
        if not self._gains or bare.identity.serial_number != self._serial_number:
            return stated
        return cast("Oscilloscope", _CorrectedOscilloscope(bare, stated, self))

    def at(self, channel: int, full_scale: float) -> VerifiedGain | None:
        """Return what is known of a channel in a range, None where that was not verified."""
        near = [g for g in self._gains if g.channel == channel and abs(g.range / full_scale - 1.0) <= _SAME]
        return near[0] if near else None

    def gain_of(self, wave: Waveform, bare: Oscilloscope) -> float:
        """Return what a corrected record of an oscilloscope was divided by."""
        known = self.at(wave.channel, wave.full_scale) if self._gains and wave.full_scale else None
        return known.gain if known and bare.identity.serial_number == self._serial_number else 1.0

    def wider(self, channel: int, full_scale: float) -> float:
        """Return the narrowest verified range of a channel that holds a wanted one, the wanted one where none is near."""
        least, most = full_scale * (1.0 - _SAME), _WIDER * full_scale
        return min(
            (g.range for g in self._gains if g.channel == channel and least <= g.range <= most), default=full_scale
        )

    def begin(self) -> None:
        """Forget which records rest on the data sheet: another procedure begins."""
        self._elsewhere.clear()

    def corrected(self, wave: Waveform) -> Waveform:
        """Return a record divided by its channel's gain; one that is not in a verified range is noted, and its accuracy says so."""
        if not wave.full_scale or not self._ranges(wave.channel):
            return wave
        known = self.at(wave.channel, wave.full_scale)
        accuracy = wave.accuracy
        if known is None:
            self._elsewhere.append(_place(wave))
            source = f"{accuracy.source}; {_ELSEWHERE_SOURCE}" if accuracy.source else _ELSEWHERE_SOURCE
            return replace(wave, accuracy=replace(accuracy, source=source))
        return replace(
            wave,
            values=wave.values / known.gain,
            resolution=wave.resolution / known.gain,
            accuracy=Accuracy(
                gain=known.limit,
                offset=accuracy.offset,
                resolution=accuracy.resolution,
                source=f"verified on this bench; {known.reference}",
            ),
        )

    def not_used(self, waves: Iterable[Waveform]) -> None:
        """Take back that records rest on the data sheet, which only told the range for the next ones."""
        for place in map(_place, waves):
            if place in self._elsewhere:
                self._elsewhere.remove(place)

    def resting_on_data_sheet(self, parameters: "Iterable[Parameter]") -> list[Text]:
        """Return a sentence for channels whose records lie in no verified range, where that reached the budgets of `parameters`."""
        rows = (row for parameter in parameters for row in parameter.budget)
        if not self._elsewhere or not any(_ELSEWHERE_SOURCE in str(row.source) for row in rows):
            return []
        channels: dict[tuple[str, str, str], list[int]] = {}
        for channel in sorted({channel for channel, *_ in self._elsewhere}):
            taken = sorted({full_scale for each, full_scale, _ in self._elsewhere if each == channel})
            unit = next(unit for each, _, unit in self._elsewhere if each == channel)
            key = (_span(self._ranges(channel)), _span(taken), unit)
            channels.setdefault(key, []).append(channel)
        return [
            text(
                "the verified gain of channel {channels} holds at {verified} {unit} full scale; records at "
                "{taken} {unit} use the data sheet's limits. Add ranges for them to {setting} of "
                "probe-verification",
                channels=", ".join(map(str, numbers)),
                verified=verified,
                taken=taken,
                unit=unit,
                setting=_SETTINGS.get(unit, ""),
            )
            for (verified, taken, unit), numbers in channels.items()
        ]

    def _ranges(self, channel: int) -> list[float]:
        return sorted(gain.range for gain in self._gains if gain.channel == channel)


def _place(wave: Waveform) -> tuple[int, float, str]:
    return wave.channel, wave.full_scale, wave.unit


def _span(ranges: Sequence[float]) -> str:
    return f"{ranges[0]:.4g}" if ranges[0] == ranges[-1] else f"{ranges[0]:.4g} … {ranges[-1]:.4g}"


class _CorrectedOscilloscope:
    """An oscilloscope whose records in verified ranges are divided by the gain found; in all else the one behind it."""

    def __init__(self, bare: Oscilloscope, stated: Oscilloscope, verified: VerifiedChannels) -> None:
        self._bare = bare
        self._scope = stated
        self._verified = verified

    def __getattr__(self, name: str) -> Any:
        return getattr(self._scope, name)

    def configure_channel(self, channel: int, settings: ChannelSettings) -> None:
        """Set the narrowest verified range that holds the wanted one; where none is near, the wanted one."""
        full_scale = self._verified.wider(channel, settings.range)
        known = self._verified.at(channel, full_scale) is not None
        scope = self._bare if known else self._scope
        scope.configure_channel(channel, replace(settings, range=full_scale))

    def fetch(self, channels: Sequence[int], timeout: float) -> dict[int, Waveform]:
        """Return the record, corrected where the range was verified."""
        waves = self._scope.fetch(channels, timeout)
        return {channel: self._verified.corrected(wave) for channel, wave in waves.items()}
