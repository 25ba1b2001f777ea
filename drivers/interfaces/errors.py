"""Errors of instruments; every message names the instrument and the command."""

import math
from collections.abc import Sequence

from drivers.interfaces.text import Text, text, word


class InstrumentError(Exception):
    """An instrument could not do what was asked.

    `instrument` is its role or model, `command` what was sent (may be empty), `what` the plain finding,
    `remedy` what a person should do. As a string it is English; `text` says it in another language.
    """

    def __init__(self, instrument: str, what: Text | str, *, command: str = "", remedy: Text | str = "") -> None:
        self.instrument = instrument
        self.what = word(what)
        self.command = command
        self.remedy = remedy
        values = {"instrument": word(instrument), "command": command, "what": self.what}
        self.text = text("{instrument} after '{command}': {what}" if command else "{instrument}: {what}", **values)
        # What was wrapped may say it already.
        if remedy and str(word(remedy)) not in str(self.text):
            self.text = text("{finding}. {remedy}", finding=self.text, remedy=remedy)
        super().__init__(self.text)


class CommunicationError(InstrumentError):
    """No reply, half a reply, or one that is not of the announced form."""


class IdentityError(InstrumentError):
    """Another instrument answers than the station file names."""


class ReportedError(InstrumentError):
    """The instrument reported an error of its own (SYST:ERR?, a Modbus exception, an SDO abort)."""


class MeasurementError(InstrumentError):
    """The instrument answered, but says that its reading is not valid."""


class BreakdownError(MeasurementError):
    """The insulation under test drew so much current that the test voltage was not reached."""


class OverloadError(MeasurementError):
    """The reading is beyond the instrument's range (9.9E37, clipped waveform)."""


class SetpointError(InstrumentError):
    """A set point outside the allowed range; nothing was sent."""

    def __init__(
        self,
        instrument: str,
        parameter: Text | str,
        value: float,
        unit: str,
        low: float,
        high: float,
        whose: Text | str,
    ) -> None:
        self.parameter = parameter
        self.value = value
        self.low = low
        self.high = high
        self.whose = whose
        super().__init__(
            instrument,
            text(
                "{parameter} = {value:g} {unit} is outside {low:g} … {high:g} {unit}, the limit of {whose}; nothing was sent",
                parameter=word(parameter),
                value=value,
                unit=unit,
                low=low,
                high=high,
                whose=word(whose),
            ),
        )


class NotOfferedError(SetpointError):
    """A set point that is not among the values that the instrument offers; nothing was sent."""

    def __init__(
        self, instrument: str, parameter: Text | str, value: float, unit: str, offered: Sequence[float]
    ) -> None:
        self.parameter, self.value = parameter, value
        self.low, self.high, self.whose = min(offered), max(offered), "the instrument"
        nearest = min(offered, key=lambda one: abs(one - value))
        InstrumentError.__init__(
            self,
            instrument,
            text(
                "{parameter} = {value:g} {unit} is not one of the values that it offers, {offered} {unit}; "
                "nothing was sent",
                parameter=word(parameter),
                value=value,
                unit=unit,
                offered=[f"{one:g}" for one in offered],
            ),
            remedy=text(
                "Choose one of them with --set {parameter}={nearest:g}, at the panel under Settings, or take an instrument that offers it",
                parameter=parameter,
                nearest=nearest,
            ),
        )


class CrosspointError(SetpointError):
    """Crosspoints that do not exist, or that may not be closed together; nothing was switched."""

    def __init__(self, instrument: str, what: Text, *, remedy: Text | str = "") -> None:
        self.parameter: Text | str = "crosspoints"
        self.value = self.low = self.high = math.nan
        self.whose: Text | str = "the interlocking"
        InstrumentError.__init__(self, instrument, text("{what}; nothing was switched", what=what), remedy=remedy)


class LimitError(InstrumentError):
    """A reading beyond a limit: everything energised must be switched off."""

    def __init__(
        self, instrument: str, parameter: Text | str, value: float, unit: str, limit: float, whose: Text | str
    ) -> None:
        self.parameter = parameter
        self.value = value
        self.limit = limit
        self.whose = whose
        super().__init__(
            instrument,
            text(
                "{parameter} = {value:g} {unit} is beyond {limit:g} {unit}, the limit of {whose}",
                parameter=word(parameter),
                value=value,
                unit=unit,
                limit=limit,
                whose=word(whose),
            ),
        )
