"""A tachometer that a person reads."""

import math

from drivers.interfaces import Clock, Identity, Reading
from drivers.manual.options import ManualTachometerOptions
from drivers.manual.prompt import Prompt, Questions

RPM = 2 * math.pi / 60


class ManualTachometer:
    """A tachometer read by hand, in rpm."""

    def __init__(
        self, prompt: Prompt, clock: Clock, options: ManualTachometerOptions, *, name: str = "tachometer"
    ) -> None:
        self._questions = Questions(prompt, name)
        self._clock = clock
        self._options = options

    @property
    def identity(self) -> Identity:
        """The model the station file names."""
        return Identity("", self._options.model)

    def measure_speed(self) -> Reading:
        """Ask for the speed in rpm and return it in rad/s (mechanical).

        Raises MeasurementError where no accuracy is stated or after three unusable answers.
        """
        accuracy = self._questions.stated(self._options.accuracy, "speed")
        value = self._questions.ask("speed", "rpm", 0.0, self._options.maximum_speed / RPM)
        return Reading(value * RPM, "rad/s", accuracy, self._clock.now())

    def make_safe(self) -> None:
        """Do nothing: a tachometer only listens."""

    def close(self) -> None:
        """Do nothing: there is no connection."""
