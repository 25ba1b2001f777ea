"""An inverter that a person runs and reads."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.bases.always import always
from drivers.interfaces import Clock, Inverter, InverterAbility, Reading
from drivers.interfaces.text import text
from drivers.manual.by_hand import InstrumentByHand
from drivers.manual.options import INVERTER_ABILITIES, ManualInverterOptions
from drivers.manual.prompt import Prompt


class ManualInverter(InstrumentByHand[ManualInverterOptions], Inverter):
    """An inverter run and read by hand."""

    def __init__(self, prompt: Prompt, clock: Clock, options: ManualInverterOptions, *, name: str = "inverter") -> None:
        super().__init__(prompt, clock, options, name)

    @property
    def abilities(self) -> frozenset[InverterAbility]:
        """Capabilities of a person at an inverter: to set a frequency, and a q-axis current."""
        return INVERTER_ABILITIES

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
        """Let the person turn the field at a frequency (Hz) with a phase current (A, peak), then switch the inverter off."""
        self._check("driving_frequency", frequency, current)
        with always(self.make_safe):
            self._have_on(
                text(
                    "Start the inverter at {frequency:g} Hz with {current:g} A peak and wait until the ramp has ended.",
                    frequency=frequency,
                    current=current,
                )
            )
            yield

    @contextmanager
    def driving_current(self, current: float) -> Iterator[None]:
        """Let the person regulate a q-axis current (A, peak) for the length of the block, then switch the inverter off."""
        self._check("driving_current", current)
        with always(self.make_safe):
            self._ask_current(current)
            yield

    def set_current(self, current: float) -> None:
        """Let the person change the q-axis current (A, peak); raises SetpointError before anything is asked."""
        self._check("set_current", current)
        self._ask_current(current)

    def command_zero(self) -> None:
        """Let the person command current and frequency to zero."""
        if not self._is_off:
            self._questions.confirm(text("Command a current and a frequency of zero."))

    def measure_frequency(self) -> Reading:
        """Ask for the frequency (Hz) the inverter shows; raises MeasurementError where no accuracy is stated."""
        highest = self.maximum_frequency
        return self._reading(
            text("electrical frequency"),
            "Hz",
            -highest,
            highest,
            self._options.frequency_accuracy,
            stated_of=text("frequency"),
        )

    def measure_current(self) -> Reading:
        """Ask for the q-axis current (A, peak) the inverter shows; raises MeasurementError without an accuracy."""
        highest = self.maximum_current
        return self._reading(
            text("q-axis current, peak"),
            "A",
            -highest,
            highest,
            self._options.current_accuracy,
            stated_of=text("current"),
        )

    def make_safe(self) -> None:
        """Let the person switch the inverter off."""
        self._have_off(text("Switch the inverter off."))

    def _ask_current(self, current: float) -> None:
        self._have_on(
            text("Set the inverter to regulate a torque-producing current of {current:g} A peak.", current=current)
        )
