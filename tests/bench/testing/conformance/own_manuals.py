"""What the manuals of our instruments state, or what is assumed where they do not, written without looking at the drivers."""

import math
from collections.abc import Mapping

from bench.testing.conformance.manual import Manual, Model, NotYet, ProtectionTrip, Reply, StatedLimits
from drivers.bases.oscilloscope_data import Probe
from drivers.interfaces import (
    Accuracy,
    Aperture,
    ChannelSettings,
    CommunicationError,
    Identity,
    IdentityError,
    MeasurementError,
    OutputMode,
    OverloadError,
    ProbeKind,
    ReportedError,
    SetpointError,
)
from drivers.keysight.options import ImpedanceCalibration
from tests.bench.testing.conformance.own_cia402_manuals import INVERTER, ROTOR, SIX_STEP
from tests.bench.testing.conformance.own_delta_scales import PUSHED, SCALES
from tests.bench.testing.conformance.own_moteus_manual import MOTEUS

_RPM = 2.0 * math.pi / 60.0
_VOLTS, _AMPERES = Accuracy(gain=3e-4, offset=2e-3), Accuracy(gain=5e-4, offset=10e-3)
_ENTER = "typical of its class; enter the transducer's calibration"
_TORQUE = Accuracy(offset=5e-3, resolution=1e-4, source=f"0.1 % of full scale, {_ENTER}")
_SPEED = Accuracy(offset=0.01 * _RPM, resolution=0.01 * _RPM, source=f"one digit, {_ENTER}")
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
_E36300 = Manual(
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
_SCPI_SUPPLY = Manual(
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
#: Ae of the data sheet with Kt = 2, worked out by hand: Ab, Zs and Yo by aperture, level and frequency.
_LCR = {
    (1.0, 1e-3, 1000.0, 1.0, Aperture.MEDIUM): ((3.18113257e-3, 1.680029303e-3), (5.06292972e-4, 2.67384968e-7)),
    (1.7, 2e-3, 120.0, 0.5, Aperture.LONG): ((6.68362978e-4, 4.197697380e-3), (7.53477341e-4, 5.56736906e-6)),
    (20.0, 1e-3, 100.0, 1.0, Aperture.SHORT): ((3e-3, 1.4562548990e-2), (9.55400781e-2, 2.318845114e-5)),
    (0.5, 5e-3, 5000.0, 0.3, Aperture.MEDIUM): ((1.570804284e-1, 2.0448748527e-3), (5e-4, 6.509005841e-8)),
    (0.0, 0.0, 100.0, 1.0, Aperture.MEDIUM): ((0.0, 1.6649110641e-3), (0.0, 2.6497882565e-6)),
    (0.0, 1e-3, 1000.0, 1.0, Aperture.MEDIUM): ((0.0, 4.821621233e-3), (5e-4, 2.67384853e-7)),
    (1.0, 0.0, 1000.0, 1.0, Aperture.MEDIUM): ((5e-4, 8.000007239e-4), (0.0, 2.0690154124e-7)),
}
_STATED = {
    point: tuple(Accuracy(gain=2.0 * gain, offset=2.0 * offset) for gain, offset in stated)
    for point, stated in _LCR.items()
}
_AT_1_KHZ = (1.0, 1e-3, 1000.0, 1.0, Aperture.MEDIUM)
#: Six digits are shown.
_DIGITS = {"inductance_accuracy.resolution": 1e-9, "resistance_accuracy.resolution": 1e-5, "frequency": 1000.0}
_E4980A = Manual(
    identity=Identity("Keysight Technologies", "E4980AL", "MY54101234", "B.07.03"),
    accuracies_at={
        **_STATED,
        (1.0, 1e-3, 1000.0): _STATED[_AT_1_KHZ],
        (1.0, 1e-3, 19.9): MeasurementError,
        (1.0, 1e-3, 100.1e3): MeasurementError,
    },
    models=(
        Model({r"\*IDN\?": b"Agilent Technologies,E4980A,MY1,A.02.10"}, states={"maximum_frequency": 2e6}),
        Model({r"\*OPT\?": b"032"}, states={"maximum_frequency": 300e3}),
        Model({r"\*OPT\?": b"001,052"}, states={"maximum_frequency": 500e3}),
        Model({r"\*OPT\?": b"102"}, states={"maximum_frequency": 1e6}),
        Model({r"\*OPT\?": b"0"}, states={"maximum_frequency": 300e3}),
        Model(options={"maximum_frequency": 1e4}, states={"maximum_frequency": 1e4, "source_impedance": 100.0}),
        Model({r"\*IDN\?": b"Agilent Technologies,4284A,MY1,1"}, error=IdentityError),
    ),
    limits=(
        StatedLimits("configure", "frequency", 20.0, 1e6),
        StatedLimits("configure", "level", 5e-3, 2.0, {"frequency": 1000.0}),
    ),
    replies=(
        Reply(r"FETC", b"+9.90000E+37,+9.90000E+37,-1", OverloadError),
        Reply(r"FETC", b"+1.00000E-03,+1.00000E+00,-1", OverloadError),
        Reply(r"FETC", b"+1.00000E-03,+1.00000E+00,+1", OverloadError),
        Reply(r"FETC", b"+1.00000E-03,+9.90000E+37,+0", OverloadError),
        Reply(r"FETC", b"+1.00000E-03,+1.00000E+00,+3", MeasurementError),
        Reply(r"FETC", b"+1.00000E-03,+1.00000E+00,+4", MeasurementError),
        Reply(r"FETC", b"+1.00000E-03,-2.00000E+00,+0", reads={"inductance": 1e-3, "resistance": -2.0}, call="measure"),
        Reply(r"FETC", b"+0.00000E+00,+0.00000E+00,+0", reads={"inductance": 0.0, "resistance": 0.0}, call="measure"),
        Reply(r"FETC", b"+1.23450E-04,+2.00000E+00,+0", reads=_DIGITS, call="measure"),
        Reply(r"FETC", b"+1.00000E-03,+1.00000E+00,+0,+1", reads={"inductance": 1e-3}, call="measure"),
        *(
            Reply(r"FETC", b"+1.00000E-03,+1.00000E+00" + more, CommunicationError, call="measure")
            for more in (b"", b",+0,+1,+0", b",+0,+1,+0,+0", b",+0,+1,+0,+0,+0")
        ),
        Reply(r"CORR:SHOR:STAT\?", b"0", ReportedError),
    ),
)
_POINT = Accuracy(gain=1e-3, source="calibration")
#: A calibration holds a thousandth about its frequency, of what it states; beyond the data sheet's too.
E4980A_CALIBRATED = tuple(
    {
        "calibration": (ImpedanceCalibration(at, *points),),
        "manual": Manual(accuracies_at={(*_AT_1_KHZ[:2], frequency, *_AT_1_KHZ[3:]): stated}),
    }
    for at, frequency, points, stated in (
        (1000.9, 1000.0, (_POINT, _POINT), (_POINT, _POINT)),
        (999.1, 1000.0, (_POINT, None), (_POINT, _STATED[_AT_1_KHZ][1])),
        (1000.0, 1000.0, (None, _POINT), (_STATED[_AT_1_KHZ][0], _POINT)),
        (1001.2, 1000.0, (_POINT, _POINT), _STATED[_AT_1_KHZ]),
        (1.5e6, 1.5e6, (_POINT, _POINT), (_POINT, _POINT)),
    )
)
_34461A = Manual(
    local="^SYST:LOC$",
    identity=Identity("Keysight Technologies", "34461A", "MY57201234", "A.03.00-02.40-03.00-00.52-04-02"),
    accuracies_at={
        (0.05,): Accuracy(gain=5e-5, offset=3.5e-6, resolution=1e-7),
        (-0.5,): Accuracy(gain=4e-5, offset=7e-6, resolution=1e-6),
        (5.0,): Accuracy(gain=3.5e-5, offset=5e-5, resolution=1e-5),
        (50.0,): Accuracy(gain=4.5e-5, offset=6e-4, resolution=1e-4),
    },
    limits=(
        StatedLimits("configure", "full_scale", 0.0, 1000.0),
        StatedLimits("configure", "power_line_cycles", 10.0, 100.0, {"full_scale": 1.0}),
    ),
    replies=(
        Reply(r"READ\?", b"+9.90000000E+37", OverloadError),
        Reply(r"READ\?", b"-9.90000000E+37", OverloadError),
        Reply(r"READ\?", b"-1.25000000E+00", reads={"value": -1.25}),
    ),
)
_PREAMBLE = "+1,+0,+{},+1,{},-1.25E-02,{},{},+0.0E+00,+32768"


def _preamble(points: int = 500, x: str = "+5.0E-05", reference: str = "+0", y: str = "+5.0E-04") -> bytes:
    return _PREAMBLE.format(points, x, reference, y).encode()


_INFINIIVISION = Manual(
    identity=Identity("KEYSIGHT TECHNOLOGIES", "DSO-X 3024T", "MY60101234", "07.40.2021031200"),
    # 2 % of full scale; 0.1 division of 1 A, 2 mV at ten amperes a volt, 1 % of the offset of 1 A.
    # The gain is of full scale, so it hangs on the trace: the driver's own tests hold it.
    limits=(
        StatedLimits("configure_acquisition", "record_time", 20e-9, 500.0, {"points": 1}),
        StatedLimits("configure_acquisition", "points", 1, 2_000_000, {"record_time": 1.0}),
        # 2.5 GSa/s; 1 mV to 5 V a division, by a probe of ten to one.
        StatedLimits("configure_acquisition", "points", 1, 2500, {"record_time": 1e-6}, beyond=1),
        StatedLimits("configure_channel", "settings", 0.08, 400.0, {"channel": 1}, beyond=1e-3, of=ChannelSettings),
        StatedLimits("configure_channel", "settings", -400.0, 400.0, {"channel": 2}, of=lambda offset: ChannelSettings(10.0, offset)),
        StatedLimits("configure_acquisition", "pre_trigger", 0.0, 1.0, {"record_time": 1.0, "points": 1000}),
    ),
    models=(
        *(Model(options={"probes": {1: Probe(ProbeKind.VOLTAGE, attenuation)}}) for attenuation in (1e-3, 1e4)),
        *(
            Model(options={"probes": {1: Probe(ProbeKind.VOLTAGE, attenuation)}}, error=SetpointError, says="attenuation")
            for attenuation in (0.99e-3, 1.01e4)
        ),
        Model(
            options={"probes": {1: Probe(ProbeKind.VOLTAGE, 50.0, maximum_voltage=700.0), 2: Probe(ProbeKind.CURRENT, 10.0)}},
            states={
                ("attenuation", 1): 50.0, ("attenuation", 2): 10.0, ("attenuation", 3): None, ("maximum_voltage", 1): 700.0,
                ("maximum_voltage", 2): None, ("channels", ProbeKind.VOLTAGE): (1,), ("channels", ProbeKind.CURRENT): (2,),
            },
        ),
        *(
            Model({r"\*IDN\?": f"Agilent Technologies,{model},MY1,1".encode()}, error=error)
            for model, error in (("MSO-X 3014A", ()), ("DSO-X 4034A", ()), ("DSO-X 2012A", IdentityError))
        ),
    ),
    replies=(
        # The least that is offered for 400: 1, 2 and 5 times a power of ten.
        Reply(r":WAV:POIN 500$", b"", None),
        Reply(r"WAV:PRE\?", _preamble(300), MeasurementError, beside={r"WAV:DATA": b"#800000600" + 600 * b"\x80"}),
        *(
            Reply(
                r"WAV:PRE\?", _preamble(500), reads={"1.clipped": clipped, "1.resolution": 0.128, "1.unit": "V"},
                beside={r"WAV:DATA": b"#800001000" + 499 * b"\0\x80" + code.to_bytes(2, "little")},
            )
            for code, clipped in ((0x01FF, True), (0x0200, False), (0xFF00, True), (0xFEFF, False))
        ),
        *(
            Reply(r"WAV:PRE\?", data, CommunicationError)
            for data in (
                _preamble(0), _preamble(2000), _preamble(x="+0.0E+00"), _preamble(x="-5.0E-05"), _preamble(y="+0.0E+00"),
                _preamble(y="-5.0E-04"), _preamble(y="+9.9E+37"), _preamble().replace(b"+1,", b"+0,", 1),
            )
        ),
        Reply(r"CHAN1:RANG\?", b"+9.9E+37", CommunicationError),
        Reply(r"MEAS:VPP", b"+9.9E+37", MeasurementError),
        Reply(r"MEAS:VPP", b"+6.0E+01", OverloadError),
        Reply(r"MEAS:VPP", b"+1.4E+01", reads={"value": 7.0}),
        Reply(r"MEAS:FREQ", b"+9.9E+37", MeasurementError),
    ),
    not_yet=(
        NotYet(r"OPER:COND", b"+8", 1.0, call="initiate"),
        NotYet(r"OPER:COND", b"+8", 2.0, call="fetch"),
    ),
)  # fmt: skip
_LUTRON = Manual(
    identity=Identity("Lutron", "DT-2236"),
    # A frame a second, a little late at most; 9600 baud, and two periods are waited for it.
    takes={"measure_speed": (1.01, 1.03)},
    port={"baudrate": 9600, "bytesize": 8, "parity": "N", "stopbits": 1, "timeout": 2.0},
    accuracies={
        "speed reading": Accuracy(offset=_RPM, resolution=0.1 * _RPM),
        "speed reading below 1000 rpm": Accuracy(offset=_RPM, resolution=0.1 * _RPM),
        "speed reading above 1000 rpm": Accuracy(offset=_RPM, resolution=_RPM),
    },
    replies=(
        Reply("frame", b"\x0241220100001234\r", reads={"value": 123.4 * _RPM, "accuracy.resolution": 0.1 * _RPM}),
        Reply("frame", b"\x0241221100001234\r", reads={"value": 123.4 * _RPM}),
        Reply("frame", b"\x0241220300001234\r", reads={"value": 1.234 * _RPM}),
        Reply("frame", b"", CommunicationError, says="sends nothing"),
        # Four frames' length without an end is none.
        Reply("frame", 80 * b"0", CommunicationError, within=0.1),
        Reply("frame", b"\x0241210100001234\r", MeasurementError, says="21"),
        Reply("frame", b"\x0241220000099999\r", reads={"value": 99_999 * _RPM}),
        Reply("frame", b"\x0241220000100001\r", MeasurementError),
        Reply("frame", b"\x02412201 0001234\r", CommunicationError),
        Reply("frame", b"\x0241222100001234\r", CommunicationError),
        Reply("frame", b"\x0241220400001234\r", CommunicationError),
        Reply("frame", b"\x0242220100001234\r", CommunicationError),
        Reply("frame", b"\x0241??0100001234\r", CommunicationError),
        Reply("frame", b"?41220100001234\r", CommunicationError, says="no frame between"),
        Reply("frame", b"\x024122010000123\r", CommunicationError),
        Reply("frame", b"\x02412201000012345\r", CommunicationError),
    ),
)
_DELTA = Manual(
    identity=Identity("Delta Electronics", "C2000 with DYN-200"),
    # A transducer has six decimals at the most, a double word each, and turns one way or the other; a drive has a code of one byte.
    others=(
        {8: (0, 7), 18: (0, 0)},
        {8: (1, 2), 18: (0, 0)},
        {8: (0, 2), 18: (0, 2)},
        {0: (256,), 0x2100: (0, 0)},
        {0: (0,), 0x2100: (0, 0)},
    ),
    accuracies={
        f"{when}: {what} reading": stated
        for when in ("at rest", "at a torque", "at speed", "forwards", "backwards")
        for what, stated in (("torque", _TORQUE), ("speed", _SPEED))
    },
    replies=(
        *(
            Reply(f"read 2 {register} 2", bytes.fromhex(value), CommunicationError)
            for register in ("0008H", "0020H")
            for value in ("00000007", "ffffffff")
        ),
        Reply("read 2 0012H 2", bytes.fromhex("00000001"), ReportedError, call="open", says="12H"),
        Reply("read 1 2100H 1", bytes.fromhex("0031"), ReportedError, call="open", says="49"),
        Reply("read 1 2100H 1", bytes.fromhex("0001"), ReportedError, call="driving_speed begins"),
        Reply("read 2 0000H 6", bytes.fromhex("000000000000002800000000"), None, call="zero_torque"),
        *(
            Reply(
                "read 2 0000H 6",
                bytes.fromhex(shown),
                reads={"torque": torque, "speed": rpm * _RPM, "power": torque * rpm * _RPM},
                call="measure",
                times=2,
            )
            # The sensor tells no direction, and two readings do not settle the scale of its power.
            for shown, torque, rpm in (
                ("00003039 00001770 0000004e", 1.2345, 60.0),
                ("ffffcfc7 00001770 0000004e", -1.2345, 60.0),
                ("ffffcfc7 00001770 ffffffb2", -1.2345, 60.0),
                ("00003039 00000000 00000000", 1.2345, 0.0),
            )
        ),
        # Whatever turns it before anything was commanded, the reading says that its direction is not known.
        Reply(
            "read 2 0000H 6",
            bytes.fromhex("00003039 00001770 0000004e"),
            reads={"speed_accuracy.source": f"{_SPEED.source}; direction not known"},
            call="measure",
            times=1,
        ),
        # 0.75 rpm: a shaft stands below half a one.
        Reply("read 2 0000H 6", bytes.fromhex("000000000000004b00000000"), MeasurementError, call="zero_torque"),
        Reply("read 1 2100H 1", bytes.fromhex("0500"), None),
        # 0.1 A is what a sensor shows without a current.
        Reply("read 1 2103H 2", bytes.fromhex("0000000a"), None),
        Reply("read 1 2103H 2", bytes.fromhex("0000000b"), ReportedError, says="0.11 A"),
        Reply("read 1 2103H 2", bytes.fromhex("00640000"), ReportedError, says="1 Hz"),
        *SCALES,
    ),
    # 599 Hz at the most; the rated torque unless the station lowers it.
    models=(
        Model(options={"maximum_speed": 1e4}, states={"maximum_speed": math.pi * 599.0, "maximum_torque": 5.0}),
        Model(options={"maximum_speed": 1e4, "pole_pairs": 4}, states={"maximum_speed": math.pi * 299.5}),
        Model(options={"rated_torque": 3.0}, states={"maximum_torque": 3.0, "maximum_speed": 500.0}),
        Model(options={"maximum_torque": 2.0}, states={"maximum_torque": 2.0}),
    ),
    # An external fault, which stays until a person resets it.
    trip=ProtectionTrip(lambda simulated: simulated.units[1].write(0x2002, [1]), says="49", resets=False),
    not_yet=(NotYet("read 1 2103H 2", bytes.fromhex("00640000"), 1.0), *PUSHED),
)


#: Power against torque is backwards; power with torque, both ways of it, is forwards.
DELTA_BY_POWER = {
    "direction_from": "power",
    "manual": Manual(
        replies=tuple(
            Reply("read 2 0000H 6", bytes.fromhex(shown), reads={"speed": rpm * _RPM}, call="measure")
            for shown, rpm in (
                ("00003039 00001770 0000004e", 60.0),
                ("00003039 00001770 ffffffb2", -60.0),
                ("ffffcfc7 00001770 0000004e", -60.0),
                ("ffffcfc7 00001770 ffffffb2", 60.0),
            )
        )
    ),
}
#: Forwards, before anything was commanded.
DELTA_BY_COMMAND = {
    "direction_from": "command",
    "manual": Manual(
        replies=(
            Reply(
                "read 2 0000H 6",
                bytes.fromhex("000030390000177000000308"),
                reads={"speed": 60.0 * _RPM},
                call="measure",
            ),
        )
    ),
}


def _shown(status: str, kilovolts: str, resistance: str, time: str) -> bytes:
    return f"IR ,{status} ,{kilovolts}kV,{resistance} ohm,{time}S".encode()


_GPT9800 = Manual(
    local=r"^\*RMTOFF$",
    identity=Identity("GW Instek", "GPT-9803", "EM110867", "v2.08"),
    limits=(
        StatedLimits("measure", "voltage", 50.0, 1000.0, {"duration": 1.0}, step=50.0),
        StatedLimits("measure", "duration", 1.0, 999.9, {"voltage": 500.0}),
    ),
    replies=(
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "T=000.4"), MeasurementError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.400", "0370M", "T=001.0"), MeasurementError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "R=001.0"), MeasurementError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "---.-"), MeasurementError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.500", "0370k", "T=001.0"), CommunicationError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "T=001.0"), reads={"resistance.value": 370e6, "voltage": 500.0}),
        Reply(
            "MEAS", _shown("PASS", "0.500", "2.500G", "T=001.0"), reads={"resistance.value": 2.5e9, "beyond_range": 0}
        ),
        Reply("MEAS", _shown("PASS", "0.500", ">9.999G", "T=001.0"), reads={"beyond_range": 1}),
        Reply("MEAS", _shown("PASS", "0.500", "9999M", "T=001.0"), reads={"beyond_range": 1}),
        Reply("MEAS", _shown("FAIL", "0.500", "0001M", "T=000.1"), reads={"resistance.value": 1e6, "beyond_range": 0}),
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "T=000.9"), reads={"resistance.value": 370e6}),
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "T=000.8"), MeasurementError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.491", "0370M", "T=001.0"), reads={"voltage": 491.0}),
        Reply(
            "MEAS", _shown("PASS", "0.489", "0370M", "T=001.0"), MeasurementError, call="measure", says="489 V of 500 V"
        ),
        Reply("MEAS", _shown("FAIL", "0.500", "0001M", "R=000.1"), reads={"resistance.value": 1e6}),
        Reply("MEAS", _shown("FAIL", "0.500", "0002M", "T=000.1"), MeasurementError, call="measure"),
        Reply(
            "MEAS", _shown("PASS", "0.500", "9998M", "T=001.0"), reads={"resistance.value": 9.998e9, "beyond_range": 0}
        ),
        Reply("MEAS", b"nothing", CommunicationError, call="make_safe"),
        Reply("MEAS", b"GB ,VIEW ,00.00A ,000.0mohm,T=000.0S", None, call="make_safe", within=0.05),
        Reply("MEAS", _shown("VIEW", "0.029", "0370M", "---.-"), None, call="make_safe", within=0.05),
        Reply("MEAS", _shown("VIEW", "0.031", "0370M", "---.-"), ReportedError, call="make_safe", says="31 V"),
        Reply("MEAS", _shown("TEST", "0.500", "0370M", "T=000.5"), MeasurementError, call="measure", says="3 s"),
        Reply(r"FUNC:TEST\?", b"OFF", None),
        Reply(r"MANU:IR:VOLT\?", b"0.450kV", ReportedError),
    ),
    not_yet=(
        NotYet(r"FUNC:TEST\?", b"TEST ON", 5.0),
        # A judged test may go on showing its voltage.
        NotYet("MEAS", _shown("PASS", "0.500", "0370M", "T=001.0"), 1.0, call="make_safe", told=False),
        NotYet("MEAS", _shown("TEST", "0.499", "0369M", "T=000.9"), 5.0),
    ),
)
#: The test has three seconds more than its ramp and its time, whatever they are.
GPT9800_SLOW = {
    "ramp_time": 5.0,
    "manual": Manual(not_yet=(NotYet("MEAS", _shown("TEST", "0.000", "0369M", "T=000.9"), 3.0, call="measure"),)),
}
_34970A = Manual(
    identity=Identity("HEWLETT-PACKARD", "34970A", "0", "13-2-2"),
    models=(
        *(
            Model(
                {r"\*IDN\?": f"{unit},MY1,1".encode(), r"SYST:CTYP\?": b"Agilent Technologies,34903A,0,1"}
                # The simulated unit's module has not all channels that a unit may have.
                | ({r"ROUT:CLOS\?": b"0"} if options else {}),
                options,
                error=error,
            )
            for unit, options, error in (
                ("Agilent Technologies,34972A", {}, ()),
                ("Agilent Technologies,34972A", {"crosspoints": {"A:supply+": 100}}, ()),
                ("Agilent Technologies,34972A", {"crosspoints": {"A:supply+": 399}}, ()),
                ("Agilent Technologies,34980A", {"crosspoints": {"A:supply+": 1000}}, ()),
                ("Agilent Technologies,34980A", {"crosspoints": {"A:supply+": 9999}}, ()),
                ("Agilent Technologies,34980A", {}, IdentityError),
                ("Agilent Technologies,34921A", {}, IdentityError),
            )
        ),
        *(
            Model(
                {r"\*IDN\?": b"Agilent Technologies,34980A,MY1,1", r"SYST:CTYP\? 2$": b"Agilent Technologies,0,0,0"},
                {"crosspoints": {"A:supply+": channel}},
                error=error,
            )
            for channel, error in ((1101, ReportedError), (2101, IdentityError))
        ),
    ),
    replies=(
        Reply(r"SYST:CTYP\? 200", b"HEWLETT-PACKARD,0,0,0", IdentityError),
        Reply(r"SYST:CTYP\? 200", b"HEWLETT-PACKARD", IdentityError),
    ),
)
MANUALS: Mapping[str, Manual] = {
    "keysight-e36300": _E36300,
    "keysight-e4980a": _E4980A,
    "keysight-34461a": _34461A,
    "keysight-infiniivision": _INFINIIVISION,
    "lutron-tachometer": _LUTRON,
    "delta-dyn200": _DELTA,
    "cia402-inverter": INVERTER,
    "cia402-six-step": SIX_STEP,
    "cia402-rotor-actuator": ROTOR,
    "gwinstek-gpt9800": _GPT9800,
    "keysight-34970a": _34970A,
    "scpi-supply": _SCPI_SUPPLY,
    "mjbots-moteus": MOTEUS,
}
