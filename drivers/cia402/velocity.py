"""Velocity of a drive as electrical frequency: the objects of its mode, its user units, and the pole pairs between."""

from dataclasses import dataclass

from drivers.cia402.power_state import ObjectReader
from drivers.cia402.velocity_unit import VelocityUnit, read_unit, read_vl_unit
from drivers.interfaces import Accuracy, ReportedError
from drivers.interfaces.text import text
from drivers.transport.can.objects import NodeObjects

PROFILE_VELOCITY, VELOCITY_MODE = 3, 2
#: Modes that turn at a velocity, the one to be preferred first.
MODES = (PROFILE_VELOCITY, VELOCITY_MODE)
TARGET_VELOCITY, ACTUAL_VELOCITY, MAX_PROFILE_VELOCITY = 0x60FF, 0x606C, 0x607F
VL_TARGET_VELOCITY, VL_ACTUAL_VELOCITY = 0x6042, 0x6044


@dataclass(frozen=True)
class Velocity:
    """Target and actual velocity of one drive: `counts` in one Hz (electrical), in objects of `size` bytes.

    `mode` is the mode of operation in which the target acts, None for a drive that has none.
    """

    objects: NodeObjects
    mode: int | None
    counts: float
    target: int = TARGET_VELOCITY
    actual: int = ACTUAL_VELOCITY
    size: int = 4

    @property
    def accuracy(self) -> Accuracy:
        """Resolution of a reading: one count."""
        return Accuracy(
            resolution=1.0 / self.counts,
            source=f"one count of 0x{self.actual:04X}; frequency of the drive's own quartz",
        )

    def read(self, source: ObjectReader) -> float:
        """Return the electrical frequency (Hz) by the velocity actual value, as `source` has it."""
        return source.read(self.actual, 0, self.size, signed=True) / self.counts

    def command(self, frequency: float) -> None:
        """Write a frequency (Hz) as target velocity; raises ReportedError for one that the object does not hold."""
        counts = round(frequency * self.counts)
        if abs(counts) >= 1 << 8 * self.size - 1:
            raise ReportedError(
                self.objects.name,
                text(
                    "{frequency:g} Hz are {counts} counts, which is beyond the range of 0x{target:04X}",
                    frequency=frequency,
                    counts=counts,
                    target=self.target,
                ),
                remedy=text("Set a coarser unit of velocity in the drive's set-up (0x60A9)"),
            )
        self.objects.write(self.target, 0, counts, self.size, signed=True)

    def check_limit(self, frequency: float) -> None:
        """Raise ReportedError for a frequency (Hz) above the drive's own limit of profile velocities, 607Fh."""
        if self.mode != PROFILE_VELOCITY:
            return
        limit = self.objects.read_optional(MAX_PROFILE_VELOCITY, 0, 4)
        if limit is not None and limit < abs(round(frequency * self.counts)):
            raise ReportedError(
                self.objects.name,
                text(
                    "the drive's own limit 0x607F is {limit} ({highest:g} Hz), below the frequency asked for",
                    limit=limit,
                    highest=limit / self.counts,
                ),
                remedy=text("Raise it in the drive's set-up, or ask for less"),
            )


def open_velocity(
    objects: NodeObjects, mode: int | None, stated: str, *, increments: int | None, pole_pairs: int | None
) -> Velocity:
    """Return the velocity of a drive in a mode of operation, in the unit that it says or that is `stated`.

    Raises ReportedError where the unit is not known, or the pole pairs between it and the electrical frequency.
    """
    by_vl = mode == VELOCITY_MODE
    unit = read_vl_unit(objects, stated) if by_vl else read_unit(objects, stated, increments)
    counts = _per_hertz(objects, unit, pole_pairs)
    if by_vl:
        return Velocity(objects, mode, counts, VL_TARGET_VELOCITY, VL_ACTUAL_VELOCITY, 2)
    return Velocity(objects, mode, counts)


def _per_hertz(objects: NodeObjects, unit: VelocityUnit, pole_pairs: int | None) -> float:
    if unit.electrical:
        return unit.counts
    if pole_pairs is None:
        raise ReportedError(
            objects.name,
            text("the drive counts turns of the shaft, and no object says with how many pole pairs it is set up"),
            remedy=text("State pole_pairs in the station file, as the drive is set up"),
        )
    return unit.counts / pole_pairs
