"""E4980A: dialogue, status of readings, and accuracy by the data sheet's formula."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.bases.found_state import matches
from drivers.catalogue import Surroundings
from drivers.interfaces import (
    Accuracy,
    Aperture,
    CommunicationError,
    MeasurementError,
    OverloadError,
    ReportedError,
    SetpointError,
)
from drivers.keysight import e4980a_data as data
from drivers.keysight.e4980a import KeysightE4980A
from drivers.keysight.options import E4980AOptions, ImpedanceCalibration
from tests.drivers.dialogue import played

ADDRESS = "TCPIP0::lcr-meter::inst0::INSTR"
#: An E4980A as it should have been left.
RIGHT = {
    "DISP:PAGE?": "MEAS",
    "TRIG:SOUR?": "BUS",
    "INIT:CONT?": "1",
    "FUNC:DEV1:MODE?": "OFF",
    "FUNC:DEV2:MODE?": "OFF",
    "AMPL:ALC?": "0",
    "CORR:OPEN:STAT?": "0",
    "CORR:LOAD:STAT?": "0",
    "CORR:LENG?": "+1.00000E+00",
    "BIAS:STAT?": "0",
}


def test_dialogue(clock: Any) -> None:
    with played("keysight_e4980al", clock) as (surroundings, address):
        meter = KeysightE4980A.open(address, E4980AOptions(), surroundings, "lcr_meter")
        assert meter.maximum_frequency == 300e3
        meter.configure(20.0, aperture=Aperture.LONG)
        meter.correct_short()
        clock.time = 3.0
        reading = meter.measure()
        assert (reading.resistance, reading.inductance, reading.frequency, reading.time) == (0.032, 146e-6, 20.0, 3.0)
        assert reading.resistance_accuracy.resolution == pytest.approx(1e-7)
        assert reading.inductance_accuracy.resolution == pytest.approx(1e-9)
        meter.close()


@pytest.fixture
def bench(manager: Any, connect: Any, settings_class: Any, clock: Any) -> Any:
    device = settings_class(
        "Agilent Technologies,E4980A,MY46000000,A.06.02",
        {"FETC?": "+1.00000E-03,+2.00000E+00,+0", **RIGHT},
    )
    wire = connect(ADDRESS, device)
    calibration = ImpedanceCalibration(120.0, Accuracy(gain=1e-3, source="certificate"), None)
    options = E4980AOptions(maximum_frequency=200e3, maximum_level=1.5, calibration=(calibration,))
    meter = KeysightE4980A.open(ADDRESS, options, Surroundings(clock, lambda: manager), "lcr_meter")
    yield meter, wire, device
    meter.close()


def test_a_bias_that_the_front_panel_left_on_is_switched_off_first(bench: Any) -> None:
    meter, wire, _ = bench
    wire.sent.clear()
    meter.configure(1000.0)
    assert wire.sent[0] == "BIAS:STAT OFF"
    assert meter.source_impedance == 100.0


def test_one_reading_is_one_trigger_and_one_fetch(bench: Any) -> None:
    meter, wire, _ = bench
    meter.configure(1000.0)
    wire.sent.clear()
    meter.measure()
    assert wire.sent == ["TRIG:IMM;*OPC?", "SYST:ERR?", "FETC?"]


def test_an_ignored_trigger_gives_no_reading(bench: Any) -> None:
    meter, wire, device = bench
    meter.configure(1000.0)
    assert [sent for sent in wire.sent if sent.startswith(("TRIG", "INIT"))][-2:] == ["TRIG:SOUR BUS", "INIT:CONT ON"]
    device.errors.append('-211,"Trigger ignored"')
    wire.sent.clear()
    with pytest.raises(ReportedError, match=r"TRIG:IMM.*-211 Trigger ignored"):
        meter.measure()
    assert "FETC?" not in wire.sent


HOSTILE = {
    "DISP:PAGE?": ("MSET", "MEAS"),
    "TRIG:SOUR?": ("HOLD", "BUS"),
    "INIT:CONT?": ("0", "1"),
    "FUNC:DEV1:MODE?": ("PERC", "OFF"),
    "AMPL:ALC?": ("1", "0"),
    "CORR:OPEN:STAT?": ("1", "0"),
    "CORR:LOAD:STAT?": ("1", "0"),
    "BIAS:STAT?": ("1", "0"),
}


def test_what_the_last_user_left_is_set_and_given_back(
    manager: Any, connect: Any, settings_class: Any, clock: Any
) -> None:
    left = {**RIGHT, **{query: found for query, (found, _) in HOSTILE.items()}}
    device = settings_class("Agilent Technologies,E4980A,MY46000000,A.06.02", left)
    wire = connect(ADDRESS, device)
    meter = KeysightE4980A.open(ADDRESS, E4980AOptions(), Surroundings(clock, lambda: manager), "lcr_meter")
    assert all(
        matches(device.values[query], (right, "0" if right == "OFF" else right))
        for query, (_, right) in HOSTILE.items()
    )
    told = {setting.query: (setting.found, setting.changed) for setting in meter.found_state}
    assert told["TRIG:SOUR?"] == ("HOLD", True)
    assert told["FUNC:DEV2:MODE?"] == ("OFF", False)
    meter.configure(1000.0)
    meter.close()
    assert {query: device.values[query] for query in HOSTILE} == {query: found for query, (found, _) in HOSTILE.items()}
    assert "BIAS:STAT 1" in wire.sent


def test_a_bridge_on_its_list_page_is_refused_with_the_key_to_press(
    manager: Any, connect: Any, settings_class: Any, clock: Any
) -> None:
    device = settings_class("Agilent Technologies,E4980A,MY46000000,A.06.02", {**RIGHT, "DISP:PAGE?": "LIST"})
    connect(ADDRESS, device)
    with pytest.raises(
        ReportedError, match=r"DISP:PAGE\?.*is set to LIST.*Press \[Display Format\], then MEAS DISPLAY"
    ):
        KeysightE4980A.open(ADDRESS, E4980AOptions(), Surroundings(clock, lambda: manager), "lcr_meter")
    guard = Surroundings(clock, lambda: manager, guarding=True)
    KeysightE4980A.open(ADDRESS, E4980AOptions(), guard, "lcr_meter").close()


def test_a_trigger_is_never_repeated(bench: Any) -> None:
    meter, wire, _ = bench
    meter.configure(1000.0)
    wire.lost["TRIG:IMM;*OPC?"] = 1
    with pytest.raises(CommunicationError, match="no reply"):
        meter.measure()
    assert wire.sent.count("TRIG:IMM;*OPC?") == 1
    assert meter.measure().resistance == 2.0


@pytest.mark.parametrize(
    ("reply", "error", "message"),
    [
        ("+9.90000E+37,+9.90000E+37,+1", OverloadError, "overload"),
        ("+9.90000E+37,+9.90000E+37,-1", OverloadError, "no data"),
        ("+9.90000E+37,+1.00000E+00,+0", OverloadError, "9.9E37"),
        ("+1.00000E-03,+2.00000E+00,+3", MeasurementError, "signal source was overloaded"),
        ("+1.00000E-03,+2.00000E+00,+4", MeasurementError, "level control"),
        ("+1.00000E-03,+2.00000E+00,+7", MeasurementError, "unknown status 7"),
        ("+1.00000E-03,+2.00000E+00", CommunicationError, "2 fields instead of 3 … 4"),
        ("+1.0,+2.0,+0,+1,+5", CommunicationError, "5 fields"),
        ("+1.00000E-03,?,+0", CommunicationError, "unusable reply"),
    ],
)
def test_status(bench: Any, reply: str, error: type[Exception], message: str) -> None:
    meter, _, device = bench
    meter.configure(1000.0)
    device.values["FETC?"] = reply
    with pytest.raises(error, match=message) as caught:
        meter.measure()
    assert type(caught.value) is error
    assert "FETC?" in str(caught.value)


def test_a_bin_number_does_not_disturb(bench: Any) -> None:
    meter, _, device = bench
    meter.configure(1000.0)
    device.values["FETC?"] += ",+3"
    assert meter.measure().resistance == 2.0


def test_a_trigger_that_is_not_reported_complete_gives_no_reading(bench: Any) -> None:
    meter, wire, device = bench
    meter.configure(1000.0)
    wire.handler = lambda message: b"0\n" if message == "TRIG:IMM;*OPC?" else device(message)
    with pytest.raises(CommunicationError, match="'0' instead of 1"):
        meter.measure()


def test_measuring_unconfigured_is_refused(bench: Any) -> None:
    with pytest.raises(MeasurementError, match=r"configure\(\) first"):
        bench[0].measure()


@pytest.mark.parametrize(
    ("frequency", "level", "message"),
    [
        (19.0, 1.0, "19 Hz is outside 20 … 200000 Hz, the limit of the station"),
        (250e3, 1.0, "250000 Hz"),
        (20.0, 1.6, "1.6 V rms is outside 0.005 … 1.5 V rms"),
    ],
)
def test_limits(bench: Any, frequency: float, level: float, message: str) -> None:
    meter, wire, _ = bench
    wire.sent.clear()
    with pytest.raises(SetpointError, match=message):
        meter.configure(frequency, level)
    assert wire.sent == []


def test_a_correction_that_stays_off_is_an_error(bench: Any) -> None:
    meter, wire, device = bench
    wire.handler = lambda message: b"0\n" if message == "CORR:SHOR:STAT?" else device(message)
    with pytest.raises(ReportedError, match="still off"):
        meter.correct_short()


@pytest.mark.parametrize(("options", "highest"), [("032", 300e3), ("001,052", 500e3), ("102", 1e6), ("0", 300e3)])
def test_frequency_option_of_the_al(
    manager: Any, connect: Any, settings_class: Any, clock: Any, options: str, highest: float
) -> None:
    connect(ADDRESS, settings_class("Keysight Technologies,E4980AL,MY1,B.07.01", {"*OPT?": options, **RIGHT}))
    meter = KeysightE4980A.open(ADDRESS, E4980AOptions(), Surroundings(clock, lambda: manager), "lcr_meter")
    assert meter.maximum_frequency == highest
    meter.close()


# By hand from the data sheet: 20 Hz, 1 V, MEDIUM. (1 + √50) = 8.0711; above 1.08 Ω Zs = 0.6 mΩ·1.4·8.0711 = 6.7797 mΩ,
# below 0.2 mΩ·2·8.0711 = 3.2284 mΩ; Yo = 0.5 nS·1.1·(1 + √5) = 1.7799 nS; Ab = 0.10 %.
@pytest.mark.parametrize(
    ("resistance", "limit"),
    [
        (2.0, 2.0 * 1e-3 + 6.7797e-3),
        (0.1, 0.1 * 1e-3 + 3.2284e-3),
        (1e6, 1e6 * 1e-3 + 6.7797e-3 + 1.7799e-9 * 1e12),
    ],
)
def test_limit_of_error_of_a_resistance(bench: Any, resistance: float, limit: float) -> None:
    accuracy, _ = bench[0].accuracy_at(resistance, 0.0, 20.0)
    assert accuracy.gain * resistance + accuracy.offset == pytest.approx(limit, rel=1e-4)
    assert accuracy.gain == pytest.approx(1e-3)


def test_q_and_d_factors(bench: Any) -> None:
    meter = bench[0]
    # Q = 1: |Z| = √2·R, and the relative error of R and of L alike is √2·Ae.
    r_accuracy, l_accuracy = meter.accuracy_at(100.0, 100.0 / (2 * math.pi * 1000), 1000.0)
    size = 100 * math.sqrt(2)
    ae = 5e-4 + (0.6e-3 * 1.4 * 2) / size + 0.5e-9 * 1.1 * (1 + math.sqrt(0.1)) * size
    assert r_accuracy.gain * 100 + r_accuracy.offset == pytest.approx(ae * math.sqrt(2) * 100)
    inductance = 100.0 / (2 * math.pi * 1000)
    assert l_accuracy.gain * inductance + l_accuracy.offset == pytest.approx(ae * math.sqrt(2) * inductance)


def test_below_a_tenth_the_factors_are_one(bench: Any) -> None:
    r_accuracy, _ = bench[0].accuracy_at(100.0, 9.0 / (2 * math.pi * 1000), 1000.0)
    assert r_accuracy.gain == pytest.approx(5e-4)
    _, l_accuracy = bench[0].accuracy_at(9.0, 100.0 / (2 * math.pi * 1000), 1000.0)
    assert l_accuracy.gain == pytest.approx(5e-4)


@pytest.mark.parametrize(
    ("frequency", "level", "aperture", "percent"),
    [
        (20.0, 1.0, Aperture.MEDIUM, 0.10),
        (100.0, 1.0, Aperture.LONG, 0.05),  # 100 Hz stands in the better row
        (20.0, 0.3, Aperture.MEDIUM, 0.10),  # 0.3 V in the better column
        (20.0, 0.2, Aperture.MEDIUM, 0.25),
        (1000.0, 2.0, Aperture.MEDIUM, 0.10),
        (20.0, 0.03, Aperture.MEDIUM, 0.25),
        (20.0, 0.01, Aperture.MEDIUM, 0.75),
        (124.0, 1.0, Aperture.SHORT, 0.30),
        (125.0, 1.0, Aperture.SHORT, 0.10),
        (1000.0, 0.025, Aperture.SHORT, 0.40),
    ],
)
def test_basic_accuracy(frequency: float, level: float, aperture: Aperture, percent: float) -> None:
    assert data.basic_accuracy(frequency, level, aperture) == pytest.approx(percent / 100)


@given(
    st.floats(1e-3, 1e5),
    st.floats(0, 10),
    st.sampled_from([20.0, 100.0, 1000.0, 100e3]),
    st.sampled_from(list(Aperture)),
)
def test_short_aperture_is_never_better(resistance: float, level: float, frequency: float, aperture: Aperture) -> None:
    level = 0.005 + level * 0.19
    for figure in (data.basic_accuracy, data.open_offset):
        assert figure(frequency, level, Aperture.SHORT) >= figure(frequency, level, aperture)
    short = data.short_offset(resistance, frequency, level, Aperture.SHORT)
    assert short >= data.short_offset(resistance, frequency, level, aperture)


def test_calibration_goes_before_the_data_sheet(bench: Any) -> None:
    r_accuracy, l_accuracy = bench[0].accuracy_at(1.0, 1e-3, 120.0)
    assert r_accuracy.source == "certificate"
    assert l_accuracy.source == data.SOURCE


def test_no_figure_is_made_up_beyond_the_data(bench: Any) -> None:
    with pytest.raises(MeasurementError, match="no accuracy is stated at 150000 Hz"):
        bench[0].accuracy_at(1.0, 1e-3, 150e3)


def test_a_dead_short_has_an_accuracy(bench: Any) -> None:
    r_accuracy, l_accuracy = bench[0].accuracy_at(0.0, 0.0, 1000.0)
    assert r_accuracy.offset == pytest.approx(0.2e-3 * 2 * 2)
    assert l_accuracy.offset == pytest.approx(0.2e-3 * 2 * 2 / (2 * math.pi * 1000))
