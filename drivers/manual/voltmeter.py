"""A DC voltmeter that a person reads."""

from drivers.bases.set_points import check_setpoint
from drivers.interfaces import Accuracy, Clock, MeasurementError, Reading, Voltmeter
from drivers.interfaces.text import text
from drivers.manual.by_hand import InstrumentByHand
from drivers.manual.options import ManualVoltmeterOptions
from drivers.manual.prompt import Prompt


class ManualVoltmeter(InstrumentByHand[ManualVoltmeterOptions], Voltmeter):
    """A multimeter on DC volts, read by hand."""

    def __init__(
        self, prompt: Prompt, clock: Clock, options: ManualVoltmeterOptions, *, name: str = "voltmeter"
    ) -> None:
        super().__init__(prompt, clock, options, name)
        self._full_scale: float | None = None

    @property
    def maximum_voltage(self) -> float:
        """The range (V) that the station file states."""
        return self._options.maximum_voltage

    def configure(self, full_scale: float, power_line_cycles: float = 10.0) -> None:
        """Let the person set DC volts, the smallest range (V) that holds `full_scale`, and the integration time in line cycles.

        Raises SetpointError before anything is asked.
        """
        check_setpoint(self._name, "full scale", full_scale, "V", 0.0, self._options.maximum_voltage, "the station")
        check_setpoint(self._name, "integration time", power_line_cycles, "power-line cycles", 0.0, 1e3, "any meter")
        self._questions.confirm(
            text(
                "Set the voltmeter to DC volts, the smallest range that holds {full_scale:g} V, "
                "integrating over {power_line_cycles:g} power-line cycles or its slowest rate.",
                full_scale=full_scale,
                power_line_cycles=power_line_cycles,
            )
        )
        self._full_scale = full_scale

    def measure_voltage(self) -> Reading:
        """Ask for the voltage in V, which lies within the full scale asked for, so that millivolts typed are noticed.

        Raises MeasurementError where no accuracy is stated, no range was set, or after three unusable answers.
        """
        if self._full_scale is None:
            raise MeasurementError(self._name, text("no range set"), remedy=text("Call configure() first"))
        highest = self._full_scale
        return self._reading(
            text("DC voltage"),
            "V",
            -highest,
            highest,
            self._options.accuracy,
            stated_of=text("voltage"),
            context=text("with its sign, in volts"),
        )

    def accuracy_at(self, voltage: float) -> Accuracy:
        """Return the accuracy of the station file, the same for every voltage (V).

        Raises MeasurementError where the voltage is beyond the meter's range or no accuracy is stated.
        """
        if abs(voltage) > self._options.maximum_voltage:
            raise MeasurementError(
                self._name,
                text(
                    "{voltage:g} V is beyond its range, {maximum_voltage:g} V",
                    voltage=voltage,
                    maximum_voltage=self._options.maximum_voltage,
                ),
            )
        return self._questions.stated(self._options.accuracy, text("voltage"))

    def make_safe(self) -> None:
        """Do nothing: a voltmeter only listens."""
