"""Registers of a moteus as far as they are used, its modes and its fault codes."""

from enum import IntEnum

from drivers.interfaces.text import Text, text


class Register(IntEnum):
    """A register's number (register map versions 4 and 5)."""

    MODE = 0x000
    POSITION = 0x001
    VELOCITY = 0x002
    Q_CURRENT = 0x004
    D_CURRENT = 0x005
    MOTOR_TEMPERATURE = 0x00A
    BUS_VOLTAGE = 0x00D
    BOARD_TEMPERATURE = 0x00E
    FAULT = 0x00F
    Q_CURRENT_COMMAND = 0x01C
    FIRMWARE_VERSION = 0x101
    MAP_VERSION = 0x102
    SERIAL_NUMBER = 0x120


#: Register maps in which the registers above mean the same.
MAP_VERSIONS = (4, 5)

STOPPED, FAULT, CURRENT, TIMEOUT = 0, 1, 9, 11
#: Modes between stopped and the one that was commanded.
STARTING = (2, 3, 4)

_MODES = {
    STOPPED: text("stopped"),
    FAULT: text("fault"),
    2: text("enabling"),
    3: text("calibrating its current sensors"),
    4: text("calibrated"),
    5: text("PWM"),
    6: text("phase voltages"),
    7: text("a voltage at an angle"),
    8: text("d- and q-axis voltage"),
    CURRENT: text("d- and q-axis current"),
    10: text("position"),
    TIMEOUT: text("timeout"),
    12: text("zero velocity"),
    13: text("stay within bounds"),
    14: text("inductance measurement"),
    15: text("brake"),
}

_FAULTS = {
    32: text("its encoder saw no magnet while it was calibrated"),
    33: text("its gate driver reports a fault, mostly that the supply's voltage broke down"),
    34: text("the bus voltage was above servo.max_voltage"),
    35: text("its encoder is at fault"),
    36: text("it is not calibrated for a motor"),
    37: text("its control loop took too long"),
    38: text("it is too hot"),
    39: text("it was started outside its position bounds"),
    40: text("the bus voltage is too low"),
    41: text("its configuration was changed while it ran"),
    42: text("its encoder gives no angle"),
    43: text("its output encoder gives no position"),
    44: text("its gate driver cannot be enabled"),
    45: text("a stop position was commanded with limits"),
    46: text("its control loop was late"),
    47: text("feedforward was asked for without a limit of acceleration"),
    48: text("its position bounds are out of its range"),
    49: text("its position error is too large"),
    50: text("its velocity error is too large"),
}

#: Codes that are shown while it runs: what keeps it from what was commanded.
_LIMITS = {
    96: Text("servo.max_velocity"),
    97: Text("servo.max_power_W"),
    98: text("the bus voltage"),
    99: Text("servo.max_current_A"),
    100: Text("servo.fault_temperature"),
    101: Text("servo.motor_fault_temperature"),
    102: text("the commanded maximum torque"),
    103: text("servopos.position_min or servopos.position_max"),
    104: text("flux braking"),
    105: text("field weakening"),
}


def mode_words(mode: int) -> Text:
    """Return what people call a mode."""
    return _MODES.get(mode) or text("mode {mode}", mode=mode)


def fault_words(code: int) -> Text:
    """Return what a fault code means."""
    return _FAULTS.get(code) or text("fault code {code}", code=code)


def limit_words(code: int) -> Text | None:
    """Return what limits a drive that runs, by its fault code; None where nothing does."""
    if code == 0:
        return None
    return _LIMITS.get(code) or text("fault code {code}", code=code)
