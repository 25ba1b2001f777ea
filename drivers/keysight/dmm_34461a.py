"""Keysight 34461A digital multimeter (Truevolt Series Operating and Service Guide), DC volts."""

from typing import TYPE_CHECKING

from drivers.bases.set_points import check_setpoint
from drivers.interfaces import (
    UNWATCHED,
    Accuracy,
    Calls,
    Clock,
    Identity,
    IdentityError,
    MeasurementError,
    OverloadError,
    Reading,
    Traffic,
)
from drivers.keysight import dmm_34461a_data as data
from drivers.keysight.options import Keysight34461AOptions
from drivers.transport.visa.opening import KEYSIGHT, identify, open_driver, open_session
from drivers.transport.visa.replies import is_overrange
from drivers.transport.visa.session import ScpiSession

if TYPE_CHECKING:
    from pyvisa import ResourceManager

READING_QUERY = "READ?"


class Keysight34461A:
    """A Keysight 34461A; the instrument is identified when this is made.

    Raises IdentityError where another instrument answers, or one without a range that the station calibrates.
    """

    def __init__(
        self, session: ScpiSession, clock: Clock, options: Keysight34461AOptions, *, name: str = "voltmeter"
    ) -> None:
        self._session = session
        self._clock = clock
        self._options = options
        self._name = name
        self._identity = identify(session, KEYSIGHT, ("34461A",), options.serial_number)
        for full_scale in options.calibration:
            if full_scale not in data.RANGES:
                raise IdentityError(
                    name,
                    f"{self._identity.model} has ranges {', '.join(f'{one:g}' for one in data.RANGES)} V, "
                    f"not {full_scale:g} V",
                    remedy="Correct the calibration in the station file",
                )
        self._range: float | None = None
        self._cycles = data.FEWEST_CYCLES
        session.check_errors()

    @property
    def identity(self) -> Identity:
        """Who answered *IDN? when this was opened."""
        return self._identity

    @property
    def read_by_hand(self) -> bool:
        """Never: it answers by itself."""
        return False

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
            raise MeasurementError(self._name, "no range set", remedy="Call configure() first")
        value = self._session.query_number(READING_QUERY)
        if is_overrange(value):
            raise OverloadError(
                self._name,
                f"overload: beyond the range of {self._range:g} V",
                command=READING_QUERY,
                remedy="Check the sense leads, or ask for a larger full scale",
            )
        return Reading(value, "V", self._accuracy(self._range), self._clock.now())

    def accuracy_at(self, voltage: float) -> Accuracy:
        """Return the limits of error of a voltage (V) in the smallest range that holds it, integrated as set.

        A calibration of the station replaces the data sheet's. Raises MeasurementError beyond the highest range.
        """
        try:
            return self._accuracy(data.range_for(voltage))
        except ValueError as error:
            raise MeasurementError(self._name, str(error)) from error

    def make_safe(self) -> None:
        """Do nothing: a voltmeter only listens."""

    def close(self) -> None:
        """Close the connection."""
        self._session.close()

    def _accuracy(self, full_scale: float) -> Accuracy:
        return self._options.calibration.get(full_scale) or data.stated_accuracy(full_scale, self._cycles)


def open_keysight_34461a(
    address: str,
    manager: "ResourceManager",
    clock: Clock,
    options: Keysight34461AOptions,
    *,
    name: str = "voltmeter",
    traffic: Traffic | None = None,
    calls: Calls = UNWATCHED,
) -> Keysight34461A:
    """Open a 34461A at a VISA address.

    Raises CommunicationError where nothing answers, IdentityError where something else does.
    """
    session = open_session(address, manager, name, traffic=traffic, calls=calls)
    return open_driver(session, lambda session: Keysight34461A(session, clock, options, name=name))
