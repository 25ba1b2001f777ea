"""Keysight E4980A and E4980AL LCR meters, series R and L.

Sources: the maker's User's Guide (E4980-90230), and for trigger, function and level pymeasure's agilentE4980, which was used
with one and sends INIT:CONT ON before TRIG:IMM. What it may have been left with is in public programs, too.
"""

import math

from drivers.bases.scpi_driver import ScpiDriver
from drivers.bases.set_points import check_setpoint, lesser
from drivers.interfaces import (
    Accuracy,
    Aperture,
    Clock,
    ImpedanceReading,
    LcrMeter,
    MeasurementError,
    OverloadError,
    ReportedError,
    Wanted,
)
from drivers.interfaces.text import text
from drivers.keysight import e4980a_data as data
from drivers.keysight.e4980a_settings import found_settings
from drivers.keysight.options import E4980A_IDENTITY, E4980AOptions, ImpedanceCalibration
from drivers.transport.visa.opening import identify
from drivers.transport.visa.replies import is_overrange
from drivers.transport.visa.session import ScpiSession

#: Status of a reading (User's Guide, "Data format"): no data and overload carry 9.9E37, the others real data.
NO_DATA, GOOD, OVERLOAD, SOURCE_OVERLOAD, LEVEL_LOST = -1, 0, 1, 3, 4
STATUS_TEXT = {
    NO_DATA: text("no data in the buffer"),
    OVERLOAD: text("overload: beyond the range, or the terminals are open"),
    SOURCE_OVERLOAD: text("the signal source was overloaded"),
    LEVEL_LOST: text("the level control could not hold the level"),
}

#: A short correction measures every correction frequency; that takes up to two minutes.
CORRECTION_TIMEOUT = 180.0
#: Digits after the point of the mantissa in the reply (format SN.NNNNNESNN).
REPLY_DIGITS = 5
#: A calibration point holds for frequencies this close (relative).
CALIBRATION_WINDOW = 1e-3


class KeysightE4980A(ScpiDriver, LcrMeter):
    """A Keysight E4980A or E4980AL; the instrument is identified when this is made, and its options are read.

    Raises IdentityError where another instrument answers.
    """

    def __init__(
        self,
        session: ScpiSession,
        clock: Clock,
        options: E4980AOptions,
        *,
        name: str = "lcr_meter",
        guarding: bool = False,
    ) -> None:
        super().__init__(session, clock, name)
        self._options = options
        self._identity = identify(session, E4980A_IDENTITY, options.serial_number)
        self._maximum_frequency, self._frequency_owner = lesser(self._model_frequency(), options.maximum_frequency)
        self._maximum_level, self._level_owner = lesser(data.MAXIMUM_LEVEL, options.maximum_level)
        self._frequency: float | None = None
        self._level, self._aperture = 1.0, Aperture.MEDIUM
        # The E4980AL has no DC bias (data sheet, "DC bias signal"); what the front panel left on must not reach a motor.
        self._without_bias = () if self._is_al() else ("BIAS:STAT OFF",)
        session.check_left_errors()
        if not guarding:
            self._take_over(found_settings(has_bias=not self._is_al()))

    @property
    def maximum_frequency(self) -> float:
        """Largest test frequency (Hz): the lesser of the model's, by its option, and the station's."""
        return self._maximum_frequency

    def configure(self, frequency: float, level: float = 1.0, aperture: Aperture = Aperture.MEDIUM) -> None:
        """Set series L and R, frequency (Hz), level (V rms) and measurement time, triggered over the bus, without DC bias.

        Raises SetpointError before anything is sent, ReportedError where the instrument refuses.
        """
        check_setpoint(
            self._name,
            "frequency",
            frequency,
            "Hz",
            data.MINIMUM_FREQUENCY,
            self._maximum_frequency,
            self._frequency_owner,
        )
        check_setpoint(self._name, "level", level, "V rms", 5e-3, self._maximum_level, self._level_owner)
        for command in (
            *self._without_bias,
            "FUNC:IMP LSRS",
            "FUNC:IMP:RANG:AUTO ON",
            f"FREQ {frequency:.9g}",
            f"VOLT {level:.6g}",
            f"APER {aperture.value},1",
            "FORM ASC",
            "TRIG:SOUR BUS",
            # Without it the trigger is ignored (−211), and FETC? gives what was there before.
            "INIT:CONT ON",
        ):
            self._session.write(command)
        self._frequency, self._level, self._aperture = frequency, level, aperture

    def correct_short(self) -> None:
        """Measure the shorted leads and subtract them from now on; takes up to two minutes.

        Raises ReportedError where the instrument refuses or does not switch the correction on.
        """
        self._session.complete("CORR:SHOR:EXEC", timeout=CORRECTION_TIMEOUT)
        self._session.check_errors("CORR:SHOR:EXEC")
        self._session.write("CORR:SHOR:STAT ON")
        if self._session.query_number("CORR:SHOR:STAT?") != 1:
            raise ReportedError(self._name, text("short correction is still off"), command="CORR:SHOR:STAT ON")

    @property
    def source_impedance(self) -> float:
        """Impedance (Ω) of the signal source."""
        return data.SOURCE_IMPEDANCE

    def measure(self, wanted: Wanted = Wanted.BOTH) -> ImpedanceReading:
        """Trigger one measurement and return series resistance (Ω) and inductance (H) at the frequency set.

        Raises OverloadError where there is no value, MeasurementError where the status is not good
        or nothing was configured yet.
        """
        if self._frequency is None:
            raise MeasurementError(
                self._name, text("no function and frequency set"), remedy=text("Call configure() first")
            )
        # Complete before fetching: a fetch in between gets the previous values, or none.
        self._session.complete("TRIG:IMM")
        # An ignored trigger is told in the error queue only, and leaves the reading before it to be fetched.
        self._session.check_errors("TRIG:IMM")
        inductance, resistance, status, *_ = self._session.query_numbers("FETC?", 3, 4)
        self._check_status(int(status), inductance, resistance)
        r_accuracy, l_accuracy = self.accuracy_at(resistance, inductance, self._frequency)
        return ImpedanceReading(
            resistance,
            inductance,
            self._frequency,
            _with_resolution(r_accuracy, resistance),
            _with_resolution(l_accuracy, inductance),
            self._clock.now(),
        )

    def accuracy_at(
        self,
        resistance: float,
        inductance: float,
        frequency: float,
        level: float | None = None,
        aperture: Aperture | None = None,
    ) -> tuple[Accuracy, Accuracy]:
        """Return the limits of error of a resistance (Ω) and an inductance (H) at a frequency (Hz).

        Level (V rms) and measurement time are those that are set where they are not given.

        Ae = (Ab + Zs/|Z| + Yo·|Z|)·Kt, times √(1 + Q²) for R where Q > 0.1 and √(1 + D²) for L where D > 0.1
        (data sheet, "Basic accuracy"). A calibration point of the station replaces it.
        Raises MeasurementError where neither states a figure for the frequency.
        """
        point = self._calibration_at(frequency)
        if point is not None and point.resistance is not None and point.inductance is not None:
            return point.resistance, point.inductance
        if not data.MINIMUM_FREQUENCY <= frequency <= data.MAXIMUM_STATED_FREQUENCY:
            raise MeasurementError(
                self._name,
                text(
                    "no accuracy is stated at {frequency:g} Hz, only from {lowest:g} Hz to {highest:g} Hz",
                    frequency=frequency,
                    lowest=data.MINIMUM_FREQUENCY,
                    highest=data.MAXIMUM_STATED_FREQUENCY,
                ),
                remedy=text("Stay within, or enter a calibration point"),
            )
        setting = (frequency, level or self._level, aperture or self._aperture)
        stated = self._stated_accuracy(resistance, inductance, setting)
        if point is None:
            return stated
        return point.resistance or stated[0], point.inductance or stated[1]

    def make_safe(self) -> None:
        """Do nothing: a test signal of 10 mA is harmless."""

    def _is_al(self) -> bool:
        return self._identity.model.upper().startswith("E4980AL")

    def _model_frequency(self) -> float:
        if not self._is_al():
            return data.E4980A_MAXIMUM_FREQUENCY
        # The model field may carry the option itself, else *OPT? lists it.
        message = f"{self._identity.model},{self._session.query('*OPT?')}"
        result = [limit for option, limit in data.E4980AL_MAXIMUM_FREQUENCY.items() if option in message]
        return max(result, default=min(data.E4980AL_MAXIMUM_FREQUENCY.values()))

    def _check_status(self, status: int, inductance: float, resistance: float) -> None:
        if status in (NO_DATA, OVERLOAD) or is_overrange(inductance) or is_overrange(resistance):
            what = STATUS_TEXT.get(status, text("no value (9.9E37)"))
            raise OverloadError(
                self._name, what, command="FETC?", remedy=text("Check the leads at the motor's terminals")
            )
        if status != GOOD:
            what = STATUS_TEXT.get(status, text("unknown status {status}", status=status))
            raise MeasurementError(self._name, what, command="FETC?", remedy=text("Lower the level"))

    def _calibration_at(self, frequency: float) -> ImpedanceCalibration | None:
        for point in self._options.calibration:
            if math.isclose(point.frequency, frequency, rel_tol=CALIBRATION_WINDOW):
                return point
        return None

    def _stated_accuracy(
        self, resistance: float, inductance: float, setting: tuple[float, float, Aperture]
    ) -> tuple[Accuracy, Accuracy]:
        frequency = setting[0]
        reactance = 2 * math.pi * frequency * abs(inductance)
        impedance = math.hypot(resistance, reactance)
        if impedance == 0:
            offset = data.short_offset(0.0, *setting) * self._options.temperature_factor
            return (
                Accuracy(offset=offset, source=data.SOURCE),
                Accuracy(offset=offset / (2 * math.pi * frequency), source=data.SOURCE),
            )
        proportional = data.basic_accuracy(*setting) * self._options.temperature_factor
        fixed = data.short_offset(impedance, *setting) / impedance + data.open_offset(*setting) * impedance
        fixed *= self._options.temperature_factor
        # Written as |Z| over R and over X, which is √(1 + Q²) and √(1 + D²), and holds for R = 0 or L = 0 too.
        r_size = impedance if reactance > 0.1 * abs(resistance) else abs(resistance)
        x_size = impedance if abs(resistance) > 0.1 * reactance else reactance
        return (
            _split(proportional, fixed, abs(resistance), r_size),
            _split(proportional, fixed, abs(inductance), x_size / (2 * math.pi * frequency)),
        )


def _split(proportional: float, fixed: float, value: float, size: float) -> Accuracy:
    """Return relative errors of `size` as an accuracy of `value`: gain where the error grows with the value."""
    if value == 0:
        return Accuracy(offset=(proportional + fixed) * size, source=data.SOURCE)
    return Accuracy(gain=proportional * size / value, offset=fixed * size, source=data.SOURCE)


def _with_resolution(accuracy: Accuracy, value: float) -> Accuracy:
    if value == 0 or accuracy.resolution:
        return accuracy
    digit = 10.0 ** (math.floor(math.log10(abs(value))) - REPLY_DIGITS)
    return Accuracy(accuracy.gain, accuracy.offset, digit, accuracy.noise, accuracy.source)
