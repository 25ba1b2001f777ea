"""The configuration of a moteus as it was found: read at opening, set where this is allowed, and restored at the end."""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from drivers.bases.found_state import FoundState, WantedSetting
from drivers.interfaces import ReportedError
from drivers.interfaces.found_state import FoundSetting
from drivers.interfaces.text import Text, text
from drivers.mjbots.diagnostics import DiagnosticStream
from drivers.mjbots.options import MoteusOptions

_WRITE = "{value}"

_POLES = "motor.poles"
_RATIO = "motor_position.rotor_to_output_ratio"
_SIGN = "motor_position.output.sign"
_MAXIMUM_CURRENT, _MAXIMUM_VOLTAGE = "servo.max_current_A", "servo.max_voltage"
#: Binary places of single precision; decimal digits that a value is said with at least, and what that rounds by at most (relative).
_SINGLE, _DIGITS, _ROUNDED = 24, 6, 5e-6
_MOTOR_TEMPERATURE = "servo.enable_motor_temperature"


@dataclass(frozen=True)
class MoteusConfiguration:
    """The part of its configuration that readings and limits depend on.

    `pole_pairs` is what it is calibrated for, `ratio` turns of its output for one of the rotor, `sign` that of its output against the
    rotor (1 or -1), `maximum_current` (A, peak) its own limit, `has_motor_temperature` whether a thermistor is read.
    """

    pole_pairs: int
    ratio: float
    sign: float
    maximum_current: float
    has_motor_temperature: bool


class FoundConfiguration:
    """The configuration of one controller by its diagnostic stream; `name` stands for it in messages."""

    def __init__(self, stream: DiagnosticStream, options: MoteusOptions, name: str) -> None:
        self._stream = stream
        self._options = options
        self._name = name
        self._state = FoundState(
            name, lambda row: stream.get(row.query), lambda row, value: stream.set(row.query, value)
        )

    @property
    def settings(self) -> tuple[FoundSetting, ...]:
        """Configuration as found."""
        return self._state.settings

    def take_over(self) -> MoteusConfiguration:
        """Read everything, and set what may be set.

        Raises ReportedError where something is wrong that may not be set, or that does not stay as it was set.
        """
        self._state.take_over(self._rows())
        try:
            return self._read()
        except BaseException:
            self.give_back()
            raise

    def give_back(self) -> None:
        """Set everything back as it was found, where the drive still answers; may be called twice."""
        self._state.give_back()

    def _read(self) -> MoteusConfiguration:
        found = {one.query: one.wanted if one.changed else one.found for one in self._state.settings}
        poles, ratio, sign = (self._number(name, found[name]) for name in (_POLES, _RATIO, _SIGN))
        if poles < 2 or poles % 2:
            raise self._refused(_POLES, found[_POLES], text("Calibrate it for the motor: moteus_tool --calibrate"))
        if self._options.pole_pairs is not None and poles != 2 * self._options.pole_pairs:
            raise self._refused(
                _POLES,
                found[_POLES],
                text(
                    "The station file says pole_pairs = {pairs}; correct it, or calibrate the drive for this motor",
                    pairs=self._options.pole_pairs,
                ),
            )
        if not 0.0 < ratio < math.inf:
            raise self._refused(_RATIO, found[_RATIO], text("Set it to 1 where the motor has no gear"))
        if abs(sign) != 1.0:
            raise self._refused(_SIGN, found[_SIGN], text("Set it to 1 or -1"))
        return MoteusConfiguration(
            round(poles) // 2,
            ratio,
            sign,
            self._number(_MAXIMUM_CURRENT, found[_MAXIMUM_CURRENT]),
            self._number(_MOTOR_TEMPERATURE, found.get(_MOTOR_TEMPERATURE, "0")) != 0.0,
        )

    def _rows(self) -> Iterator[WantedSetting]:
        options = self._options
        yield WantedSetting(
            "servo.fw.enable",
            ("0",),
            text("field weakening adds a d-axis current to the one that is commanded"),
            _WRITE,
            optional=True,
        )
        yield self._fixed(
            "servo.voltage_mode_control",
            "0",
            text("its currents are not regulated, but set through the winding's resistance"),
        )
        yield self._fixed("servo.fixed_voltage_mode", "0", text("its currents are at an angle that is not the rotor's"))
        for bound in ("servopos.position_min", "servopos.position_max"):
            yield WantedSetting(bound, ("nan",), text("beyond it the current is reduced"), _WRITE)
        yield self._told(_POLES, text("the electrical speed is calculated with it"))
        yield self._told(_RATIO, text("the rotor's speed is calculated with it"))
        yield self._told(_SIGN, text("speed and q-axis current have this sign"))
        yield self._lowered(
            _MAXIMUM_CURRENT,
            options.maximum_current,
            text("the drive itself does not keep within the station's limit of current"),
        )
        yield self._lowered(
            _MAXIMUM_VOLTAGE,
            options.maximum_voltage,
            text("the drive itself does not switch off at the station's limit of voltage"),
        )
        yield self._told("servo.max_power_W", text("beyond it the current is reduced"))
        yield self._told("servo.max_velocity", text("beyond it the current is reduced"))
        for gain in ("servo.pid_dq_hz", "servo.pid_dq.kp", "servo.pid_dq.ki"):
            yield self._told(gain, text("how fast a current settles"), optional=True)
        yield self._told(_MOTOR_TEMPERATURE, text("whether it reads the winding's temperature"), optional=True)

    def _lowered(self, name: str, most: float | None, effect: Text) -> WantedSetting:
        """Return the row of a limit of the drive's own, which is lowered to the station's where it is above it.

        The drive keeps single precision, and some firmware says six digits of it: what is set has no more, and what is above the limit
        by less is the limit.
        """
        if most is None or self._number(name, self._stream.get(name)) <= most * (1.0 + _ROUNDED):
            return self._told(name, text("its own limit"))
        decimals = _DIGITS - 1 - math.floor(math.log10(most))
        lowered = math.floor(most * 10.0**decimals * (1.0 + 1e-12)) / 10.0**decimals
        kept = struct.unpack("<f", struct.pack("<f", lowered))[0]
        step = 2.0 ** (math.frexp(kept)[1] - _SINGLE)
        rounded = tuple(f"{each:.6f}" for each in (kept, kept - step, kept + step))
        return WantedSetting(name, (f"{lowered:.6f}",), effect, _WRITE, rounded=rounded)

    def _fixed(self, name: str, wanted: str, effect: Text) -> WantedSetting:
        return WantedSetting(name, (wanted,), effect, remedy=_at_console(name, wanted))

    def _told(self, name: str, effect: Text, *, optional: bool = False) -> WantedSetting:
        return WantedSetting(name, (), effect, optional=optional)

    def _number(self, name: str, said: str) -> float:
        try:
            return float(said)
        except ValueError as error:
            raise self._refused(name, said, text("Update its firmware, or take another drive")) from error

    def _refused(self, name: str, found: str, remedy: Text) -> ReportedError:
        return ReportedError(
            self._name, text("{name} is {found}", name=name, found=found), command=f"conf get {name}", remedy=remedy
        )


def _at_console(name: str, value: str) -> Text:
    return text(
        "Set it with tview or moteus_tool --console: conf set {name} {value}, then conf write", name=name, value=value
    )
