"""An LCR meter that a person reads."""

import math

from drivers.bases.set_points import check_setpoint
from drivers.interfaces import (
    Accuracy,
    Aperture,
    Clock,
    ImpedanceReading,
    LcrMeter,
    MeasurementError,
    NotOfferedError,
    Wanted,
)
from drivers.interfaces.text import text
from drivers.manual.by_hand import InstrumentByHand
from drivers.manual.options import ManualLcrMeterOptions
from drivers.manual.prompt import Prompt


class ManualLcrMeter(InstrumentByHand[ManualLcrMeterOptions], LcrMeter):
    """An LCR meter read by hand."""

    def __init__(
        self, prompt: Prompt, clock: Clock, options: ManualLcrMeterOptions, *, name: str = "lcr_meter"
    ) -> None:
        super().__init__(prompt, clock, options, name)
        self._frequency = 0.0

    @property
    def maximum_frequency(self) -> float:
        """Largest test frequency (Hz) that the station file names; infinite where it names none."""
        return max(self._options.frequencies, default=math.inf)

    @property
    def source_impedance(self) -> float:
        """Impedance (Ω) of the signal source, as the station file states it."""
        return self._options.source_impedance

    def configure(self, frequency: float, level: float = 1.0, aperture: Aperture = Aperture.MEDIUM) -> None:
        """Let the person set series R and L and the frequency (Hz); level (V rms) and aperture are as the meter has them.

        Raises SetpointError where the meter does not offer the frequency or the level.
        """
        check_setpoint(self._name, "level", level, "V rms", 0.0, self._options.maximum_level, "the meter")
        if self._options.direct_current:
            self._questions.confirm(text("Set the meter to resistance."))
            return
        offered = self._options.frequencies
        check_setpoint(self._name, "frequency", frequency, "Hz", 0.0, 1e9, "the meter")
        if offered and not any(math.isclose(frequency, one, rel_tol=1e-6) for one in offered):
            raise NotOfferedError(self._name, "frequency", frequency, "Hz", offered)
        self._frequency = frequency
        self._questions.confirm(
            text("Set the meter to series R and L (Ls, Rs) at {frequency:g} Hz.", frequency=frequency)
        )

    def correct_short(self) -> None:
        """Let the person short the leads and zero the meter."""
        self._questions.confirm(text("Clip the meter's leads together and zero it (short correction)."))

    def measure(self, wanted: Wanted = Wanted.BOTH) -> ImpedanceReading:
        """Ask for what is wanted; the other is NaN. A meter of direct current is asked for the resistance only.

        Raises MeasurementError where no accuracy is stated, the frequency was not set, or after three unusable answers.
        """
        if not self._options.direct_current and self._frequency == 0:
            raise MeasurementError(self._name, text("no frequency set"), remedy=text("Call configure() first"))
        resistance = inductance = math.nan
        r_accuracy = l_accuracy = Accuracy()
        context = None if self._options.direct_current else text("at {frequency:g} Hz", frequency=self._frequency)
        if wanted is not Wanted.INDUCTANCE:
            r_accuracy = self._questions.stated(self._options.resistance_accuracy, text("resistance"))
            resistance = self._questions.ask(text("resistance Rs"), "Ω", 0.0, self._options.maximum_resistance, context)
        if wanted is not Wanted.RESISTANCE and not self._options.direct_current:
            l_accuracy = self._questions.stated(self._options.inductance_accuracy, text("inductance"))
            inductance = self._questions.ask(text("inductance Ls"), "H", 0.0, self._options.maximum_inductance, context)
        return ImpedanceReading(resistance, inductance, self._frequency, r_accuracy, l_accuracy, self._clock.now())

    def accuracy_at(
        self,
        resistance: float,
        inductance: float,
        frequency: float,
        level: float | None = None,
        aperture: Aperture | None = None,
    ) -> tuple[Accuracy, Accuracy]:
        """Return the accuracies of the station file, the same for every resistance (Ω), inductance (H) and setting.

        Raises MeasurementError where the value is beyond the meter's range or no accuracy is stated.
        """
        options = self._options
        if abs(resistance) > options.maximum_resistance or abs(inductance) > options.maximum_inductance:
            raise MeasurementError(
                self._name,
                text(
                    "{resistance:g} Ω and {inductance:g} H at {frequency:g} Hz are beyond its range",
                    resistance=resistance,
                    inductance=inductance,
                    frequency=frequency,
                ),
            )
        unknown = Accuracy()
        if options.resistance_accuracy is None and options.inductance_accuracy is None:
            self._questions.stated(None, text("resistance"))
        return options.resistance_accuracy or unknown, options.inductance_accuracy or unknown

    def make_safe(self) -> None:
        """Do nothing: a meter is harmless."""
