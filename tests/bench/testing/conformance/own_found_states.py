"""What a last user may have left our instruments with, and what others of their families have not, as their manuals say."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from bench.testing.conformance.manual import Left
from drivers.bases.oscilloscope_data import Probe
from drivers.interfaces import ProbeKind, ReportedError

_PRESS = {"error": ReportedError, "says": "is set to"}


def _register(unit: int, address: int, value: int, *, words: int = 1) -> dict[str, Any]:
    """Return what leaves a register of a Modbus unit, or a double one, at a value, and reads it."""
    left = list(divmod(value, 1 << 16)) if words == 2 else [value]
    return {
        "leave": lambda simulated: simulated.units[unit].write(address, left),
        "now": lambda simulated: simulated.units[unit].read(address, words),
    }


def _polled(objects: str) -> Left:
    """Return that objects are measured by process data, where the station lets them be."""
    told = f"PDO: {objects}"
    return Left("0x1800", lambda _: None, told, now=lambda _: 0, options={"process_data": True})


def _object(index: int, value: int) -> dict[str, Any]:
    """Return what leaves an object of a drive at a value, and reads it."""
    return {
        "leave": lambda simulated: simulated.write(index, value),
        "now": lambda simulated: simulated.read(index),
    }


def _configured(item: str, value: float) -> dict[str, Any]:
    """Return what leaves an item of a moteus' configuration at a value, and reads it; NaN reads as a word, which equals itself."""
    return {
        "leave": lambda simulated: simulated.configuration.put(item, value),
        "now": lambda simulated: f"{simulated.configuration[item]:g}",
    }


def _moteus(item: str, value: float, found: str, wanted: str = "", **more: Any) -> Left:
    return Left(item, found=found, wanted=wanted, **_configured(item, value), **more)


_SCOPE = (
    *(
        Left(f":CHAN{n}:{what}?", f":CHAN{n}:{what} {value}", found, "0")
        for n in (1, 4)
        for what, value, found in (("INV", "ON", "1"), ("BWL", "ON", "1"), ("PROB:SKEW", "5E-8", "+5.00000000E-08"))
    ),
    Left(":CHAN1:IMP?", ":CHAN1:IMP FIFT", error=ReportedError, says="is set to FIFT"),
    # A current probe may want 50 Ω.
    Left(":CHAN4:IMP?", ":CHAN4:IMP FIFT", "FIFT"),
    Left(":CHAN3:DISP?", ":CHAN3:DISP ON", "1", "0"),
    Left(":CHAN1:DISP?", ":CHAN1:DISP ON", "1", "0", options={"probes": {3: Probe(ProbeKind.VOLTAGE, 10.0)}}),
    Left(":TRIG:EDGE:COUP?", ":TRIG:EDGE:COUP AC", "AC", "DC"),
    Left(":TRIG:HFR?", ":TRIG:HFR ON", "1", "0"),
    Left(":TRIG:NREJ?", ":TRIG:NREJ ON", "1", "0"),
)
LEFT: Mapping[str, Sequence[Left]] = {
    "keysight-e36300": (
        Left("OUTP:PAIR?", "OUTP:PAIR SER", **_PRESS),
        Left("OUTP:TRAC?", "OUTP:TRAC ON", **_PRESS),
        Left("VOLT:MODE? (@1)", "VOLT:MODE LIST,(@1)", "LIST", "FIX"),
        Left("CURR:MODE? (@1)", "CURR:MODE LIST,(@1)", "LIST", "FIX"),
        Left("VOLT:SENS? (@1)", "VOLT:SENS EXT,(@1)", "EXT", alters=True),
    ),
    "keysight-e4980a": (
        Left("DISP:PAGE?", "DISP:PAGE MSET", "MSET", "MEAS"),
        Left("DISP:PAGE?", "DISP:PAGE LIST", error=ReportedError, says="LIST"),
        Left("TRIG:SOUR?", "TRIG:SOUR HOLD", "HOLD", "BUS"),
        Left("INIT:CONT?", "INIT:CONT OFF", "0", "1"),
        Left("FUNC:DEV1:MODE?", "FUNC:DEV1:MODE PERC", "PERC", "OFF"),
        Left("FUNC:DEV2:MODE?", "FUNC:DEV2:MODE ABS", "ABS", "OFF"),
        Left("AMPL:ALC?", "AMPL:ALC ON", "1", "0"),
        Left("CORR:OPEN:STAT?", "CORR:OPEN:STAT ON", "1", "0"),
        Left("CORR:LOAD:STAT?", "CORR:LOAD:STAT ON", "1", "0"),
    ),
    "keysight-34461a": (
        Left("VOLT:DC:ZERO:AUTO?", "VOLT:DC:ZERO:AUTO OFF", "0", "1"),
        Left("VOLT:DC:NULL:STAT?", "VOLT:DC:NULL:VAL 0.01;STAT ON", "1", "0"),
        Left("CALC:SCAL:STAT?", "CALC:SCAL:GAIN 2;OFFS 0.5;STAT ON", "1", "0"),
    ),
    "keysight-infiniivision": _SCOPE,
    "gwinstek-gpt9800": (
        Left("MANU:EDIT:MODE?", "MANU:EDIT:MODE DCW", "DCW", "IR"),
        Left("MANU:IR:REF?", "MANU:EDIT:MODE IR;:MANU:IR:REF 100", "100", "0"),
        Left("TEST:RET?", "TEST:RET ON", "ON", "OFF"),
        Left("MAIN:FUNC?", "MAIN:FUNC AUTO", "AUTO", "MANU"),
    ),
    "delta-dyn200": (
        *(
            Left(query, found=f"{value}", wanted=wanted, **_register(1, address, value), watched=watched)
            for query, address, value, wanted, watched in (
                ("09-30", 0x091E, 1, "0", False),
                ("00-20", 0x0014, 0, "1", False),
                ("00-21", 0x0015, 0, "2", False),
                ("11-27", 0x0B1B, 50, "100", True),
                ("11-33", 0x0B21, 0, "1", True),
                ("11-36", 0x0B24, 0, "1", True),
                ("11-37", 0x0B25, 10, "100", True),
                ("11-38", 0x0B26, 10, "100", True),
            )
        ),
        Left("09-00", found="1", **_register(1, 0x0900, 1)),
        Left("09-01", found="192", **_register(1, 0x0901, 192)),
        Left("09-04", found="12", **_register(1, 0x0904, 12)),
        Left("00-00", lambda _: None, "6", now=lambda _: 0, options={"drive_code": None}),
        Left("00-00", lambda _: None, now=lambda _: 0, options={"drive_code": 5}, error=ReportedError, says="is set to 6"),
        Left("06H", found="50", wanted="1", **_register(2, 0x06, 50, words=2)),
        Left("1EH", found="50", wanted="1", **_register(2, 0x1E, 50, words=2)),
        Left("06H", found="50", **_register(2, 0x06, 50, words=2), options={"torque_filter": 0.2}, alters=True),
        Left("12H", **_register(2, 0x12, 1, words=2), error=ReportedError, says="is set to 1"),
        Left("12H", found="1", **_register(2, 0x12, 1, words=2), options={"torque_inverted": True}, alters=True),
        Left("12H", lambda _: None, now=lambda _: 0, options={"torque_inverted": True}, error=ReportedError, says="is set to 0"),
    ),
    "cia402-inverter": (
        Left("0x607E", found="64", wanted="0", **_object(0x607E, 0x40)),
        Left("0x6072", found="1500", **_object(0x6072, 1500)),
        Left("0x6073", found="1500", **_object(0x6073, 1500)),
        Left("0x607F", found="30000000", **_object(0x607F, 30_000_000)),
        # Its ramps cannot be changed.
        Left("0x6083", lambda _: None, "1200000", now=lambda simulated: simulated.read(0x6083)),
        Left("0x6084", lambda _: None, "1200000", now=lambda simulated: simulated.read(0x6084)),
        Left("0x6060", **_object(0x6060, 3), told=False),
        # Of what is measured together, what it lets be mapped.
        _polled("0x6041, 0x606C, 0x6077"),
    ),
    "cia402-six-step": (
        Left("0x605A", lambda _: None, "6", now=lambda _: 0),
        # The maker's mode has a negative number.
        Left("0x6060", **_object(0x6060, -1), told=False),
        _polled("0x6041, 0x606C, 0x6079"),
    ),
    "cia402-rotor-actuator": (Left("0x6060", **_object(0x6060, 3), told=False),),
    "mjbots-moteus": (
        _moteus("servo.fw.enable", True, "1", "0"),
        _moteus("servo.voltage_mode_control", True, "", error=ReportedError, says="conf set servo.voltage_mode_control 0"),
        _moteus("servo.fixed_voltage_mode", True, "", error=ReportedError, says="conf set servo.fixed_voltage_mode 0"),
        _moteus("servopos.position_min", -0.5, "-0.5", "nan"),
        _moteus("servopos.position_max", 0.5, "0.5", "nan"),
        _moteus("servo.max_current_A", 100.0, "100", "20.000000"),
        _moteus("servo.max_current_A", 15.0, "15"),
        _moteus("servo.max_voltage", 56.0, "56", "50.000000", options={"maximum_voltage": 50.0}),
        _moteus("servo.max_voltage", 55.0, "55", options={"maximum_voltage": 55.0}),
        _moteus("servo.max_power_W", 450.0, "450"),
        _moteus("servo.max_velocity", 300.0, "300"),
        _moteus("servo.pid_dq_hz", 200.0, "200"),
        _moteus("servo.enable_motor_temperature", True, "1"),
        _moteus("motor_position.rotor_to_output_ratio", 0.25, "0.25"),
        _moteus("motor_position.output.sign", -1, "-1"),
        _moteus("motor.poles", 2, "2", alters=True),
        _moteus("motor.poles", 0, "", error=ReportedError, says="motor.poles is 0"),
        _moteus("motor.poles", 9, "", error=ReportedError, says="motor.poles is 9"),
        _moteus("motor.poles", 8, "", error=ReportedError, says="pole_pairs = 5", options={"pole_pairs": 5}),
        _moteus("motor_position.output.sign", 0, "", error=ReportedError, says="Set it to 1 or -1"),
        _moteus("motor_position.rotor_to_output_ratio", 0.0, "", error=ReportedError, says="ratio is 0"),
        _moteus("motor_position.rotor_to_output_ratio", math.inf, "", error=ReportedError, says="ratio is inf"),
    ),
}  # fmt: skip
#: What others of a family refuse, by the manuals and programs that name them: of the moteus, older firmware.
LACKS: Mapping[str, Sequence[str]] = {
    "keysight-e36300": (r"OUTP:(PAIR|TRAC)\?", r"(VOLT|CURR):MODE\?", r"VOLT:SENS\?"),
    "keysight-e4980a": (),
    "keysight-34461a": (r"VOLT:DC:NULL:STAT\?", r"CALC:SCAL:STAT\?"),
    "keysight-infiniivision": (),
    "gwinstek-gpt9800": (r"MAIN:FUNC\?", r"TEST:RET\?"),
    "delta-dyn200": (r"read 1 090[014]H", r"read 1 0015H", r"read 2 00(06|1E|20)H"),
    # Gains and more are of some firmware only; whether there was telemetry to stop is no matter.
    "mjbots-moteus": (r"conf get servo\.(fw\.|pid_dq|enable_motor_temp)", "tel stop"),
}
