"""What is stated of the E36300 series, and of a supply of data only, written without looking at the drivers."""

from bench.testing.conformance.manual import Manual, Model, Reply, StatedLimits
from drivers.interfaces import (
    Accuracy,
    CommunicationError,
    Identity,
    IdentityError,
    MeasurementError,
    OutputMode,
    ReportedError,
)

_VOLTS, _AMPERES = Accuracy(gain=3e-4, offset=2e-3), Accuracy(gain=5e-4, offset=10e-3)
#: A latch that holds is told before the output is switched on, and after it went off; and shown meanwhile.
_TRIPS = tuple(
    reply
    for which in ("VOLT", "CURR")
    for reply in (
        Reply(rf"^{which}:PROT:TRIP\?", b"1", ReportedError, call="energised begins", says="tripped earlier"),
        Reply(rf"^{which}:PROT:TRIP\?", b"1", ReportedError, call="energised ends", says="protection"),
        Reply(
            rf"^{which}:PROT:TRIP\?",
            b"1",
            reads={"": OutputMode.TRIPPED},
            call="output_mode",
            beside={"ISUM1:COND": b"+0", r"^OUTP\?": b"0"},
        ),
    )
)
_ON = {r"^OUTP\?": b"1"}
E36300 = Manual(
    local="^SYST:LOC$",
    identity=Identity("Keysight Technologies", "E36313A", "MY59001234", "2.1.0-1.0.4-1.12"),
    defaults={"over_voltage_margin": 0.1, "over_voltage_headroom": 0.5, "over_current_delay": 0.05},
    accuracies={
        f"{when}: {what} reading": stated
        for when in ("at voltage", "at current")
        for what, stated in (("voltage", _VOLTS), ("current", _AMPERES))
    },
    replies=(
        Reply(r"^MEAS:VOLT", b"+9.9E+37", MeasurementError),
        Reply(r"^OUTP\?", b"0", ReportedError, call="energised begins"),
        Reply(r"^VOLT\?", b"+3.0E+00", CommunicationError, call="energised"),
        Reply(r"^CURR:PROT:DEL:STAR\?", b"SCH", CommunicationError, call="energised"),
        Reply(r"^CURR:PROT:DEL:STAR\?", b"CCTRANS", None),
        Reply(r"^VOLT:SENS\?", None, CommunicationError, call="open", within=5.0),
        *_TRIPS,
        Reply(r"ISUM1:COND", b"+1", reads={"": OutputMode.CONSTANT_CURRENT}),
        Reply(r"ISUM1:COND", b"+10", reads={"": OutputMode.CONSTANT_VOLTAGE}),
        Reply(r"ISUM1:COND", b"+3", reads={"": OutputMode.UNREGULATED}, call="output_mode", beside=_ON),
    ),
    models=(
        Model(
            {r"\*IDN\?": b"KEYSIGHT TECHNOLOGIES,E36311A,MY1,1"},
            states={"maximum_voltage": 6.18, "maximum_current": 5.15},
        ),
        Model({r"\*IDN\?": b"Agilent Technologies,E36312A,MY1,1"}, {"channel": 3}, {"maximum_voltage": 25.75}),
        Model({r"\*IDN\?": b"Agilent Technologies,E36103A,MY1,1"}, error=IdentityError),
        Model(
            options={"maximum_voltage": 5.0, "maximum_current": 2.0},
            states={"maximum_voltage": 5.0, "maximum_current": 2.0},
        ),
        # A word in its long form is the same.
        Model({r"^(VOLT|CURR):MODE\?": b"FIXED"}),
        Model(options={"over_current_delay": 0.255}),
        Model(options={"over_current_delay": 0.0}),
    ),
    steps={r"^(VOLT|CURR)(:PROT)?\?": 4e-3},
)
SCPI_SUPPLY = Manual(
    steps={r"^(VOLT|CURR)": 4e-3},
    identity=Identity("motorbench", "generic supply", "0", "1"),
    defaults={"over_voltage_margin": 0.1, "over_voltage_headroom": 0.5, "trip_at_current_limit": False},
    limits=(
        StatedLimits("configure", "voltage", 0.0, 30.0, {"current_limit": 1.0}),
        StatedLimits("configure", "current_limit", 0.0, 5.0, {"voltage": 1.0}),
    ),
    accuracies={
        f"{when}: {what} reading": Accuracy(gain=5e-4, offset=offset)
        for when in ("at voltage", "at current")
        for what, offset in (("voltage", 1e-2), ("current", 5e-3))
    },
    replies=(
        Reply(r"^MEAS:VOLT", b"+9.9E+37", MeasurementError),
        Reply(r"^OUTP\?", b"0", ReportedError, call="energised begins"),
        Reply(r"^MEAS:(VOLT|CURR)", b"+1.0E-01", reads={"": OutputMode.UNREGULATED}, call="output_mode"),
        # Regulated is what is within a hundredth of the 6 A that it can have.
        *(
            Reply(r"^MEAS:CURR", b"+1.0E+00", reads={"": mode}, call="output_mode", beside={r"^CURR\?": level})
            for level, mode in (
                (b"+1.05E+00", OutputMode.CONSTANT_CURRENT),
                (b"+1.07E+00", OutputMode.CONSTANT_VOLTAGE),
            )
        ),
        Reply(r"^OUTP\?", b"0", reads={"": OutputMode.OFF}, call="output_mode"),
        *_TRIPS,
    ),
    models=(Model(options={"maximum_voltage": None, "maximum_current": None}, states={"maximum_voltage": 32.0}),),
)
