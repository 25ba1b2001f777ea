"""Readings of a moteus: currents, speed and temperatures by registers, voltages and angle by its diagnostic stream."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from drivers.interfaces import Accuracy, Clock, CommunicationError, DqReading
from drivers.interfaces.text import text
from drivers.mjbots.configuration import MoteusConfiguration
from drivers.mjbots.controller import MoteusController
from drivers.mjbots.diagnostics import DiagnosticStream
from drivers.mjbots.multiplex import FLOAT, INT8, read
from drivers.mjbots.options import MoteusOptions
from drivers.mjbots.power_stage import MoteusPowerStage
from drivers.mjbots.registers import CURRENT, Register

_REGISTERS = (
    read(Register.MODE, 1, INT8)
    + read(Register.VELOCITY, 1, FLOAT)
    + read(Register.Q_CURRENT, 2, FLOAT)
    + read(Register.MOTOR_TEMPERATURE, 1, FLOAT)
    + read(Register.BUS_VOLTAGE, 2, FLOAT)
    + read(Register.FAULT, 1, INT8)
)
_NUMBERS = (
    Register.MODE,
    Register.VELOCITY,
    Register.Q_CURRENT,
    Register.D_CURRENT,
    Register.BUS_VOLTAGE,
    Register.BOARD_TEMPERATURE,
    Register.FAULT,
)

_ASSUMED = 0.05
_CURRENT_STEP, _VOLTAGE_STEP = 0.1, 0.01
_SOURCE = "assumed, 5 % of reading: the maker states no accuracy; enter a calibration"
_FREQUENCY = Accuracy(gain=1e-3, offset=0.05, source="assumed, 0.1 % and 0.05 Hz: the maker states no accuracy")


@dataclass(frozen=True)
class MoteusSample:
    """Readings of one instant: registers, and the voltages (V) where it regulates."""

    time: float
    registers: Mapping[int, float]
    voltages: tuple[float, float]


class MoteusReadings:
    """The readings of one controller, in the rotor's frame of its output's direction."""

    def __init__(
        self,
        controller: MoteusController,
        stream: DiagnosticStream,
        power: MoteusPowerStage,
        clock: Clock,
        configuration: MoteusConfiguration,
        options: MoteusOptions,
    ) -> None:
        self._controller = controller
        self._stream = stream
        self._power = power
        self._clock = clock
        self._configuration = configuration
        self._options = options

    @property
    def current_accuracy(self) -> Accuracy:
        """The accuracy of the currents."""
        return self._options.current_accuracy or Accuracy(
            gain=_ASSUMED, offset=_CURRENT_STEP, resolution=_CURRENT_STEP, source=_SOURCE
        )

    @property
    def voltage_accuracy(self) -> Accuracy:
        """The accuracy of the voltages."""
        return self._options.voltage_accuracy or Accuracy(
            gain=_ASSUMED, offset=_VOLTAGE_STEP, resolution=_VOLTAGE_STEP, source=_SOURCE
        )

    @property
    def frequency_accuracy(self) -> Accuracy:
        """The accuracy of the electrical frequency."""
        return self._options.frequency_accuracy or _FREQUENCY

    def registers(self) -> Mapping[int, float]:
        """Return mode, fault, speed, currents, bus voltage and temperatures as they are now."""
        return self._controller.ask(_REGISTERS, "read registers", _NUMBERS, (Register.MOTOR_TEMPERATURE,))

    def frequency(self, registers: Mapping[int, float]) -> float:
        """Return the electrical frequency (Hz)."""
        configuration = self._configuration
        return registers[Register.VELOCITY] / configuration.ratio * configuration.pole_pairs

    def angle(self) -> float:
        """Return the rotor's electrical angle (rad, 0 … 2π)."""
        return self._angle()

    def electrical_angle(self, position: float) -> float:
        """Return by how much (rad, electrical) the rotor has turned at a position (turns of the output) from where that is 0."""
        configuration = self._configuration
        return 2.0 * math.pi * position / configuration.ratio * configuration.pole_pairs

    def measure(self, duration: float) -> DqReading:
        """Return the means of what it says within `duration` (s), one sample where that is 0.

        Raises MeasurementError where its output is limited, ReportedError where it is at fault.
        """
        began = self._clock.now()
        samples = [self._sample()]
        while self._clock.now() + self._options.sample_interval <= began + duration:
            self._clock.sleep(self._options.sample_interval)
            samples.append(self._sample())
        return self._reading(samples, self._angle(), duration)

    def _sample(self) -> MoteusSample:
        registers = self.registers()
        mode = round(registers[Register.MODE])
        if mode != CURRENT:
            if mode != 0:
                raise self._power.left(registers, "read registers")
            # A stage that is off puts out no voltage of its own.
            return MoteusSample(self._clock.now(), registers, (math.nan, math.nan))
        if (limited := self._power.limited(registers)) is not None:
            raise limited
        return MoteusSample(self._clock.now(), registers, self._voltages())

    def _voltages(self) -> tuple[float, float]:
        control = self._stream.telemetry("servo_control")
        return _value(self._controller, control, "d_V"), _value(self._controller, control, "q_V")

    def _angle(self) -> float:
        """Return the rotor's electrical angle (rad, 0 … 2π), counted as speed and q-axis current are."""
        angle = _value(self._controller, self._stream.telemetry("servo_stats"), "electrical_theta")
        return (self._configuration.sign * angle) % (2.0 * math.pi)

    def _reading(self, samples: Sequence[MoteusSample], angle: float, duration: float) -> DqReading:
        def mean(register: Register) -> float:
            return math.fsum(one.registers[register] for one in samples) / len(samples)

        d_voltage, q_voltage = (
            math.fsum(axis) / len(samples) for axis in zip(*(one.voltages for one in samples), strict=True)
        )
        warm = mean(Register.MOTOR_TEMPERATURE) if self._configuration.has_motor_temperature else math.nan
        return DqReading(
            time=0.5 * (samples[0].time + samples[-1].time),
            d_current=mean(Register.D_CURRENT),
            q_current=mean(Register.Q_CURRENT),
            d_voltage=d_voltage,
            q_voltage=q_voltage,
            electrical_speed=2.0 * math.pi * math.fsum(self.frequency(one.registers) for one in samples) / len(samples),
            electrical_angle=angle,
            current_accuracy=self.current_accuracy,
            voltage_accuracy=self.voltage_accuracy,
            bus_voltage=mean(Register.BUS_VOLTAGE),
            winding_temperature=warm,
            board_temperature=mean(Register.BOARD_TEMPERATURE),
            duration=duration,
            samples=len(samples),
        )


def _value(controller: MoteusController, values: Mapping[str, object], name: str) -> float:
    result = values.get(name)
    if not isinstance(result, float) or not math.isfinite(result):
        raise CommunicationError(
            controller.name,
            text("its telemetry has no number {name}", name=name),
            remedy=text("Update its firmware, or take another drive"),
        )
    return result
