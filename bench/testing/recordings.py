"""A recording of an instrument as a test of its driver."""

from pathlib import Path

from bench.traffic.replay import replay
from bench.traffic.traffic_file import read_recording


def check_recording(file: Path, *, tolerant: bool = False, plugins_of: Path | None = None) -> None:
    """Repeat a recording with the present drivers; raises AssertionError if a driver behaves differently.

    `tolerant` of numbers in messages; `plugins_of` is a station file whose plug-ins the drivers are. Raises InputError for a file that
    is no recording, or whose driver is not to be had.
    """
    recording = read_recording(file, str(plugins_of or ""))
    differences = [
        f"{file}, {found.place}, {one.role.value}: recorded {found.before!r}, today {found.now!r}"
        for one in replay(recording, tolerant=tolerant)
        if (found := one.difference) is not None
    ]
    if differences:
        raise AssertionError("\n".join(differences))
