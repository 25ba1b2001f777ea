"""The limits of a moteus's currents, and the codes by which it reports them.

Source: `ISR_DoCurrent` in `fw/bldc_servo_control.h` of mjbots/moteus; the documentation's pages of registers and of limits name the
codes and the items of the configuration.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from sim_instruments.instruments.mjbots.commands import (
    LIMIT_FET_TEMPERATURE,
    LIMIT_MAX_CURRENT,
    LIMIT_MAX_POWER,
    LIMIT_MAX_VELOCITY,
    LIMIT_MOTOR_TEMPERATURE,
    LIMIT_POSITION_BOUNDS,
)

#: A moteus-n1's largest power (W) up to and from a bus voltage (V) on, at its usual rate of the PWM.
_POWER_LOW, _VOLTAGE_LOW, _POWER_HIGH, _VOLTAGE_HIGH = 2000.0, 36.0, 1000.0, 44.0
_USUAL_RATE = 30000.0

#: The configuration's values by name.
Configured = Callable[[str], float]


@dataclass(frozen=True)
class Surrounding:
    """The inputs of the limits: `position` (turns), `velocity` (turns/s), temperatures (°C), `bus_voltage` (V), and the last
    commanded `voltage` (V, d + j·q).
    """

    position: float
    velocity: float
    board_temperature: float
    motor_temperature: float
    bus_voltage: float
    voltage: complex


def limited(
    wanted: complex, at: Surrounding, configured: Configured, *, ignore_bounds: bool = False
) -> tuple[complex, int]:
    """Return the current (A, d + j·q) that is left of the one wanted, and the code of what limits it, 0 for nothing.

    d and q current are bounded one by one; the q current also by where the shaft is and how fast it turns.
    """
    q_current, code = wanted.imag, 0
    if not ignore_bounds:
        q_current, code = _within_bounds(q_current, at.position, configured)
    q_current, code = _below_speed(q_current, code, at.velocity, configured)
    most, reason = largest_current(at, configured)
    d_current, d_code = _clipped(wanted.real, most, reason, 0)
    q_current, code = _clipped(q_current, most, reason, code)
    current, code = complex(d_current, q_current), code or d_code
    power = 1.5 * abs(at.voltage.real * current.real + at.voltage.imag * current.imag)
    if power > largest_power(at.bus_voltage, configured):
        return current * (largest_power(at.bus_voltage, configured) / power), LIMIT_MAX_POWER
    return current, code


def largest_current(at: Surrounding, configured: Configured) -> tuple[float, int]:
    """Return the largest current (A) at the present temperatures, and the code of what says so."""
    most, reason = configured("servo.max_current_A"), LIMIT_MAX_CURRENT
    share = _over(at.board_temperature, "", configured)
    if share > 0.0:
        reason = LIMIT_FET_TEMPERATURE
    if math.isfinite(configured("servo.motor_fault_temperature")):
        motor = _over(at.motor_temperature, "motor_", configured)
        if motor > share:
            share, reason = motor, LIMIT_MOTOR_TEMPERATURE
    derated = share * (configured("servo.derate_current_A") - most) + most
    return min(most, max(0.0, derated)), reason


def largest_power(bus_voltage: float, configured: Configured) -> float:
    """Return the largest power (W) at a bus voltage (V)."""
    own = configured("servo.max_power_W")
    if configured("servo.override_board_max_power") and math.isfinite(own):
        return own
    share = (bus_voltage - _VOLTAGE_LOW) / (_VOLTAGE_HIGH - _VOLTAGE_LOW)
    board = _POWER_LOW + min(max(share, 0.0), 1.0) * (_POWER_HIGH - _POWER_LOW)
    board *= configured("servo.pwm_rate_hz") / _USUAL_RATE
    return min(own, board) if math.isfinite(own) else board


def _over(temperature: float, whose: str, configured: Configured) -> float:
    margin = configured(f"servo.{whose}temperature_margin")
    return (temperature - (configured(f"servo.{whose}fault_temperature") - margin)) / margin


def _within_bounds(current: float, position: float, configured: Configured) -> tuple[float, int]:
    low, high = configured("servopos.position_min"), configured("servopos.position_max")
    beyond = 0.0
    if position > high and current > 0.0:
        beyond = position - high
    elif position < low and current < 0.0:
        beyond = low - position
    if not beyond > 0.0:
        return current, 0
    return current * max(0.0, 1.0 - beyond / configured("servo.position_derate")), LIMIT_POSITION_BOUNDS


def _below_speed(current: float, code: int, velocity: float, configured: Configured) -> tuple[float, int]:
    highest = configured("servo.max_velocity")
    if abs(velocity) < highest or velocity * current < 0.0:
        return current, code
    share = 1.0 - (abs(velocity) - highest) / configured("servo.max_velocity_derate")
    most = max(0.0, share * configured("servo.max_current_A"))
    return _clipped(current, most, LIMIT_MAX_VELOCITY if share < 1.0 else LIMIT_MAX_CURRENT, code)


def _clipped(current: float, most: float, reason: int, code: int) -> tuple[float, int]:
    if abs(current) <= most:
        return current, code
    return math.copysign(most, current), reason
