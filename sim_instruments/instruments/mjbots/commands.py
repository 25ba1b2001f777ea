"""Commands of a moteus: its modes, and a command's values as registers and the diagnostic stream set them.

Sources: `fw/bldc_servo_structs.h` and `fw/board_debug.cc` of mjbots/moteus; the documentation's pages of the registers and of the
diagnostic protocol; the modes' numbers also in omelia-iliffe/moteus-rs.
"""

import math
from dataclasses import dataclass, replace
from enum import IntEnum

from sim_instruments.instruments.mjbots.configuration import MoteusSettings


class MoteusMode(IntEnum):
    """Register 000h; 1 to 4 cannot be commanded."""

    STOPPED = 0
    FAULT = 1
    ENABLING = 2
    CALIBRATING = 3
    CALIBRATION_COMPLETE = 4
    PWM = 5
    VOLTAGE = 6
    VOLTAGE_FOC = 7
    VOLTAGE_DQ = 8
    CURRENT = 9
    POSITION = 10
    TIMEOUT = 11
    ZERO_VELOCITY = 12
    STAY_WITHIN = 13
    MEASURE_INDUCTANCE = 14
    BRAKE = 15


#: As telemetry names them.
MODE_NAMES = {
    0: "stopped", 1: "fault", 2: "enabling", 3: "calibrating", 4: "calib_complete", 5: "pwm", 6: "voltage", 7: "voltage_foc",
    8: "voltage_dq", 9: "current", 10: "position", 11: "pos_timeout", 12: "zero_vel", 13: "within", 14: "meas_ind", 15: "brake",
}  # fmt: skip
NOT_COMMANDED = frozenset(
    {MoteusMode.FAULT, MoteusMode.ENABLING, MoteusMode.CALIBRATING, MoteusMode.CALIBRATION_COMPLETE}
)
#: In these a watchdog counts (`ISR_DoControl`), and limits of the position hold at the start.
WATCHED = frozenset({MoteusMode.POSITION, MoteusMode.STAY_WITHIN})


@dataclass
class MoteusCommand:
    """One command. Currents A, voltages V, torques N·m, positions turns, velocities turns a second, `timeout` s; NaN is "none given"."""

    mode: int = MoteusMode.STOPPED
    pwm_a: float = 0.0
    pwm_b: float = 0.0
    pwm_c: float = 0.0
    voltage_a: float = 0.0
    voltage_b: float = 0.0
    voltage_c: float = 0.0
    theta: float = 0.0
    voltage: float = 0.0
    theta_rate: float = 0.0
    d_voltage: float = 0.0
    q_voltage: float = 0.0
    d_current: float = 0.0
    q_current: float = 0.0
    position: float = 0.0
    velocity: float = 0.0
    feedforward_torque: float = 0.0
    kp_scale: float = 1.0
    kd_scale: float = 1.0
    ilimit_scale: float = 1.0
    maximum_torque: float = 100.0
    stop_position: float = math.nan
    timeout: float = 0.0
    velocity_limit: float = math.nan
    accel_limit: float = math.nan
    fixed_voltage: float = math.nan
    fixed_current: float = math.nan
    ignore_position_bounds: float = 0.0
    lower_bound: float = 0.0
    upper_bound: float = 0.0

    def prepared(self, configuration: MoteusSettings) -> "tuple[MoteusCommand, int]":
        """Return the command with what the configuration fills in, and the fault that it is by itself, 0 for none."""
        made = replace(self)
        if made.timeout == 0.0:
            made.timeout = configuration["servo.default_timeout_s"]
        for name in ("velocity_limit", "accel_limit"):
            given = getattr(made, name)
            if math.isnan(given):
                setattr(made, name, configuration[f"servo.default_{name}"])
            elif given < 0.0:
                setattr(made, name, math.nan)
        limited = not math.isnan(made.velocity_limit) or not math.isnan(made.accel_limit)
        if limited:
            highest = configuration["servo.max_velocity"]
            made.velocity_limit = highest if math.isnan(made.velocity_limit) else min(made.velocity_limit, highest)
            if not math.isnan(made.velocity):
                made.velocity = max(-made.velocity_limit, min(made.velocity_limit, made.velocity))
        if limited and not math.isnan(made.stop_position):
            return made, STOP_POSITION_DEPRECATED
        without_ramp = not math.isfinite(made.accel_limit) and not configuration["servo.bemf_feedforward_override"]
        if configuration["servo.bemf_feedforward"] != 0.0 and without_ramp:
            return made, BEMF_FEEDFORWARD_NO_ACCEL
        return made, 0


# Faults, and limits that are told without one (register 00Fh, `fw/error.h`).
OVER_VOLTAGE, MOTOR_NOT_CONFIGURED, OVER_TEMPERATURE = 34, 36, 38
START_OUTSIDE_LIMIT, UNDER_VOLTAGE, STOP_POSITION_DEPRECATED, BEMF_FEEDFORWARD_NO_ACCEL, INVALID_LIMITS = (
    39,
    40,
    45,
    47,
    48,
)
LIMIT_MAX_VELOCITY, LIMIT_MAX_POWER, LIMIT_MAX_VOLTAGE, LIMIT_MAX_CURRENT = 96, 97, 98, 99
LIMIT_FET_TEMPERATURE, LIMIT_MOTOR_TEMPERATURE, LIMIT_MAX_TORQUE, LIMIT_POSITION_BOUNDS = 100, 101, 102, 103

#: Options behind `d pos` and its like: letter, field.
_OPTIONS = {
    "p": "kp_scale", "d": "kd_scale", "i": "ilimit_scale", "s": "stop_position", "f": "feedforward_torque", "t": "timeout",
    "a": "accel_limit", "v": "velocity_limit", "o": "fixed_voltage", "c": "fixed_current", "b": "ignore_position_bounds",
}  # fmt: skip
_SIMPLE = {
    "raw": (MoteusMode.PWM, ("pwm_a", "pwm_b", "pwm_c"), "pwm value"),
    "v": (MoteusMode.VOLTAGE, ("voltage_a", "voltage_b", "voltage_c"), "a/b/c voltage"),
    "vdq": (MoteusMode.VOLTAGE_DQ, ("d_voltage", "q_voltage"), "d/q voltage"),
    "dq": (MoteusMode.CURRENT, ("d_current", "q_current"), "d/q current"),
    "pwm": (MoteusMode.VOLTAGE_FOC, ("theta", "voltage"), "phase or mag"),
}
_WITH_OPTIONS = {
    "pos": (MoteusMode.POSITION, ("position", "velocity", "maximum_torque"), "p/v/i", "pdisftavocb"),
    "tmt": (MoteusMode.TIMEOUT, ("position", "velocity", "maximum_torque"), "p/v/i", "pdisftavocb"),
    "zero": (MoteusMode.ZERO_VELOCITY, ("position", "velocity", "maximum_torque"), "p/v/i", "pdisftavocb"),
    "within": (MoteusMode.STAY_WITHIN, ("lower_bound", "upper_bound", "maximum_torque"), "min/max/t", "pditfb"),
}


#: The words behind `d` that are understood.
COMMAND_WORDS = ("stop", "brake", *_SIMPLE, *_WITH_OPTIONS, "nearest", "exact")


def command_of(words: list[str]) -> MoteusCommand | str:
    """Return what the words behind `d` command, or the line that refuses them."""
    name, given = (words[0], words[1:]) if words else ("", [])
    if name in ("stop", "brake"):
        return MoteusCommand(mode=MoteusMode.STOPPED if name == "stop" else MoteusMode.BRAKE)
    if name in _SIMPLE:
        mode, names, missing = _SIMPLE[name]
        allowed = ""
    elif name in _WITH_OPTIONS:
        mode, names, missing, allowed = _WITH_OPTIONS[name]
    else:
        return "ERR unknown command"
    values = [value for word in given[: len(names)] if (value := _number(word)) is not None]
    if len(values) < len(names):
        return f"ERR missing {missing}"
    command = MoteusCommand(mode=mode, **dict(zip(names, values, strict=True)))
    if allowed:
        # From here no command times out unless it says so.
        command.timeout = math.nan
    for word in given[len(names) :] if allowed else ():
        value = _number(word[1:])
        if word[0] not in allowed or value is None:
            return "ERR unknown option"
        setattr(command, _OPTIONS[word[0]], value)
    return command


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None
