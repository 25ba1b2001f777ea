"""What Keysight states of its instruments other than supplies, written without looking at the drivers."""

from bench.testing.conformance.manual import Manual, Model, NotYet, Reply, StatedLimits
from drivers.bases.oscilloscope_data import Probe
from drivers.interfaces import (
    Accuracy,
    Aperture,
    ChannelSettings,
    CommunicationError,
    Identity,
    IdentityError,
    MeasurementError,
    OverloadError,
    ProbeKind,
    ReportedError,
    SetpointError,
)
from drivers.keysight.options import ImpedanceCalibration

#: Ae of the data sheet with Kt = 2, worked out by hand: Ab, Zs and Yo by aperture, level and frequency.
_LCR = {
    (1.0, 1e-3, 1000.0, 1.0, Aperture.MEDIUM): ((3.18113257e-3, 1.680029303e-3), (5.06292972e-4, 2.67384968e-7)),
    (1.7, 2e-3, 120.0, 0.5, Aperture.LONG): ((6.68362978e-4, 4.197697380e-3), (7.53477341e-4, 5.56736906e-6)),
    (20.0, 1e-3, 100.0, 1.0, Aperture.SHORT): ((3e-3, 1.4562548990e-2), (9.55400781e-2, 2.318845114e-5)),
    (0.5, 5e-3, 5000.0, 0.3, Aperture.MEDIUM): ((1.570804284e-1, 2.0448748527e-3), (5e-4, 6.509005841e-8)),
    (0.0, 0.0, 100.0, 1.0, Aperture.MEDIUM): ((0.0, 1.6649110641e-3), (0.0, 2.6497882565e-6)),
    (0.0, 1e-3, 1000.0, 1.0, Aperture.MEDIUM): ((0.0, 4.821621233e-3), (5e-4, 2.67384853e-7)),
    # A little beyond the border, from which Q and D are taken into account: 0.12.
    (10.0, 1.909859317102744e-4, 1000.0, 1.0, Aperture.MEDIUM): (
        (5.03587132e-4, 1.6800734350e-3),
        (4.19655943734e-3, 2.6739199193e-7),
    ),
    (1.2, 1.591549430918954e-3, 1000.0, 1.0, Aperture.MEDIUM): (
        (4.19655943734e-3, 1.6800734350e-3),
        (5.03587132e-4, 2.6739199193e-7),
    ),
    (1.0, 0.0, 1000.0, 1.0, Aperture.MEDIUM): ((5e-4, 8.000007239e-4), (0.0, 2.0690154124e-7)),
}
_STATED = {
    point: tuple(Accuracy(gain=2.0 * gain, offset=2.0 * offset) for gain, offset in stated)
    for point, stated in _LCR.items()
}
_AT_1_KHZ = (1.0, 1e-3, 1000.0, 1.0, Aperture.MEDIUM)
#: Six digits are shown.
_DIGITS = {"inductance_accuracy.resolution": 1e-9, "resistance_accuracy.resolution": 1e-5, "frequency": 1000.0}
E4980A = Manual(
    identity=Identity("Keysight Technologies", "E4980AL", "MY54101234", "B.07.03"),
    accuracies_at={
        **_STATED,
        (1.0, 1e-3, 1000.0): _STATED[_AT_1_KHZ],
        (1.0, 1e-3, 19.9): MeasurementError,
        (1.0, 1e-3, 100.1e3): MeasurementError,
    },
    models=(
        Model(
            {r"\*IDN\?": b"Agilent Technologies,E4980A,MY1,A.02.10"},
            states={"maximum_frequency": 2e6, "found_state.9.query": "BIAS:STAT?"},
        ),
        # The E4980AL has no DC bias.
        Model({r"^BIAS": None}, states={"maximum_frequency": 1e6}),
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
DMM_34461A = Manual(
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


INFINIIVISION = Manual(
    full_scale_gain=0.02,
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
SWITCH_UNIT_34970A = Manual(
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
