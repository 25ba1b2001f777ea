"""A supply that a person sets and reads."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.bases.always import always
from drivers.interfaces import Clock, OutputMode, Reading, Regulated, Supply
from drivers.interfaces.text import text
from drivers.manual.by_hand import InstrumentByHand
from drivers.manual.options import ManualSupplyOptions
from drivers.manual.prompt import Option, Prompt

#: What is asked of the output.
REGULATION = text("regulation, by the lamp that is lit")
#: What the person chooses by the lamp that is lit.
MODES = {
    OutputMode.OFF: Option(0, text("off")),
    OutputMode.CONSTANT_CURRENT: Option(1, text("constant current"), "CC"),
    OutputMode.CONSTANT_VOLTAGE: Option(2, text("constant voltage"), "CV"),
    OutputMode.TRIPPED: Option(3, text("tripped")),
}

#: A meter at its limit shows a little more or less than the limit: so much of it is taken.
_SHOWN = 1.1


class ManualSupply(InstrumentByHand[ManualSupplyOptions], Supply):
    """A supply set and read by hand."""

    def __init__(self, prompt: Prompt, clock: Clock, options: ManualSupplyOptions, *, name: str = "supply") -> None:
        super().__init__(prompt, clock, options, name)

    @property
    def maximum_voltage(self) -> float:
        """Largest voltage (V) that may be set: the station's limit."""
        return self._options.maximum_voltage

    @property
    def maximum_current(self) -> float:
        """Largest current limit (A) that may be set: the station's limit."""
        return self._options.maximum_current

    def configure(self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE) -> None:
        """Let the person set voltage (V), current limit (A) and protections; raises SetpointError before anything is asked."""
        self._check("configure", voltage, current_limit)
        if regulated is Regulated.VOLTAGE:
            self._questions.confirm(
                text(
                    "Set the supply to {voltage:g} V, current limit {current_limit:g} A; over-current protection on where it has one.",
                    voltage=voltage,
                    current_limit=current_limit,
                )
            )
        else:
            self._questions.confirm(
                text(
                    "Set the supply to {voltage:g} V, current limit {current_limit:g} A; over-current protection off: "
                    "the supply regulates the current.",
                    voltage=voltage,
                    current_limit=current_limit,
                )
            )

    @contextmanager
    def energised(
        self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE
    ) -> Iterator[None]:
        """Let the person set the supply (V, A) and switch it on for the length of the block, then off, however it ends."""
        self.configure(voltage, current_limit, regulated)
        with always(self.output_off):
            self._have_on(text("Switch the supply's output on."))
            yield

    def output_off(self) -> None:
        """Let the person switch the output off; one who has said that it is off is not asked again."""
        self._have_off(text("Switch the supply's output off and make sure that it is."))

    def output_mode(self) -> OutputMode:
        """Ask what regulates the output; raises MeasurementError after three unusable answers."""
        chosen = self._questions.choose(REGULATION, [*MODES.values()])
        return next(mode for mode, option in MODES.items() if option.number == chosen)

    def measure_voltage(self) -> Reading:
        """Ask for the voltage (V) the supply shows; raises MeasurementError where no accuracy is stated."""
        return self._reading(text("voltage"), "V", 0.0, self.maximum_voltage, self._options.voltage_accuracy)

    def measure_current(self) -> Reading:
        """Ask for the current (A) the supply shows; raises MeasurementError where no accuracy is stated."""
        return self._reading(text("current"), "A", 0.0, _SHOWN * self.maximum_current, self._options.current_accuracy)

    def make_safe(self) -> None:
        """Let the person switch the output off."""
        self.output_off()
