"""Unit of one count of a velocity: the drive's user units, by its factor group (CiA 402-2) or by the station's statement."""

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from drivers.interfaces import ReportedError
from drivers.interfaces.text import Text, text

if TYPE_CHECKING:
    from drivers.transport.can.objects import NodeObjects

#: The factor group: encoder resolution, gear ratio, feed constant, velocity factor, SI unit of velocity.
ENCODER_RESOLUTION, GEAR_RATIO, FEED_CONSTANT, VELOCITY_FACTOR, SI_UNIT_VELOCITY = (
    0x608F,
    0x6091,
    0x6092,
    0x6096,
    0x60A9,
)
#: The velocity mode's own scale, to rpm.
DIMENSION_FACTOR = 0x604C

#: What is counted, by its byte of 60A9h: turns of one count. C0h is left out, for makers differ on it.
_TURNS = {0xB4: 1.0, 0x41: 1.0 / 360.0, 0x10: 1.0 / (2.0 * math.pi)}
_INCREMENT = 0xB5
#: Seconds of what it is counted in, by its byte of 60A9h.
_SECONDS = {0x03: 1.0, 0x47: 60.0}

#: Turns a second of one of what a station may state; counts depend on the encoder.
_STATED = {"rpm": 1.0 / 60.0, "rps": 1.0, "rad/s": 1.0 / (2.0 * math.pi), "deg/s": 1.0 / 360.0, "Hz": 1.0}
_COUNTS = "counts/s"
_FORM = re.compile(rf"(?:(\d+(?:\.\d+)?(?:e[+-]?\d+)?) *)?({'|'.join(_STATED)}|{_COUNTS})")
#: What a message offers as examples.
ALLOWED = "rpm, rps, rad/s, deg/s, counts/s, Hz (electrical)"


@dataclass(frozen=True)
class VelocityUnit:
    """`counts` in one turn a second; of an `electrical` one in one Hz of the phases' frequency."""

    counts: float
    electrical: bool = False

    def agrees(self, other: "VelocityUnit") -> bool:
        """Return whether both mean the same."""
        return self.electrical == other.electrical and math.isclose(self.counts, other.counts, rel_tol=1e-6)

    @property
    def words(self) -> str:
        """One count, in rpm or Hz."""
        return f"{1.0 / self.counts:.6g} Hz" if self.electrical else f"{60.0 / self.counts:.6g} rpm"


def stated_unit(stated: str, increments: float | None = None) -> VelocityUnit | None:
    """Return the unit that a station states, such as "0.1 rpm"; None for counts of an encoder that is not known.

    Raises ValueError for what is no unit.
    """
    match = _FORM.fullmatch(stated.strip())
    if match is None or not (factor := float(match[1] or 1.0)) > 0.0 or not math.isfinite(factor):
        raise ValueError(
            text("'{stated}' is no unit of velocity; allowed are {allowed}", stated=stated, allowed=ALLOWED)
        )
    if match[2] == _COUNTS:
        return VelocityUnit(increments / factor) if increments else None
    return VelocityUnit(1.0 / (factor * _STATED[match[2]]), match[2] == "Hz")


def read_unit(objects: "NodeObjects", stated: str, increments: int | None = None) -> VelocityUnit:
    """Return the unit of 606Ch and 60FFh; `increments` (a turn) stands in for 608Fh.

    Raises ReportedError where drive and station contradict each other, or neither says it.
    """
    group = _FactorGroup(objects, increments)
    own = group.by_si_unit(stated=bool(stated))
    said = stated_unit(stated, group.increments) if stated else None
    if stated and said is None:
        raise _unknown_encoder(objects)
    if own is not None and said is not None and not own.agrees(said):
        raise _contradiction(objects, "0x60A9", own.words, said.words)
    unit = said or own
    if unit is not None:
        group.check_factor(unit)
        if said is None:
            group.check_gear()
        return unit
    return group.by_position_unit()


def read_vl_unit(objects: "NodeObjects", stated: str) -> VelocityUnit:
    """Return the unit of the velocity mode (6042h, 6044h): rpm, with the factor 604Ch at 1:1; errors as for `read_unit`."""
    said = stated_unit(stated) if stated else None
    if stated and said is None:
        raise _unknown_encoder(objects)
    factor = _ratio(objects, DIMENSION_FACTOR, signed=True)
    if said is None and factor is not None and factor != 1.0:
        raise _refused(
            objects,
            text(
                "the factor of the velocity mode (0x604C) is {factor:g}, which makers define in two ways", factor=factor
            ),
            text("Set 0x604C to 1:1, or state velocity_unit in the station file"),
        )
    return said or VelocityUnit(60.0)


class _FactorGroup:
    """User units as a drive states them."""

    def __init__(self, objects: "NodeObjects", increments: int | None) -> None:
        self._objects = objects
        encoder = float(increments) if increments else _ratio(objects, ENCODER_RESOLUTION)
        #: Increments a turn; one that stands at 1:1 was never set up.
        self.increments = encoder if encoder is not None and encoder > 1.0 else None
        self._gear = _ratio(objects, GEAR_RATIO)
        self._feed = _ratio(objects, FEED_CONSTANT)
        self._factor = _ratio(objects, VELOCITY_FACTOR)

    def by_si_unit(self, *, stated: bool) -> VelocityUnit | None:
        """Return what 60A9h says; None where it says nothing that is known, or that only the encoder's resolution would tell.

        Raises ReportedError for counts of an encoder that is not known, unless the unit is `stated`.
        """
        code = self._objects.read_optional(SI_UNIT_VELOCITY, 0, 4)
        if not code:
            return None
        prefix, counted, seconds = (
            (code >> 24) - (256 if code >> 31 else 0),
            code >> 16 & 0xFF,
            _SECONDS.get(code >> 8 & 0xFF),
        )
        if counted == _INCREMENT and seconds is not None:
            if self.increments is None and stated:
                return None
            if self.increments is None:
                raise _unknown_encoder(self._objects)
            turns: float | None = 1.0 / self.increments
        else:
            turns = _TURNS.get(counted)
        return None if turns is None or seconds is None else VelocityUnit(seconds * 10.0**-prefix / turns)

    def check_gear(self) -> None:
        """Refuse a gear between the motor and what the drive calls a turn."""
        if self._gear is not None and self._gear != 1.0:
            raise _refused(
                self._objects,
                text(
                    "the drive is set up for a gear of {gear:g} (0x6091): its turns are not the motor's",
                    gear=self._gear,
                ),
                text("Set 0x6091 to 1:1, or state velocity_unit in the station file, of the motor's shaft"),
            )

    def check_factor(self, unit: VelocityUnit) -> None:
        """Refuse a velocity factor that fits the unit in none of the ways in which makers define it."""
        factor = self._factor
        if factor is None or factor == 1.0 or unit.electrical:
            return
        bases = [1.0, *(base for base in (self.increments, self._position_units()) if base is not None)]
        ways = [way for base in bases for way in (unit.counts / base, base / unit.counts)]
        if not any(math.isclose(factor, way, rel_tol=1e-4) for way in ways):
            raise _contradiction(self._objects, "0x6096", f"{factor:g}", unit.words)

    def by_position_unit(self) -> VelocityUnit:
        """Return user units of position a second, of a drive whose velocity factor is 1:1."""
        units = self._position_units()
        if self._factor != 1.0 or units is None or self.increments is None:
            raise _refused(
                self._objects,
                text("the drive does not state the unit of its velocity (0x60A9; 0x608F, 0x6091, 0x6092, 0x6096)"),
                text(
                    'State velocity_unit in the station file, as the drive\'s manual has it: "rpm", "0.1 rpm", "counts/s" …'
                ),
            )
        return VelocityUnit(units)

    def _position_units(self) -> float | None:
        """Return user units of position in a turn of the motor."""
        if self._feed is None:
            return self.increments
        # A feed of 1:1 with an encoder that was set up: one unit a turn.
        return self._feed / (self._gear or 1.0)


def _ratio(objects: "NodeObjects", index: int, *, signed: bool = False) -> float | None:
    """Return the quotient of an object's two members; None where it is absent or has a 0."""
    above = objects.read_optional(index, 1, 4, signed=signed)
    below = objects.read_optional(index, 2, 4, signed=signed) if above else None
    return above / below if above and below else None


def _unknown_encoder(objects: "NodeObjects") -> ReportedError:
    return _refused(
        objects,
        text("velocities are counts of an encoder whose resolution the drive does not say (0x608F)"),
        text("Set increments_per_turn in the station file"),
    )


def _contradiction(objects: "NodeObjects", name: str, found: str, unit: str) -> ReportedError:
    return _refused(
        objects,
        text("{name} says {found}, which contradicts a velocity unit of {unit}", name=name, found=found, unit=unit),
        text("Correct velocity_unit in the station file, or the drive's set-up"),
    )


def _refused(objects: "NodeObjects", what: Text, remedy: Text) -> ReportedError:
    return ReportedError(objects.name, what, remedy=remedy)
