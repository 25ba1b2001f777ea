"""Keysight 34461A digital multimeter (Truevolt Series Operating and Service Guide), DC volts."""

from drivers.bases.found_state import WantedSetting
from drivers.bases.scpi_driver import ScpiDriver
from drivers.bases.set_points import check_setpoint
from drivers.interfaces import (
    Accuracy,
    Clock,
    IdentityError,
    MeasurementError,
    OverloadError,
    Reading,
    Voltmeter,
)
from drivers.interfaces.text import text, text_of
from drivers.keysight import dmm_34461a_data as data
from drivers.keysight.options import DMM_34461A_IDENTITY, Keysight34461AOptions
from drivers.transport.visa.opening import identify
from drivers.transport.visa.replies import is_overrange
from drivers.transport.visa.session import ScpiSession

READING_QUERY = "READ?"

#: What it may have been left with (Truevolt Operating and Service Guide; public programs).
FOUND_SETTINGS = (
    WantedSetting(
        "VOLT:DC:ZERO:AUTO?", ("1",), text("the offset drifts with the temperature"), "VOLT:DC:ZERO:AUTO {value}"
    ),
    WantedSetting(
        "VOLT:DC:NULL:STAT?", ("0",), text("a null value is subtracted"), "VOLT:DC:NULL:STAT {value}", optional=True
    ),
    WantedSetting("CALC:SCAL:STAT?", ("0",), text("readings are scaled"), "CALC:SCAL:STAT {value}", optional=True),
)


class Keysight34461A(ScpiDriver, Voltmeter):
    """A Keysight 34461A; the instrument is identified when this is made.

    Raises IdentityError where another instrument answers, or one without a range that the station calibrates.
    """

    _local = "SYST:LOC"

    def __init__(
        self,
        session: ScpiSession,
        clock: Clock,
        options: Keysight34461AOptions,
        *,
        name: str = "voltmeter",
        guarding: bool = False,
    ) -> None:
        super().__init__(session, clock, name)
        self._options = options
        self._identity = identify(session, DMM_34461A_IDENTITY, options.serial_number)
        for full_scale in options.calibration:
            if full_scale not in data.RANGES:
                raise IdentityError(
                    name,
                    text(
                        "{model} has ranges {ranges} V, not {full_scale:g} V",
                        model=self._identity.model,
                        ranges=[f"{one:g}" for one in data.RANGES],
                        full_scale=full_scale,
                    ),
                    remedy=text("Correct the calibration in the station file"),
                )
        self._range: float | None = None
        self._cycles = data.FEWEST_CYCLES
        session.check_left_errors()
        if not guarding:
            self._take_over(FOUND_SETTINGS)

    def configure(self, full_scale: float, power_line_cycles: float = 10.0) -> None:
        """Set the smallest range (V) that holds `full_scale`, and the integration time in power-line cycles.

        Integrates over 10 or 100 cycles, the lesser that suffices: no accuracy is stated for fewer.
        Raises SetpointError before anything is sent, ReportedError where the instrument refuses.
        """
        check_setpoint(self._name, "full scale", full_scale, "V", 0.0, data.HIGHEST_RANGE, "the model")
        check_setpoint(
            self._name,
            "integration time",
            power_line_cycles,
            "power-line cycles",
            data.FEWEST_CYCLES,
            data.MOST_CYCLES,
            "the model's stated accuracy",
        )
        chosen, cycles = data.range_for(full_scale), data.cycles_for(power_line_cycles)
        # CONFigure also brings back what the accuracy asks for (auto zero on), one reading a trigger, an immediate
        # trigger, and 10 MΩ of input resistance: nothing beside a winding, and an open lead reads near zero.
        for command in (f"CONF:VOLT:DC {chosen:g}", f"VOLT:DC:NPLC {cycles:g}"):
            self._session.write(command)
        self._range, self._cycles = chosen, cycles

    def measure_voltage(self) -> Reading:
        """Trigger one reading (V) and return it.

        Raises OverloadError beyond the range, MeasurementError where nothing was configured yet.
        """
        if self._range is None:
            raise MeasurementError(self._name, text("no range set"), remedy=text("Call configure() first"))
        value = self._session.query_number(READING_QUERY)
        if is_overrange(value):
            raise OverloadError(
                self._name,
                text("overload: beyond the range of {range:g} V", range=self._range),
                command=READING_QUERY,
                remedy=text("Check the sense leads, or ask for a larger full scale"),
            )
        return Reading(value, "V", self._accuracy(self._range), self._clock.now())

    @property
    def maximum_voltage(self) -> float:
        """The highest range (V), which the input withstands on every range (data sheet, input protection; one source)."""
        return data.HIGHEST_RANGE

    def accuracy_at(self, voltage: float) -> Accuracy:
        """Return the limits of error of a voltage (V) in the smallest range that holds it, integrated as set.

        A calibration of the station replaces the data sheet's. Raises MeasurementError beyond the highest range.
        """
        try:
            return self._accuracy(data.range_for(voltage))
        except ValueError as error:
            raise MeasurementError(self._name, text_of(error)) from error

    def make_safe(self) -> None:
        """Do nothing: a voltmeter only listens."""

    def _accuracy(self, full_scale: float) -> Accuracy:
        return self._options.calibration.get(full_scale) or data.stated_accuracy(full_scale, self._cycles)
