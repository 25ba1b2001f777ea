"""34461A: dialogue, ranges, overload, and accuracy by the data sheet."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.catalogue import Surroundings
from drivers.interfaces import (
    Accuracy,
    CommunicationError,
    IdentityError,
    MeasurementError,
    OverloadError,
    ReportedError,
    SetpointError,
)
from drivers.keysight import dmm_34461a_data as data
from drivers.keysight.dmm_34461a import Keysight34461A
from drivers.keysight.options import Keysight34461AOptions
from tests.drivers.dialogue import played

ADDRESS = "TCPIP0::voltmeter::inst0::INSTR"
#: A 34461A as it should have been left.
RIGHT = {"VOLT:DC:ZERO:AUTO?": "1", "VOLT:DC:NULL:STAT?": "0", "CALC:SCAL:STAT?": "0"}
IDENTITY = "Agilent Technologies,34461A,MY53200001,A.01.10-02.25-01.10-00.35-01-01"
CERTIFICATE = Accuracy(gain=1e-5, offset=1e-6, source="certificate")


def test_dialogue(clock: Any) -> None:
    with played("keysight_34461a", clock) as (surroundings, address):
        meter = Keysight34461A.open(
            address, Keysight34461AOptions(serial_number="MY53201234"), surroundings, "voltmeter"
        )
        assert meter.identity.model == "34461A"
        meter.configure(0.05, power_line_cycles=20.0)
        clock.time = 3.0
        reading = meter.measure_voltage()
        assert (reading.value, reading.unit, reading.time) == (0.0320012345, "V", 3.0)
        # 0.0050 % of the reading and 0.0035 % of 100 mV; 0.3 ppm of the range over 100 cycles.
        assert reading.accuracy.gain == pytest.approx(50e-6)
        assert reading.accuracy.offset == pytest.approx(3.5e-6)
        assert reading.accuracy.resolution == pytest.approx(30e-9)
        assert reading.accuracy.source == data.SOURCE
        meter.make_safe()
        meter.close()


@pytest.fixture
def bench(manager: Any, connect: Any, settings_class: Any, clock: Any) -> Any:
    device = settings_class(IDENTITY, {"READ?": "-1.23456789E-02", **RIGHT})
    wire = connect(ADDRESS, device)
    options = Keysight34461AOptions(calibration={1.0: CERTIFICATE})
    meter = Keysight34461A.open(ADDRESS, options, Surroundings(clock, lambda: manager), "voltmeter")
    yield meter, wire, device
    meter.close()


def test_the_messages_sent(bench: Any) -> None:
    meter, wire, _ = bench
    assert wire.sent == ["*IDN?", "SYST:ERR?", *RIGHT]
    wire.sent.clear()
    meter.configure(0.1)
    assert wire.sent == ["CONF:VOLT:DC 0.1", "SYST:ERR?", "VOLT:DC:NPLC 10", "SYST:ERR?"]
    wire.sent.clear()
    assert meter.measure_voltage().value == -0.0123456789
    assert wire.sent == ["READ?"]


@pytest.mark.parametrize(
    ("full_scale", "message"),
    [
        (0.0, "CONF:VOLT:DC 0.1"),
        (0.1, "CONF:VOLT:DC 0.1"),
        (0.1001, "CONF:VOLT:DC 1"),
        (5.0, "CONF:VOLT:DC 10"),
        (48.0, "CONF:VOLT:DC 100"),
        (1000.0, "CONF:VOLT:DC 1000"),
    ],
)
def test_the_smallest_range_that_holds_it(bench: Any, full_scale: float, message: str) -> None:
    meter, wire, _ = bench
    meter.configure(full_scale)
    assert message in wire.sent


@pytest.mark.parametrize(
    ("full_scale", "cycles", "message"),
    [
        (1001.0, 10.0, "full scale = 1001 V is outside 0 … 1000 V, the limit of the model"),
        (-1.0, 10.0, "full scale = -1 V"),
        (float("nan"), 10.0, "full scale = nan V"),
        (0.1, 1.0, "integration time = 1 power-line cycles is outside 10 … 100"),
        (0.1, 101.0, "integration time = 101 power-line cycles"),
    ],
)
def test_limits(bench: Any, full_scale: float, cycles: float, message: str) -> None:
    meter, wire, _ = bench
    wire.sent.clear()
    with pytest.raises(SetpointError, match=message):
        meter.configure(full_scale, cycles)
    assert wire.sent == []


@pytest.mark.parametrize("reply", ["+9.90000000E+37", "-9.90000000E+37"])
def test_overload(bench: Any, reply: str) -> None:
    meter, _, device = bench
    meter.configure(1.0)
    device.values["READ?"] = reply
    with pytest.raises(
        OverloadError, match=r"voltmeter after 'READ\?': overload: beyond the range of 1 V.*sense leads"
    ):
        meter.measure_voltage()


@pytest.mark.parametrize("reply", ["", "overload", "+1.0E-02,+1.1E-02", "nan"])
def test_a_reply_that_is_no_number(bench: Any, reply: str) -> None:
    meter, _, device = bench
    meter.configure(1.0)
    device.values["READ?"] = reply
    with pytest.raises(CommunicationError, match="unusable reply"):
        meter.measure_voltage()


def test_a_lost_reply_is_asked_for_again_and_a_second_one_reported(bench: Any) -> None:
    meter, wire, _ = bench
    meter.configure(0.1)
    wire.lost["READ?"] = 1
    assert meter.measure_voltage().value == -0.0123456789
    wire.lost["READ?"] = 2
    with pytest.raises(CommunicationError, match=r"READ\?': no reply .*twice"):
        meter.measure_voltage()
    assert meter.measure_voltage().value == -0.0123456789


def test_a_refused_setting_leaves_the_former_range(bench: Any) -> None:
    meter, _, device = bench
    meter.configure(0.1)
    device.refuse["CONF:VOLT:DC 1000"] = '-222,"Data out of range"'
    with pytest.raises(ReportedError, match=r"CONF:VOLT:DC 1000.*-222 Data out of range"):
        meter.configure(500.0)
    assert meter.measure_voltage().accuracy.offset == pytest.approx(3.5e-6)


def test_measuring_unconfigured_is_refused(bench: Any) -> None:
    meter, wire, _ = bench
    with pytest.raises(MeasurementError, match=r"configure\(\) first"):
        meter.measure_voltage()
    assert "READ?" not in wire.sent


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("Keysight Technologies,34460A,MY1,A.1", "34460A answers, expected 34461A"),
        ("Rigol Technologies,34461A,DM1,1", "Rigol Technologies 34461A answers"),
        ("HEWLETT-PACKARD,34401A,0,11-5-2", "34401A answers"),
        ("34461A", "not an identity of four fields"),
    ],
)
def test_another_instrument_is_refused(
    manager: Any, connect: Any, settings_class: Any, clock: Any, line: str, message: str
) -> None:
    connect(ADDRESS, settings_class(line))
    with pytest.raises(IdentityError, match=message):
        Keysight34461A.open(ADDRESS, Keysight34461AOptions(), Surroundings(clock, lambda: manager), "voltmeter")


def test_another_serial_number_is_refused(manager: Any, connect: Any, settings_class: Any, clock: Any) -> None:
    connect(ADDRESS, settings_class(IDENTITY))
    with pytest.raises(IdentityError, match="serial number MY53200001 answers, expected MY2"):
        Keysight34461A.open(
            ADDRESS, Keysight34461AOptions(serial_number="MY2"), Surroundings(clock, lambda: manager), "voltmeter"
        )


def test_a_calibration_of_no_range_is_refused(manager: Any, connect: Any, settings_class: Any, clock: Any) -> None:
    connect(ADDRESS, settings_class(IDENTITY))
    options = Keysight34461AOptions(calibration={0.2: CERTIFICATE})
    with pytest.raises(IdentityError, match=r"has ranges 0\.1, 1, 10, 100, 1000 V, not 0\.2 V.*calibration"):
        Keysight34461A.open(ADDRESS, options, Surroundings(clock, lambda: manager), "voltmeter")


# By hand from the data sheet, 1 year: % of reading and % of range.
@pytest.mark.parametrize(
    ("voltage", "limit"),
    [
        (0.032, 0.032 * 50e-6 + 0.1 * 35e-6),
        (-5.0, 5.0 * 35e-6 + 10.0 * 5e-6),
        (48.0, 48.0 * 45e-6 + 100.0 * 6e-6),
        (1000.0, 1000.0 * 45e-6 + 1000.0 * 10e-6),
    ],
)
def test_limit_of_error(bench: Any, voltage: float, limit: float) -> None:
    accuracy = bench[0].accuracy_at(voltage)
    assert accuracy.gain * abs(voltage) + accuracy.offset == pytest.approx(limit)


def test_limit_of_error_of_the_volt_range() -> None:
    accuracy = data.stated_accuracy(1.0, 10.0)
    assert (accuracy.gain, accuracy.offset, accuracy.resolution) == pytest.approx((40e-6, 7e-6, 1e-6))


def test_calibration_goes_before_the_data_sheet(bench: Any) -> None:
    meter = bench[0]
    assert meter.accuracy_at(0.5) is CERTIFICATE
    assert meter.accuracy_at(0.05).source == data.SOURCE
    meter.configure(0.5)
    assert meter.measure_voltage().accuracy is CERTIFICATE


def test_no_figure_is_made_up_beyond_the_data(bench: Any) -> None:
    with pytest.raises(MeasurementError, match="1001 V is beyond the highest range, 1000 V"):
        bench[0].accuracy_at(1001.0)


@given(st.floats(-1000.0, 1000.0))
def test_every_voltage_lies_in_its_range_and_in_no_smaller_one(voltage: float) -> None:
    chosen = data.range_for(voltage)
    assert abs(voltage) <= chosen
    assert all(abs(voltage) > smaller for smaller in data.RANGES if smaller < chosen)
