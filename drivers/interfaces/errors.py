"""What can go wrong with an instrument, always with the instrument and the command in the message."""

import math


class InstrumentError(Exception):
    """An instrument could not do what was asked.

    `instrument` is its role or model, `command` what was sent (may be empty), `what` the plain finding,
    `remedy` what a person should do.
    """

    def __init__(self, instrument: str, what: str, *, command: str = "", remedy: str = "") -> None:
        self.instrument = instrument
        self.what = what
        self.command = command
        self.remedy = remedy
        sent = f" after '{command}'" if command else ""
        advice = f". {remedy}" if remedy else ""
        super().__init__(f"{instrument}{sent}: {what}{advice}")


class CommunicationError(InstrumentError):
    """No reply, half a reply, or one that is not of the announced form."""


class IdentityError(InstrumentError):
    """Another instrument answers than the station file names."""


class ReportedError(InstrumentError):
    """The instrument reported an error of its own (SYST:ERR?, a Modbus exception, an SDO abort)."""


class MeasurementError(InstrumentError):
    """The instrument answered, but says that its reading is not valid."""


class OverloadError(MeasurementError):
    """The reading is beyond the instrument's range (9.9E37, clipped waveform)."""


class SetpointError(InstrumentError):
    """A set point outside the allowed range; nothing was sent."""

    def __init__(
        self, instrument: str, parameter: str, value: float, unit: str, low: float, high: float, whose: str
    ) -> None:
        self.parameter = parameter
        self.value = value
        self.low = low
        self.high = high
        self.whose = whose
        super().__init__(
            instrument,
            f"{parameter} = {value:g} {unit} is outside {low:g} … {high:g} {unit}, the limit of {whose}; nothing was sent",
        )


class CrosspointError(SetpointError):
    """Crosspoints that there are not, or that may not be closed together; nothing was switched."""

    def __init__(self, instrument: str, what: str, *, remedy: str = "") -> None:
        self.parameter = "crosspoints"
        self.value = self.low = self.high = math.nan
        self.whose = "the interlocking"
        InstrumentError.__init__(self, instrument, f"{what}; nothing was switched", remedy=remedy)


class LimitError(InstrumentError):
    """A reading beyond a limit: what is energised is to go off."""

    def __init__(self, instrument: str, parameter: str, value: float, unit: str, limit: float, whose: str) -> None:
        self.parameter = parameter
        self.value = value
        self.limit = limit
        self.whose = whose
        super().__init__(instrument, f"{parameter} = {value:g} {unit} is beyond {limit:g} {unit}, the limit of {whose}")
