"""Two probes on the two ends of one line, without a ground on the motor: each channel shows a part of the line's voltage."""

from dataclasses import replace

from bench.captures import Capture, CaptureError
from drivers.interfaces.text import text


def between_ends(capture: Capture) -> Capture:
    """Return a capture of two channels (V) as their difference. Raises CaptureError for any other number, and for a clipped channel."""
    if len(capture.channels) != 2:
        raise CaptureError(
            capture.source,
            text(
                "--connection ends needs the two channels of the two ends of one line, and there are {count}: {names}",
                count=len(capture.channels),
                names=[channel.name for channel in capture.channels],
            ),
        )
    first, second = capture.channels
    clipped = [channel.name for channel in capture.channels if channel.clipped]
    if clipped:
        raise CaptureError(
            capture.source,
            text("channel {name} is clipped, and so is the difference of the two: record in a larger range", name=clipped[0]),
        )  # fmt: skip
    couplings = {first.coupling, second.coupling}
    one = replace(
        first,
        name=f"{first.name}-{second.name}",
        unit=first.unit or second.unit,
        values=first.values - second.values,
        resolution=max(first.resolution, second.resolution),
        coupling="ac" if "ac" in couplings else "" if "" in couplings else "dc",
        full_scale=first.full_scale + second.full_scale,
        rounding=max(first.rounding, second.rounding),
    )
    return replace(capture, channels=(one,))
