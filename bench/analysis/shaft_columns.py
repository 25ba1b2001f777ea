"""Speed and torque of the shaft in a logger's table; the speed may be an electrical one."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.analysis.outcome import in_units, open_unit, pick, refuse_over_range
from bench.captures import Capture, CaptureChannel, CaptureError
from drivers.interfaces.text import Text, text

#: Of controllers' logs.
_ELECTRICAL = re.compile(r"(?<![a-z])e[_ -]?rpm|elec", re.IGNORECASE)
#: Units that are turns of the shaft, periods of its EMF, or radians.
_PER_SECOND = ("1/s", "s-1", "s^-1")
_TORQUE = re.compile(r"torq|(?<![a-z])trq|drehmoment|转矩|扭矩|力矩", re.IGNORECASE)
SPEED_WORDS = ("speed", "rpm", "omega", "ω")


@dataclass(frozen=True)
class SpeedColumn:
    """What was typed of a speed's column: its `name`; whether one without unit is `in_rpm` or in rad/s; whether it is `electrical` where
    its own name does not say so, and the `pole_pairs` that such a speed is divided by.
    """

    name: str | None = None
    in_rpm: bool | None = None
    electrical: bool = False
    pole_pairs: int | None = None

    def of_shaft(self, capture: Capture, among: Sequence[CaptureChannel]) -> tuple[CaptureChannel, list[Text]]:
        """Return the shaft's speed (rad/s), which is one of the columns `among`, and what had to be assumed.

        Raises CaptureError where no column or several may be it, and where its unit, or whether it is electrical, is not known.
        """
        wanted = among[0].name if self.name is None and len(among) == 1 else self.name
        for column in [capture.channel(wanted)] if wanted else among:
            if column.unit == "Hz" and not self._is_electrical(column.name):
                raise CaptureError(
                    capture.source,
                    text(
                        "column '{name}' is in Hz, which may be turns or electrical periods a second: write rps where it is turns, "
                        "or type --electrical and --pole-pairs",
                        name=column.name,
                    ),
                )
            if column.unit.lower() in _PER_SECOND:
                raise CaptureError(
                    capture.source,
                    text(
                        "column '{name}' is in {unit}, which may be turns, electrical periods or radians a second: write rps, Hz or rad/s",
                        name=column.name,
                        unit=column.unit,
                    ),
                )
        found = pick(capture, wanted, ("rad/s", "Hz"), "speed", SPEED_WORDS, "--speed")
        refuse_over_range(capture, found)
        pairs = self._pairs(capture, found.name)
        factor, note = self._unit(capture, found)
        if pairs != 1:
            note.append(
                text("speed '{name}' is electrical, divided by {pairs} pole pairs", name=found.name, pairs=pairs)
            )
        factor /= pairs
        return replace(found, unit="rad/s", values=found.values * factor, resolution=found.resolution * factor), note

    def _is_electrical(self, name: str) -> bool:
        return self.electrical or is_electrical(name)

    def _pairs(self, capture: Capture, name: str) -> int:
        """Return what the column is divided by."""
        electrical = self._is_electrical(name)
        if electrical and self.pole_pairs is None:
            raise CaptureError(
                capture.source,
                text(
                    "column '{name}' is an electrical speed, according to its name or to --electrical. Type --pole-pairs as well, "
                    "by which it is divided",
                    name=name,
                ),
            )
        if self.pole_pairs is not None and not electrical:
            raise CaptureError(
                capture.source,
                text(
                    "column '{name}' is taken as the speed of the shaft, which does not depend on the pole pairs. Type --electrical as "
                    "well if it is an electrical speed, or leave --pole-pairs out",
                    name=name,
                ),
            )
        return self.pole_pairs or 1

    def _unit(self, capture: Capture, found: CaptureChannel) -> tuple[float, list[Text]]:
        """Return the factor to rad/s, and what was assumed of the unit."""
        if found.unit == "rad/s":
            return 1.0, []
        if found.unit == "Hz":
            return 2.0 * np.pi, []
        if self.in_rpm or "rpm" in found.name.lower():
            return np.pi / 30, [text("speed '{name}' assumed to be in rpm", name=found.name)]
        if self.in_rpm is None:
            more = text("; or type --speed-in-rpm or --speed-in-rad-s")
            raise open_unit(capture, found.name, "speed", ("rpm", "rad/s", "rps"), more)
        return 1.0, [text("speed '{name}' assumed to be in rad/s", name=found.name)]


def is_electrical(name: str) -> bool:
    """Return whether a column's name says that its speed is an electrical one."""
    return bool(_ELECTRICAL.search(name))


def is_torque(channel: CaptureChannel) -> bool:
    """Return whether a column is a torque, by its unit or its name."""
    return channel.unit == "N·m" or bool(_TORQUE.search(channel.name))


def torque_in_units(capture: Capture, torque: CaptureChannel) -> CaptureChannel:
    """Return a torque (N·m). Raises CaptureError where its heading says no unit."""
    if not torque.unit:
        raise open_unit(capture, torque.name, "torque", ("Nm", "mNm"))
    return in_units(capture, torque, ("N·m",), "torque")
