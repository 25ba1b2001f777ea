"""Limits of error of the oscilloscope's probes that the station file leaves open: on the command line, or asked for."""

import re
from collections.abc import Sequence

from bench.i18n.errors import FileError, UsageError
from bench.station.station_file import Station
from drivers.interfaces import Role
from drivers.interfaces.text import text

_LIMIT = re.compile(r"\s*(?:CH|CHAN|C)?(\d)\s*=\s*±?(\d+\.?\d*|\.\d+)\s*%\s*", re.IGNORECASE)
#: A probe known worse than this (relative) says next to nothing.
LARGEST = 0.5


def unstated_probes(station: Station) -> frozenset[int]:
    """Return the channels whose probe has neither a limit of gain, nor a source, nor a calibration in the station file."""
    entry = station.entries.get(Role.OSCILLOSCOPE)
    probes = getattr(entry.options, "probes", {}) if entry else {}
    calibrated = getattr(entry.options, "calibration", {}) if entry else {}
    return frozenset(
        channel
        for channel, probe in probes.items()
        if channel not in calibrated and getattr(probe, "gain", None) == 0.0 and not getattr(probe, "source", "")
    )


def given_limits(words: Sequence[str], station: Station) -> dict[int, float]:
    """Return what `--probe CH1=2%` states, relative, by channel. Raises UsageError naming what is allowed."""
    open_ = unstated_probes(station)
    result = {}
    for word in words:
        match = _LIMIT.fullmatch(word)
        limit = float(match[2]) / 100.0 if match else -1.0
        if match is None or not 0.0 <= limit <= LARGEST:
            raise UsageError(
                text(
                    "--probe {word}: give CHANNEL=LIMIT, the probe's limit of gain in per cent of the reading, up to {most:g} %, as in "
                    "CH1=2%",
                    word=word,
                    most=100 * LARGEST,
                )
            )
        channel = int(match[1])
        if channel not in open_:
            raise UsageError(
                text(
                    "--probe {word}: the station leaves open the probes of channels {channels} only; what the station file states is "
                    "changed there",
                    word=word,
                    channels=sorted(open_) or "–",
                )
            )
        result[channel] = limit
    return result


def check_asked(station: Station, given: dict[int, float], *, somebody: bool) -> None:
    """Raise InputError where nobody can be asked for a probe that neither the station file nor the command line states."""
    left = sorted(unstated_probes(station) - given.keys())
    if left and not somebody:
        raise FileError(
            text(
                "{source}: the limit of error of the probe on channel {channel} is not stated, and nobody can be "
                "asked for it; write gain and source into [instruments.oscilloscope.probes.{channel}], or give "
                "--probe CH{channel}=2%",
                source=station.source,
                channel=left[0],
            )
        )
