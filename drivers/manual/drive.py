"""A six-step drive that a person switches and reads."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.interfaces import Clock, Identity, MeasurementError, Reading
from drivers.manual.options import ManualDriveOptions
from drivers.manual.prompt import ATTEMPTS, Prompt, Questions
from drivers.safety import always


class ManualDrive:
    """A six-step drive switched and read by hand."""

    def __init__(self, prompt: Prompt, clock: Clock, options: ManualDriveOptions, *, name: str = "drive") -> None:
        self._questions = Questions(prompt, name)
        self._clock = clock
        self._options = options
        self._name = name

    @property
    def identity(self) -> Identity:
        """The model the station file names."""
        return Identity("", self._options.model)

    @contextmanager
    def running(self) -> Iterator[None]:
        """Have the drive switched on at full voltage for the length of the block, then off, however it ends."""
        with always(self.make_safe):
            self._questions.confirm("Switch the six-step drive on, at full voltage.")
            yield

    def measure_bus_voltage(self) -> Reading:
        """Ask for the DC link's voltage (V); raises MeasurementError where no accuracy is stated."""
        accuracy = self._questions.stated(self._options.voltage_accuracy, "DC link voltage")
        value = self._questions.ask("DC link voltage", "V", 0.0, self._options.maximum_voltage)
        return Reading(value, "V", accuracy, self._clock.now())

    def measure_bus_current(self) -> Reading:
        """Ask for the current (A) out of the DC source; raises MeasurementError where no accuracy is stated."""
        accuracy = self._questions.stated(self._options.current_accuracy, "DC source's current")
        highest = self._options.maximum_current
        value = self._questions.ask("current out of the DC source", "A", -highest, highest)
        return Reading(value, "A", accuracy, self._clock.now())

    def measure_frequency(self) -> Reading:
        """Ask for the frequency (Hz) of a Hall signal; raises MeasurementError where no accuracy is stated."""
        accuracy = self._questions.stated(self._options.frequency_accuracy, "frequency")
        value = self._questions.ask("frequency of a Hall signal", "Hz", 0.0, self._options.maximum_frequency)
        return Reading(value, "Hz", accuracy, self._clock.now())

    def hall_state(self) -> tuple[bool, bool, bool]:
        """Ask for the three Hall signals, typed as three digits; raises MeasurementError after unusable answers."""
        quantity = "Hall signals H1 H2 H3 as three digits, each 0 or 1"
        for _ in range(ATTEMPTS):
            typed = self._questions.ask(quantity, "", 0, 111)
            digits = f"{typed:03g}"
            if len(digits) == 3 and set(digits) <= {"0", "1"}:
                first, second, third = (digit == "1" for digit in digits)
                return first, second, third
        raise MeasurementError(self._name, f"Hall signals: {typed:g} is not three digits of 0 and 1")

    def make_safe(self) -> None:
        """Have the drive switched off."""
        self._questions.confirm("Switch the six-step drive off and make sure that it is.")

    def close(self) -> None:
        """Do nothing: there is no connection."""
