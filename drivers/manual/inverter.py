"""An inverter that a person runs and reads."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.interfaces import Clock, Identity, Reading
from drivers.limits import check_setpoint
from drivers.manual.options import ManualInverterOptions
from drivers.manual.prompt import Prompt, Questions
from drivers.safety import always


class ManualInverter:
    """An inverter run and read by hand."""

    def __init__(self, prompt: Prompt, clock: Clock, options: ManualInverterOptions, *, name: str = "inverter") -> None:
        self._questions = Questions(prompt, name)
        self._clock = clock
        self._options = options
        self._name = name

    @property
    def identity(self) -> Identity:
        """The model the station file names."""
        return Identity("", self._options.model)

    @property
    def read_by_hand(self) -> bool:
        """Always so."""
        return True

    @property
    def maximum_current(self) -> float:
        """Largest phase current (A, peak) that may be commanded: the station's limit."""
        return self._options.maximum_current

    @property
    def maximum_frequency(self) -> float:
        """Largest electrical frequency (Hz) that may be commanded: the station's limit."""
        return self._options.maximum_frequency

    @contextmanager
    def driving_frequency(self, frequency: float, current: float) -> Iterator[None]:
        """Have the field turned at a frequency (Hz) with a phase current (A, peak), then the inverter switched off."""
        check_setpoint(
            self._name, "frequency", frequency, "Hz", -self.maximum_frequency, self.maximum_frequency, "the station"
        )
        check_setpoint(self._name, "current", current, "A", 0.0, self.maximum_current, "the station")
        with always(self.make_safe):
            self._questions.confirm(
                f"Start the inverter at {frequency:g} Hz with {current:g} A peak and wait until the ramp has ended."
            )
            yield

    @contextmanager
    def driving_current(self, current: float) -> Iterator[None]:
        """Have a q-axis current (A, peak) regulated for the length of the block, then the inverter switched off."""
        self._check_current(current)
        with always(self.make_safe):
            self._ask_current(current)
            yield

    def set_current(self, current: float) -> None:
        """Have the q-axis current (A, peak) changed; raises SetpointError before anything is asked."""
        self._check_current(current)
        self._ask_current(current)

    def command_zero(self) -> None:
        """Have current and frequency commanded to zero."""
        self._questions.confirm("Command a current and a frequency of zero.")

    def measure_frequency(self) -> Reading:
        """Ask for the frequency (Hz) the inverter shows; raises MeasurementError where no accuracy is stated."""
        accuracy = self._questions.stated(self._options.frequency_accuracy, "frequency")
        highest = self.maximum_frequency
        value = self._questions.ask("electrical frequency", "Hz", -highest, highest)
        return Reading(value, "Hz", accuracy, self._clock.now())

    def measure_current(self) -> Reading:
        """Ask for the q-axis current (A, peak) the inverter shows; raises MeasurementError without an accuracy."""
        accuracy = self._questions.stated(self._options.current_accuracy, "current")
        highest = self.maximum_current
        value = self._questions.ask("q-axis current, peak", "A", -highest, highest)
        return Reading(value, "A", accuracy, self._clock.now())

    def make_safe(self) -> None:
        """Have the inverter switched off."""
        self._questions.confirm("Switch the inverter off.")

    def close(self) -> None:
        """Do nothing: there is no connection."""

    def _check_current(self, current: float) -> None:
        highest = self.maximum_current
        check_setpoint(self._name, "current", current, "A", -highest, highest, "the station")

    def _ask_current(self, current: float) -> None:
        self._questions.confirm(f"Set the inverter to regulate a torque-producing current of {current:g} A peak.")
