"""The registers of a moteus: number, name, mapping, and what a read or a write of each does.

Sources: `fw/moteus_controller.cc` of mjbots/moteus (which registers there are, which can be written, errors), the documentation's page of
the registers, and the list in omelia-iliffe/moteus-rs. Left out are the aux ports' own (05Ch to 06Ch, 072H to 07FH).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from sim_instruments.instruments.mjbots import scales
from sim_instruments.instruments.mjbots.commands import MoteusMode
from sim_instruments.instruments.mjbots.scales import WHOLE, RegisterScale

Access = Literal["ro", "rw", "wo"]
#: What of the drive a register shows or sets: a field of the command, or of what there is (`status`), or of what never changes.
Origin = Literal["command", "status", "constant", "act"]


@dataclass(frozen=True)
class MoteusRegister:
    """One register; `field` is the name of what it shows or sets, `only_int32` that it can be read in that type only."""

    number: int
    name: str
    scale: RegisterScale
    origin: Origin
    field: str
    only_int32: bool = False

    @property
    def access(self) -> Access:
        """The access that clients have to it."""
        if self.origin == "act":
            return "wo"
        return "rw" if self.origin == "command" or self.field in ("mode", "clock_trim") else "ro"


def _row(first: int, scale: RegisterScale, origin: Origin, *names: tuple[str, str]) -> tuple[MoteusRegister, ...]:
    return tuple(MoteusRegister(first + place, name, scale, origin, field) for place, (name, field) in enumerate(names))


_STAY_WITHIN = (
    ("Stay within: feedforward torque", "feedforward_torque", scales.TORQUE),
    ("Stay within: kp scale", "kp_scale", scales.PWM),
    ("Stay within: kd scale", "kd_scale", scales.PWM),
    ("Stay within: maximum torque", "maximum_torque", scales.TORQUE),
    ("Stay within: watchdog timeout", "timeout", scales.TIME),
    ("Stay within: integral limit scale", "ilimit_scale", scales.PWM),
    ("Stay within: ignore position bounds", "ignore_position_bounds", WHOLE),
)
_POSITION_MODE = (
    ("Position command", "position", scales.POSITION),
    ("Velocity command", "velocity", scales.VELOCITY),
    ("Feedforward torque", "feedforward_torque", scales.TORQUE),
    ("Kp scale", "kp_scale", scales.PWM),
    ("Kd scale", "kd_scale", scales.PWM),
    ("Maximum torque", "maximum_torque", scales.TORQUE),
    ("Commanded stop position", "stop_position", scales.POSITION),
    ("Watchdog timeout", "timeout", scales.TIME),
    ("Velocity limit", "velocity_limit", scales.VELOCITY),
    ("Acceleration limit", "accel_limit", scales.ACCELERATION),
    ("Fixed voltage override", "fixed_voltage", scales.VOLTAGE),
    ("Integral limit scale", "ilimit_scale", scales.PWM),
    ("Fixed current override", "fixed_current", scales.CURRENT),
    ("Ignore position bounds", "ignore_position_bounds", WHOLE),
)


def _with_scales(first: int, names: tuple[tuple[str, str, RegisterScale], ...]) -> tuple[MoteusRegister, ...]:
    return tuple(
        MoteusRegister(first + place, name, scale, "command", field) for place, (name, field, scale) in enumerate(names)
    )


REGISTERS: Mapping[int, MoteusRegister] = {
    entry.number: entry
    for entry in (
        MoteusRegister(0x000, "Mode", WHOLE, "status", "mode"),
        *_row(0x001, scales.POSITION, "status", ("Position", "position")),
        *_row(0x002, scales.VELOCITY, "status", ("Velocity", "velocity")),
        *_row(0x003, scales.TORQUE, "status", ("Torque", "torque")),
        *_row(0x004, scales.CURRENT, "status", ("Q current", "q_current"), ("D current", "d_current")),
        *_row(0x006, scales.POSITION, "status", ("Absolute position", "zero")),
        *_row(0x007, scales.POWER, "status", ("Power", "power")),
        *_row(0x00A, scales.TEMPERATURE, "status", ("Motor temperature", "motor_temperature")),
        *_row(0x00B, WHOLE, "status", ("Trajectory complete", "zero"), ("Home state", "homed")),
        *_row(0x00D, scales.VOLTAGE, "status", ("Voltage", "bus_voltage")),
        *_row(0x00E, scales.TEMPERATURE, "status", ("Temperature", "board_temperature")),
        *_row(0x00F, WHOLE, "status", ("Fault code", "fault")),
        *_row(0x010, scales.PWM, "command", ("PWM A", "pwm_a"), ("PWM B", "pwm_b"), ("PWM C", "pwm_c")),
        *_row(
            0x014,
            scales.VOLTAGE,
            "command",
            ("Voltage A", "voltage_a"),
            ("Voltage B", "voltage_b"),
            ("Voltage C", "voltage_c"),
        ),
        *_row(0x018, scales.PWM, "command", ("Voltage FOC theta", "theta")),
        *_row(
            0x019,
            scales.VOLTAGE,
            "command",
            ("Voltage FOC voltage", "voltage"),
            ("D voltage", "d_voltage"),
            ("Q voltage", "q_voltage"),
        ),
        *_row(
            0x01C, scales.CURRENT, "command", ("Commanded Q current", "q_current"), ("Commanded D current", "d_current")
        ),
        *_row(0x01E, scales.VELOCITY, "command", ("Voltage FOC theta rate", "theta_rate")),
        *_with_scales(0x020, _POSITION_MODE),
        *_row(
            0x030,
            scales.TORQUE,
            "status",
            ("Proportional torque", "zero"),
            ("Integral torque", "zero"),
            ("Derivative torque", "zero"),
            ("Feedforward torque shown", "feedforward_torque"),
            ("Total control torque", "control_torque"),
        ),
        *_row(0x038, scales.POSITION, "status", ("Control position", "none")),
        *_row(0x039, scales.VELOCITY, "status", ("Control velocity", "none")),
        *_row(0x03A, scales.TORQUE, "status", ("Control torque", "control_torque")),
        *_row(0x03B, scales.POSITION, "status", ("Position error", "zero")),
        *_row(0x03C, scales.VELOCITY, "status", ("Velocity error", "zero")),
        *_row(0x03D, scales.TORQUE, "status", ("Torque error", "zero")),
        *_row(
            0x040,
            scales.POSITION,
            "command",
            ("Stay within: lower", "lower_bound"),
            ("Stay within: upper", "upper_bound"),
        ),
        *_with_scales(0x042, _STAY_WITHIN),
        *_row(0x050, scales.POSITION, "status", ("Encoder 0 position", "encoder_position")),
        *_row(0x051, scales.VELOCITY, "status", ("Encoder 0 velocity", "velocity")),
        *_row(0x052, scales.POSITION, "status", ("Encoder 1 position", "zero")),
        *_row(0x053, scales.VELOCITY, "status", ("Encoder 1 velocity", "zero")),
        *_row(0x054, scales.POSITION, "status", ("Encoder 2 position", "zero")),
        *_row(0x055, scales.VELOCITY, "status", ("Encoder 2 velocity", "zero")),
        *_row(0x058, WHOLE, "status", ("Encoder validity", "encoder_validity")),
        *_row(0x070, WHOLE, "status", ("Millisecond counter", "milliseconds"), ("Clock trim", "clock_trim")),
        *(
            MoteusRegister(number, name, WHOLE, "constant", field, only_int32=True)
            for number, name, field in (
                (0x100, "Model number", "model"),
                (0x101, "Firmware version", "firmware"),
                (0x102, "Register map version", "register_map"),
                (0x120, "Serial number 1", "serial_0"),
                (0x121, "Serial number 2", "serial_1"),
                (0x122, "Serial number 3", "serial_2"),
                (0x150, "UUID 1", "uuid_0"),
                (0x151, "UUID 2", "uuid_1"),
                (0x152, "UUID 3", "uuid_2"),
                (0x153, "UUID 4", "uuid_3"),
            )
        ),
        *_row(0x130, scales.POSITION, "act", ("Set output nearest", "nearest"), ("Set output exact", "exact")),
        *_row(0x132, WHOLE, "act", ("Require reindex", "reindex"), ("Recapture position and velocity", "recapture")),
        *_row(0x140, WHOLE, "status", ("Driver fault 1", "zero"), ("Driver fault 2", "zero")),
        *_row(
            0x154,
            WHOLE,
            "act",
            ("UUID mask 1", "mask_0"),
            ("UUID mask 2", "mask_1"),
            ("UUID mask 3", "mask_2"),
            ("UUID mask 4", "mask_3"),
        ),
        *_row(0x158, WHOLE, "constant", ("UUID mask capable", "mask_capable")),
    )
}
#: The multiplex ID: there, and neither read nor written.
UNREADABLE = frozenset({0x110})
#: Registers whose values are readings, which a fault of the line may falsify.
READINGS = frozenset({*range(0x001, 0x008), 0x00A, 0x00D, 0x00E, 0x050, 0x051})


def number_of_modes() -> int:
    """Return how many modes there are: from there on a mode is an unknown register's value."""
    return len(MoteusMode)


Reader = Callable[[str], float]


def counted(entry: MoteusRegister, value: float, kind: int) -> float:
    """Return a register's value as it goes out in a type. A NaN of a whole number is the type's most negative one."""
    if entry.scale is WHOLE and math.isnan(value):
        return entry.scale.count(-1 << (8, 16, 32, 31)[kind] - 1, kind)
    return entry.scale.count(value, kind)
