"""The places that instruments take on a bench."""

from enum import Enum


class Role(Enum):
    """The place an instrument takes on the bench, as the station file writes it."""

    SUPPLY = "supply"
    LCR_METER = "lcr_meter"
    OSCILLOSCOPE = "oscilloscope"
    DYNAMOMETER = "dynamometer"
    TACHOMETER = "tachometer"
    INVERTER = "inverter"
    VOLTMETER = "voltmeter"
    DRIVE = "drive"
    SWITCH_MATRIX = "switch_matrix"
    ROTOR_ACTUATOR = "rotor_actuator"
    INSULATION_TESTER = "insulation_tester"
