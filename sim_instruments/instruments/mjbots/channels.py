"""Contents of a moteus's telemetry channels: `servo_stats`, `servo_control`, `servo_cmd`, `firmware`, `git`, `system_info`.

Names and types: `fw/bldc_servo_structs.h`, `fw/firmware_info.cc`, `fw/git_info.h` and `fw/system_info.cc` of mjbots/moteus. Of
`servo_stats` and `servo_cmd` what nothing fills here is left out; a client goes by the names, which the schema gives.
"""

import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from sim_instruments.instruments.mjbots.commands import MODE_NAMES
from sim_instruments.instruments.mjbots.servo import MoteusStatus
from sim_instruments.instruments.mjbots.telemetry import Structure, TelemetryField

#: Model, ABI version of the firmware and of the registers, family and revision of the board (a moteus-n1).
_MODEL, _FIRMWARE, _REGISTER_MAP, _FAMILY, _REVISION = 0, 0x010100, 5, 1, 2
_POOL = 24000
_SQRT3 = math.sqrt(3.0)


@dataclass(frozen=True)
class Identification:
    """The identification of one unit: `serial` (three numbers) and `uuid` (16 bytes)."""

    serial: tuple[int, int, int]
    uuid: bytes

    @classmethod
    def of(cls, generator: np.random.Generator) -> "Identification":
        """Return that of a unit drawn by a generator."""
        first, second, third = (int(number) for number in generator.integers(0, 1 << 31, 3))
        return cls((first, second, third), generator.integers(0, 256, 16, dtype=np.uint8).tobytes())

    @property
    def words(self) -> tuple[int, ...]:
        """The UUID as four signed numbers."""
        return struct.unpack("<4i", self.uuid)

    @property
    def constants(self) -> Mapping[str, float]:
        """The register values of the identification, by their fields' names."""
        return {
            "model": _MODEL,
            "firmware": _FIRMWARE,
            "register_map": _REGISTER_MAP,
            "mask_capable": 1,
            **{f"serial_{place}": number for place, number in enumerate(self.serial)},
            **{f"uuid_{place}": number for place, number in enumerate(self.words)},
        }


class Channels:
    """Gives each channel's content. `altered` changes a reading on its way out, by its name."""

    def __init__(
        self,
        status: Callable[[], MoteusStatus],
        command: Callable[[], Mapping[str, float]],
        identification: Identification,
        milliseconds: Callable[[], int],
        altered: Callable[[str, float], float],
    ) -> None:
        self._status = status
        self._command = command
        self._identification = identification
        self._milliseconds = milliseconds
        self._altered = altered

    @property
    def by_name(self) -> Mapping[str, Callable[[], Structure]]:
        """The channels, in the order of their names."""
        return {
            "firmware": self._firmware,
            "git": self._git,
            "servo_cmd": self._servo_cmd,
            "servo_control": self._servo_control,
            "servo_stats": self._servo_stats,
            "system_info": self._system_info,
        }

    def _reading(self, name: str, value: float) -> TelemetryField:
        return TelemetryField("f32", self._altered(name, value))

    def _servo_stats(self) -> Structure:
        told, status = self._status(), self._status().seen
        a, b, c = phases(status.current, status.electrical_angle)
        return {
            "mode": TelemetryField("enum", int(told.mode), MODE_NAMES),
            "fault": TelemetryField("enum", told.fault, {}),
            "cur1_A": self._reading("cur1_A", a),
            "cur2_A": self._reading("cur2_A", b),
            "cur3_A": self._reading("cur3_A", c),
            "electrical_theta": self._reading("electrical_theta", status.electrical_angle),
            "bus_V": self._reading("bus_V", status.bus_voltage),
            "filt_bus_V": self._reading("filt_bus_V", status.bus_voltage),
            "filt_1ms_bus_V": self._reading("filt_1ms_bus_V", status.bus_voltage),
            "fet_temp_C": self._reading("fet_temp_C", status.board_temperature),
            "filt_fet_temp_C": self._reading("filt_fet_temp_C", status.board_temperature),
            "motor_temp_C": self._reading("motor_temp_C", status.motor_temperature),
            "filt_motor_temp_C": self._reading("filt_motor_temp_C", status.motor_temperature),
            "d_A": self._reading("d_A", status.current.real),
            "q_A": self._reading("q_A", status.current.imag),
            "position": self._reading("position", status.position),
            "velocity": self._reading("velocity", status.velocity),
            "torque_Nm": self._reading("torque_Nm", status.torque),
            "power_W": self._reading("power_W", status.power),
            "velocity_filt": self._reading("velocity_filt", status.velocity),
            "timeout_s": TelemetryField("f32", self._command()["timeout"]),
            "trajectory_done": TelemetryField("bool", 0),
            "sin": TelemetryField("f32", math.sin(status.electrical_angle)),
            "cos": TelemetryField("f32", math.cos(status.electrical_angle)),
        }

    def _servo_control(self) -> Structure:
        status = self._status().seen
        a, b, c = phases(status.voltage, status.electrical_angle)
        bus = status.bus_voltage
        # Balanced about the middle: the zero sequence puts the largest and the smallest at equal distances from it.
        middle = 0.5 * (max(a, b, c) + min(a, b, c))
        duty = [0.5 + (one - middle) / bus if status.voltage else 0.0 for one in (a, b, c)]
        return {
            "pwm": {name: TelemetryField("f32", value) for name, value in zip("abc", duty, strict=True)},
            "voltage": {name: TelemetryField("f32", value) for name, value in zip("abc", (a, b, c), strict=True)},
            "d_V": self._reading("d_V", status.voltage.real),
            "q_V": self._reading("q_V", status.voltage.imag),
            "i_d_A": TelemetryField("f32", status.commanded_current.real),
            "i_q_A": TelemetryField("f32", status.commanded_current.imag),
            "q_comp_A": TelemetryField("f32", 0.0),
            "torque_Nm": TelemetryField("f32", 0.0),
        }

    def _servo_cmd(self) -> Structure:
        command = self._command()
        return {
            "mode": TelemetryField("enum", command["mode"], MODE_NAMES),
            "d_V": TelemetryField("f32", command["d_voltage"]),
            "q_V": TelemetryField("f32", command["q_voltage"]),
            "i_d_A": TelemetryField("f32", command["d_current"]),
            "i_q_A": TelemetryField("f32", command["q_current"]),
            "position": TelemetryField("f32", command["position"]),
            "velocity": TelemetryField("f32", command["velocity"]),
            "max_torque_Nm": TelemetryField("f32", command["maximum_torque"]),
            "feedforward_Nm": TelemetryField("f32", command["feedforward_torque"]),
            "kp_scale": TelemetryField("f32", command["kp_scale"]),
            "kd_scale": TelemetryField("f32", command["kd_scale"]),
            "velocity_limit": TelemetryField("f32", command["velocity_limit"]),
            "accel_limit": TelemetryField("f32", command["accel_limit"]),
            "fixed_voltage_override": TelemetryField("f32", command["fixed_voltage"]),
            "fixed_current_override": TelemetryField("f32", command["fixed_current"]),
            "timeout_s": TelemetryField("f32", command["timeout"]),
        }

    def _firmware(self) -> Structure:
        return {
            "version": TelemetryField("u32", _FIRMWARE),
            "serial_number": TelemetryField("u32", self._identification.serial),
            "model": TelemetryField("u32", _MODEL),
            "family": TelemetryField("u8", _FAMILY),
            "hwrev": TelemetryField("u8", _REVISION),
        }

    def _git(self) -> Structure:
        return {
            "hash": TelemetryField("u8", (0,) * 20),
            "dirty": TelemetryField("bool", 0),
            "timestamp": TelemetryField("u64", 0),
        }

    def _system_info(self) -> Structure:
        return {
            "pool_size": TelemetryField("u32", _POOL),
            "pool_available": TelemetryField("u32", _POOL // 4),
            "idle_rate": TelemetryField("u32", 1000),
            "can_reset_count": TelemetryField("u32", 0),
            "ms_count": TelemetryField("u32", self._milliseconds() & 0xFFFFFFFF),
            "mem_error": TelemetryField("u32", 0),
        }


def phases(dq: complex, angle: float) -> tuple[float, float, float]:
    """Return the three phases' values of d + j·q at an electrical angle (rad)."""
    turned = dq * complex(math.cos(angle), math.sin(angle))
    across = 0.5 * _SQRT3 * turned.imag
    return turned.real, across - 0.5 * turned.real, -across - 0.5 * turned.real
