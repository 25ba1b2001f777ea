"""Gains of the oscilloscope's channels, probes included, as a verification on this bench found them."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, cast

from drivers.interfaces import Accuracy, ChannelSettings, Oscilloscope, Waveform

#: The procedure that finds them.
PROBE_VERIFICATION = "probe-verification"
#: Two ranges are one within this, relative.
_SAME = 0.01
#: A range this much wider than the one asked for is taken where it is verified: the next of steps of 1, 2, 5, and one to spare.
_WIDER = 2.6


@dataclass(frozen=True)
class VerifiedGain:
    """What a channel shows over what is there, `gain`, known within ± `limit` (relative), in one range (full scale, V or A).

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

    def wider(self, channel: int, full_scale: float) -> float:
        """Return the narrowest verified range of a channel that holds a wanted one, the wanted one where none is near."""
        least, most = full_scale * (1.0 - _SAME), _WIDER * full_scale
        return min(
            (g.range for g in self._gains if g.channel == channel and least <= g.range <= most), default=full_scale
        )


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
        return {channel: self._corrected(wave) for channel, wave in self._scope.fetch(channels, timeout).items()}

    def _corrected(self, wave: Waveform) -> Waveform:
        known = self._verified.at(wave.channel, wave.full_scale) if wave.full_scale else None
        if known is None:
            return wave
        return replace(
            wave,
            values=wave.values / known.gain,
            resolution=wave.resolution / known.gain,
            accuracy=Accuracy(
                gain=known.limit,
                offset=wave.accuracy.offset,
                resolution=wave.accuracy.resolution,
                source=f"verified on this bench; {known.reference}",
            ),
        )
