"""The configuration of a moteus, as its diagnostic stream gives and takes it: `conf get servo.max_current_A`.

Names and defaults: `fw/bldc_servo_structs.h`, `fw/motor_position.h` and `fw/moteus.cc` of mjbots/moteus (family 1, moteus-n1), and the
documentation's page of the configuration. Those that nothing here asks for (aux ports, encoders, cogging table, gate driver) are left out.
"""

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

#: By group, each item with its default; the default's type is the item's.
DEFAULTS: Mapping[str, Mapping[str, float]] = {
    "id": {"id": 1},
    "can": {"prefix": 0},
    "servo": {
        "pwm_rate_hz": 30000,
        "current_sense_ohm": 0.0005,
        "max_voltage": 56.0,
        "max_power_W": math.nan,
        "override_board_max_power": False,
        "temperature_margin": 25.0,
        "fault_temperature": 75.0,
        "enable_motor_temperature": False,
        "motor_thermistor_ohm": 10000.0,
        "motor_temperature_margin": 20.0,
        "motor_fault_temperature": math.nan,
        "fault_position_error": math.nan,
        "fault_velocity_error": math.nan,
        "velocity_threshold": 0.0,
        "position_derate": 0.02,
        "pid_dq_hz": 100.0,
        "max_current_desired_rate": 10000.0,
        "pid_position.kp": 4.0,
        "pid_position.ki": 1.0,
        "pid_position.kd": 0.05,
        "pid_position.iratelimit": -1.0,
        "pid_position.ilimit": 0.0,
        "pid_position.max_desired_rate": 0.0,
        "pid_position.sign": -1.0,
        "current_feedforward": 1.0,
        "bemf_feedforward": 0.0,
        "bemf_feedforward_override": False,
        "cross_coupling_feedforward": 1.0,
        "inertia_feedforward": 0.0,
        "default_velocity_limit": math.nan,
        "default_accel_limit": 50.0,
        "voltage_mode_control": False,
        "fixed_voltage_mode": False,
        "fixed_voltage_control_V": 0.0,
        "max_position_slip": math.nan,
        "max_velocity_slip": math.nan,
        "default_timeout_s": 0.1,
        "timeout_max_torque_Nm": 5.0,
        "timeout_mode": 12,
        "flux_brake_margin_voltage": 3.0,
        "flux_brake_resistance_ohm": 0.025,
        "max_regen_power_W": math.nan,
        "fw.enable": False,
        "fw.modulation_margin": 0.15,
        "fw.bandwidth_hz": 100.0,
        "fw.max_current_ratio": 0.5,
        "max_current_A": 100.0,
        "derate_current_A": -20.0,
        "max_velocity": 500.0,
        "max_velocity_derate": 2.0,
        "cooldown_cycles": 256,
        "cooldown_brake": 64,
        "velocity_zero_capture_threshold": 0.05,
        "timing_fault": False,
        "emit_debug": 0,
    },
    "servopos": {"position_min": -0.01, "position_max": 0.01},
    "motor_position": {
        "commutation_source": 0,
        "output.source": 0,
        "output.offset": 0.0,
        "output.sign": 1,
        "output.reference_source": -1,
        "rotor_to_output_ratio": 1.0,
        "rotor_to_output_override": False,
    },
    "motor": {
        "poles": 0,
        "phase_invert": 0,
        "resistance_ohm": 0.0,
        "inductance_d_H": 0.0,
        "inductance_q_H": 0.0,
        "inductance_d_scale": 0.0,
        "Kv": 0.0,
        **{f"offset.{number}": 0.0 for number in range(64)},
        "rotation_current_cutoff_A": 10000.0,
        "rotation_current_scale": 0.05,
        "rotation_torque_scale": 14.7,
        "cogging_dq_scale": 0.0,
    },
    "uuid": {f"uuid.{number}": 0 for number in range(16)},
}
#: What C's strtof and strtoll read of a text: as much as is a number, nothing else.
_NUMBER = re.compile(r"\s*([+-]?(?:nan|inf(?:inity)?|(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?))", re.IGNORECASE)


class UnknownGroupError(LookupError):
    """A group that there is not."""


class UnknownItemError(LookupError):
    """An item that its group has not."""


class MoteusSettings:
    """The values in memory, those in the flash, and the firmware's defaults, which a set-up drive has values other than (`set_up`)."""

    def __init__(self, set_up: Mapping[str, float]) -> None:
        self._defaults = {
            f"{group}.{name}": value for group, items in DEFAULTS.items() for name, value in items.items()
        }
        self._stored = {**self._defaults, **set_up}
        self._values = dict(self._stored)

    def __getitem__(self, name: str) -> float:
        """Return the value of `group.item`."""
        return self._values[name]

    def put(self, name: str, value: float) -> None:
        """Set `group.item`."""
        self._values[name] = value

    def text(self, name: str) -> str:
        """Return a value as it is printed. Raises UnknownGroupError and UnknownItemError."""
        self._check(name)
        return printed(self._values[name])

    def set(self, name: str, text: str) -> None:
        """Set a value from text, of which what is no number counts as 0. Raises UnknownGroupError and UnknownItemError."""
        self._check(name)
        match = _NUMBER.match(text)
        value = float(match[1]) if match else 0.0
        default = self._defaults[name]
        if isinstance(default, bool):
            self._values[name] = bool(value)
        elif isinstance(default, int):
            self._values[name] = int(value) if math.isfinite(value) else 0
        else:
            self._values[name] = value

    def lines(self, group: str = "") -> Iterator[str]:
        """Give `group.item value` of a group, or of all. Raises UnknownGroupError."""
        if group and group not in DEFAULTS:
            raise UnknownGroupError(group)
        for name, value in self._values.items():
            if not group or name.startswith(f"{group}."):
                yield f"{name} {printed(value)}"

    def groups(self) -> tuple[str, ...]:
        """Return the groups' names."""
        return tuple(DEFAULTS)

    def write(self) -> None:
        """Keep what is in memory in the flash."""
        self._stored = dict(self._values)

    def load(self) -> None:
        """Bring what is in the flash into memory."""
        self._values = dict(self._stored)

    def default(self) -> None:
        """Bring the firmware's defaults into memory."""
        self._values = dict(self._defaults)

    def _check(self, name: str) -> None:
        group = name.partition(".")[0]
        if group not in DEFAULTS:
            raise UnknownGroupError(group)
        if name not in self._values:
            raise UnknownItemError(name)


def printed(value: Any) -> str:
    """Return a value as C prints it: whole numbers and truths %d, others %g."""
    return f"{int(value)}" if isinstance(value, int) else f"{value:g}"
