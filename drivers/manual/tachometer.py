"""A tachometer that a person reads."""

import math

from drivers.interfaces import Clock, Reading, Tachometer
from drivers.interfaces.text import text
from drivers.manual.by_hand import InstrumentByHand
from drivers.manual.options import ManualTachometerOptions
from drivers.manual.prompt import Prompt

RPM = 2 * math.pi / 60


class ManualTachometer(InstrumentByHand[ManualTachometerOptions], Tachometer):
    """A tachometer read by hand, in rpm."""

    def __init__(
        self, prompt: Prompt, clock: Clock, options: ManualTachometerOptions, *, name: str = "tachometer"
    ) -> None:
        super().__init__(prompt, clock, options, name)

    def measure_speed(self) -> Reading:
        """Ask for the speed in rpm and return it in rad/s (mechanical).

        Raises MeasurementError where no accuracy is stated or after three unusable answers.
        """
        accuracy = self._questions.stated(self._options.accuracy, text("speed"))
        value = self._questions.ask(text("speed"), "rpm", 0.0, self._options.maximum_speed / RPM)
        return Reading(value * RPM, "rad/s", accuracy, self._clock.now())

    def make_safe(self) -> None:
        """Do nothing: a tachometer only listens."""
