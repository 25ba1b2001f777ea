"""Text of Hantek scopes' PC programs: a block a channel, its settings behind "#", then one value a line (users' files, no manual).

Sources: a file of a DSO8060 (MIT-licensed converter to PWL files for LTspice: `#CHANNEL:CH1`, `#CLOCK=0.000001000S`, `#SIZE=1200`,
`#UNITS:V`), and one of two channels as G. Reinoso's blog Electrónica y Ciencia describes it (2020; `#CLOCK=20.0uS`, a block a channel).
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.captures.capture import Capture, CaptureChannel, CaptureError
from bench.captures.text import number, read_numbers
from bench.captures.units import si
from drivers.interfaces.text import text

_SETTING = re.compile(r"#\s*(\w+)\s*[:=]\s*(.*)")
_PERIOD = re.compile(r"(\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)\s*([nuµm]?s)", re.IGNORECASE)


@dataclass(frozen=True)
class _Block:
    """A channel's settings, and the lines (from 0, the last one excluded) of its values."""

    settings: dict[str, str]
    first: int
    end: int


def is_hantek(lines: list[str]) -> bool:
    """Tell whether the first block's heading names a channel and its clock."""
    heading = [match[1].upper() for match in map(_SETTING.match, lines[:8]) if match]
    return heading[:1] == ["CHANNEL"] and "CLOCK" in heading


def read_hantek(path: Path, lines: list[str]) -> Capture:
    """Return the capture, its time counted from the first sample. Raises CaptureError."""
    blocks = _blocks(lines)
    channels, steps = [], []
    assumptions = [
        text("time counted from the first sample; this format does not say where the trigger is"),
        text("values used unchanged; check that the oscilloscope was set to the factor of the probe"),
    ]
    for block in blocks:
        steps.append(_step(path, block))
        if block.end - block.first < 2:
            raise CaptureError(
                str(path), text("holds a heading and fewer than two samples; export the record again"), block.first
            )
        values = read_numbers(path, lines[: block.end], block.first, (0,), ",")[:, 0]
        unit = block.settings.get("UNITS", "")
        known, factor = si(unit) or (unit, 1.0)
        name = block.settings.get("CHANNEL", "")
        channels.append(CaptureChannel.written(name, known, values * factor))
        stated = number(block.settings.get("SIZE", ""))
        if stated is not None and int(stated) != len(values):
            assumptions.append(
                text(
                    "the heading states {stated} samples, but the file contains {held}; the samples in the file are used",
                    stated=int(stated),
                    held=len(values),
                )
            )
    if len({(step, len(channel.values)) for step, channel in zip(steps, channels, strict=True)}) > 1:
        raise CaptureError(
            str(path), text("its channels have clocks or numbers of samples that differ; export channels of one record")
        )
    time = steps[0] * np.arange(len(channels[0].values), dtype=np.float64)
    return Capture(
        tuple(channels), time, str(path), "Hantek text", tuple({str(each): each for each in assumptions}.values())
    )


def _blocks(lines: list[str]) -> list[_Block]:
    headings = [
        at for at, line in enumerate(lines) if (match := _SETTING.match(line)) and match[1].upper() == "CHANNEL"
    ]
    blocks = []
    for at, after in zip(headings, [*headings[1:], len(lines)], strict=True):
        first, settings = at, dict[str, str]()
        while first < after and (not lines[first].strip() or lines[first].startswith("#")):
            if match := _SETTING.match(lines[first]):
                settings[match[1].upper()] = match[2].strip()
            first += 1
        end = after
        while end > first and not lines[end - 1].strip():
            end -= 1
        blocks.append(_Block(settings, first, end))
    return blocks


def _step(path: Path, block: _Block) -> float:
    said = block.settings.get("CLOCK", "")
    match = _PERIOD.fullmatch(said)
    known = si(match[2].lower()) if match else None
    if match is None or known is None or not float(match[1]) > 0.0:
        raise CaptureError(
            str(path),
            text(
                "the heading of channel {name} has no clock period as in '#CLOCK=20.0uS' (it has '{said}'); export the record again, or "
                "as a table with a column of time",
                name=block.settings.get("CHANNEL", ""),
                said=said,
            ),
            block.first,
        )
    return float(match[1]) * known[1]
