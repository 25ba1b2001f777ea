"""The roles' interfaces, one for each kind of instrument, in the terms of the IVI classes; procedures use nothing else of an
instrument.
"""

from drivers.interfaces.bldc_drive import BldcDrive
from drivers.interfaces.calls import UNWATCHED, Calls
from drivers.interfaces.clock import Clock, OwnRamp, polls
from drivers.interfaces.dynamometer import Dynamometer, DynamometerReading
from drivers.interfaces.errors import (
    BreakdownError,
    CommunicationError,
    CrosspointError,
    IdentityError,
    InstrumentError,
    LimitError,
    MeasurementError,
    NotOfferedError,
    OverloadError,
    ReportedError,
    SetpointError,
)
from drivers.interfaces.identity import Accuracy, Identity, Instrument, Reading, Traffic
from drivers.interfaces.insulation_tester import InsulationReading, InsulationTester
from drivers.interfaces.interlock import Interlock
from drivers.interfaces.inverter import AbilityError, DqReading, DqSample, Inverter, InverterAbility
from drivers.interfaces.lcr_meter import Aperture, ImpedanceReading, LcrMeter, Wanted
from drivers.interfaces.oscilloscope import (
    AcquisitionType,
    ChannelSettings,
    Oscilloscope,
    ProbeKind,
    Slope,
    Trigger,
    Waveform,
)
from drivers.interfaces.role import Role
from drivers.interfaces.rotor_actuator import RotorActuator
from drivers.interfaces.supply import OutputMode, Regulated, Supply
from drivers.interfaces.switch_matrix import SwitchMatrix
from drivers.interfaces.tachometer import Tachometer
from drivers.interfaces.voltmeter import Voltmeter
from drivers.interfaces.watchdog import Watchdog, Watching, WhenSilent
from drivers.interfaces.watchdog_relay import WatchdogRelay

__all__ = [
    "UNWATCHED",
    "AbilityError",
    "Accuracy",
    "AcquisitionType",
    "Aperture",
    "BldcDrive",
    "BreakdownError",
    "Calls",
    "ChannelSettings",
    "Clock",
    "CommunicationError",
    "CrosspointError",
    "DqReading",
    "DqSample",
    "Dynamometer",
    "DynamometerReading",
    "Identity",
    "IdentityError",
    "ImpedanceReading",
    "Instrument",
    "InstrumentError",
    "InsulationReading",
    "InsulationTester",
    "Interlock",
    "Inverter",
    "InverterAbility",
    "LcrMeter",
    "LimitError",
    "MeasurementError",
    "NotOfferedError",
    "Oscilloscope",
    "OutputMode",
    "OverloadError",
    "OwnRamp",
    "ProbeKind",
    "Reading",
    "Regulated",
    "ReportedError",
    "Role",
    "RotorActuator",
    "SetpointError",
    "Slope",
    "Supply",
    "SwitchMatrix",
    "Tachometer",
    "Traffic",
    "Trigger",
    "Voltmeter",
    "Wanted",
    "Watchdog",
    "WatchdogRelay",
    "Watching",
    "Waveform",
    "WhenSilent",
    "polls",
]
