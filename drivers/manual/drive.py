"""A six-step drive that a person switches and reads."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.bases.always import always
from drivers.interfaces import BldcDrive, Clock, Reading
from drivers.interfaces.text import Text, text
from drivers.manual.by_hand import InstrumentByHand
from drivers.manual.options import ManualDriveOptions
from drivers.manual.prompt import Option, Prompt

#: What three signals may be; all alike is a fault, but it can be seen.
_HALL_STATES = [
    Option(int(digits), Text("{digits}", {"digits": digits})) for digits in (f"{number:03b}" for number in range(8))
]


class ManualDrive(InstrumentByHand[ManualDriveOptions], BldcDrive):
    """A six-step drive switched and read by hand."""

    def __init__(self, prompt: Prompt, clock: Clock, options: ManualDriveOptions, *, name: str = "drive") -> None:
        super().__init__(prompt, clock, options, name)

    @contextmanager
    def running(self) -> Iterator[None]:
        """Let the person switch the drive on at full voltage for the length of the block, then off, however it ends."""
        with always(self.make_safe):
            self._have_on(text("Switch the six-step drive on, at full voltage."))
            yield

    def measure_bus_voltage(self) -> Reading:
        """Ask for the DC link's voltage (V); raises MeasurementError where no accuracy is stated."""
        highest = self._options.maximum_voltage
        return self._reading(text("DC link voltage"), "V", 0.0, highest, self._options.voltage_accuracy)

    def measure_bus_current(self) -> Reading:
        """Ask for the current (A) out of the DC source; raises MeasurementError where no accuracy is stated."""
        highest, accuracy = self._options.maximum_current, self._options.current_accuracy
        return self._reading(
            text("current out of the DC source"),
            "A",
            -highest,
            highest,
            accuracy,
            stated_of=text("DC source's current"),
        )

    def measure_frequency(self) -> Reading:
        """Ask for the frequency (Hz) of a Hall signal; raises MeasurementError where no accuracy is stated."""
        highest, accuracy = self._options.maximum_frequency, self._options.frequency_accuracy
        return self._reading(
            text("frequency of a Hall signal"), "Hz", 0.0, highest, accuracy, stated_of=text("frequency")
        )

    def hall_state(self) -> tuple[bool, bool, bool]:
        """Ask for the three Hall signals, chosen as three digits; raises MeasurementError after unusable answers."""
        quantity = text("Hall signals H1 H2 H3 as three digits, each 0 or 1")
        digits = f"{self._questions.choose(quantity, _HALL_STATES):03d}"
        return digits[0] == "1", digits[1] == "1", digits[2] == "1"

    def make_safe(self) -> None:
        """Let the person switch the drive off."""
        self._have_off(text("Switch the six-step drive off and make sure that it is."))
