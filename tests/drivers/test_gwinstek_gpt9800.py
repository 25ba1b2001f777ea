"""GPT-9800 as an insulation tester: dialogue, the end of a test, discharge, and off whatever happens."""

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import pyvisa
from hypothesis import given
from hypothesis import strategies as st

from drivers.catalogue import Surroundings
from drivers.gwinstek import gpt9800_data as data
from drivers.gwinstek.gpt9800 import GwInstekGpt9800, parse_output, parse_report
from drivers.gwinstek.options import Gpt9800Options
from drivers.interfaces import (
    Accuracy,
    CommunicationError,
    IdentityError,
    MeasurementError,
    ReportedError,
    SetpointError,
)
from tests.drivers.dialogue import played

ADDRESS = "TCPIP0::tester::inst0::INSTR"
PREPARED = [
    "FUNC:TEST OFF",
    "MAIN:FUNC MANU",
    "MANU:EDIT:MODE IR",
    "MANU:RTIM 0.1",
    "MANU:IR:VOLT 0.500",
    "MANU:IR:RHIS 9999",
    "MANU:IR:RLOS 1",
    "MANU:IR:TTIM 2.0",
    "MANU:IR:REF 0",
    "TEST:RET OFF",
]


class Device:
    """The tester's side: what it was set to, whether it puts out, and what it shows."""

    def __init__(self) -> None:
        self.identity = "GPT-9803,GES123456789   ,V1.05,"
        self.on = False
        self.stays_on = False
        self.voltage = "0.500kV"
        self.reference = "0000M ohm"
        self.left: dict[str, str | None] = {
            "MAIN:FUNC?": "MANU MODE",
            "MANU:EDIT:MODE?": "IR",
            "TEST:RET?": "TEST:RETURN OFF",
        }
        self.ended = "IR,PASS ,0.499kV,2000M ohm,T=002.0S"
        self.idle = ["IR,VIEW ,0.000kV,0000M ohm,  ---.-S"]
        self.running = 0  # how many looks find it still testing
        self.errors: list[str] = []
        self.tests = 0

    def __call__(self, message: str) -> bytes | None:
        answer = self.answer(message)
        return None if answer is None else answer.encode() + b"\n"

    def answer(self, message: str) -> str | None:
        if message == "FUNC:TEST ON":
            self.on, self.tests = True, self.tests + 1
        if message == "FUNC:TEST OFF":
            self.on = self.stays_on and self.on
        if message == "MEAS?":
            return self.shown()
        if message == "SYST:ERR?":
            return self.errors.pop(0) if self.errors else "0,No Error"
        return {
            "*IDN?": self.identity,
            "FUNC:TEST?": "TEST ON" if self.on else "TEST OFF",
            "MANU:IR:VOLT?": self.voltage,
            "MANU:IR:REF?": self.reference,
            **self.left,
        }.get(message)

    def shown(self) -> str:
        if not self.on:
            return self.idle.pop(0) if len(self.idle) > 1 else self.idle[0]
        if self.running > 0:
            self.running -= 1
            return "IR,TEST ,0.500kV,1800M ohm,T=001.9S"
        return self.ended


@pytest.fixture
def device() -> Device:
    return Device()


@pytest.fixture
def wire(connect: Callable[..., Any], device: Device) -> Any:
    return connect(ADDRESS, device)


@pytest.fixture
def tester(manager: Any, wire: Any, clock: Any) -> Iterator[GwInstekGpt9800]:
    made = GwInstekGpt9800.open(
        ADDRESS, Gpt9800Options(maximum_voltage=600.0), Surroundings(clock, lambda: manager), "insulation_tester"
    )
    wire.sent.clear()
    yield made
    made.close()


@pytest.mark.parametrize("reference", ["0012M ohm", "0.5", "10", "NONE", ""])
def test_a_reference_that_stays_is_refused(tester: GwInstekGpt9800, device: Device, wire: Any, reference: str) -> None:
    device.reference = reference
    with pytest.raises(ReportedError, match="still subtracted from the resistance"):
        tester.measure(500.0, 1.0)
    assert "FUNC:TEST ON" not in wire.sent


def test_what_was_left_is_told_set_and_put_back(clock: Any) -> None:
    with played("gwinstek_gpt9803", clock) as (surroundings, address):
        tester = GwInstekGpt9800.open(
            address, Gpt9800Options(serial_number="GES123456789"), surroundings, "insulation_tester"
        )
        told = [(one.query, one.found, one.wanted, one.changed) for one in tester.found_state]
        tester.measure(500.0, 1.0)
        tester.close()
    assert told == [
        ("MAIN:FUNC?", "MANU", "MANU", False),
        ("MANU:EDIT:MODE?", "ACW", "IR", True),
        ("MANU:IR:REF?", "12", "0", True),
        ("TEST:RET?", "ON", "OFF", True),
    ]


def test_a_tester_that_does_not_tell_everything(manager: Any, wire: Any, device: Device, clock: Any) -> None:
    device.left["MAIN:FUNC?"] = device.left["TEST:RET?"] = None
    device.errors = ["0,No Error", "20,Command Error", "0,No Error", "20,Command Error", "0,No Error"]
    tester = GwInstekGpt9800.open(ADDRESS, Gpt9800Options(), Surroundings(clock, lambda: manager), "insulation_tester")
    assert [one.query for one in tester.found_state] == ["MANU:EDIT:MODE?", "MANU:IR:REF?"]
    tester.close()
    assert wire.sent[-1] == "*RMTOFF"


@pytest.mark.parametrize("reference", ["0000M ohm", "0", "0.000", "+0 M ohm"])
def test_no_reference_in_any_form(tester: GwInstekGpt9800, device: Device, reference: str) -> None:
    device.reference = reference
    assert tester.measure(500.0, 2.0).resistance.value == 2e9


def test_dialogue(clock: Any) -> None:
    with played("gwinstek_gpt9803", clock) as (surroundings, address):
        tester = GwInstekGpt9800.open(
            address, Gpt9800Options(serial_number="GES123456789"), surroundings, "insulation_tester"
        )
        assert (tester.identity.manufacturer, tester.identity.model) == ("GW Instek", "GPT-9803")
        reading = tester.measure(500.0, 1.0)
        assert (reading.resistance.value, reading.resistance.unit, reading.voltage) == (2.0e9, "Ω", 500.0)
        assert not reading.beyond_range
        tester.close()


def test_the_messages_of_a_test(tester: GwInstekGpt9800, wire: Any, clock: Any, device: Device) -> None:
    device.running = 2
    device.idle = ["IR,VIEW ,0.310kV,0000M ohm,  ---.-S", "IR,VIEW ,0.012kV,0000M ohm,  ---.-S"]
    reading = tester.measure(500.0, 2.0)
    prepared = [message for command in PREPARED for message in (command, "SYST:ERR?")]
    end = ["FUNC:TEST OFF", "FUNC:TEST?", "MEAS?", "MEAS?"]
    assert wire.sent == [*prepared, "MANU:IR:VOLT?", "MANU:IR:REF?", "FUNC:TEST ON", "MEAS?", "MEAS?", "MEAS?", *end]
    assert clock.slept == pytest.approx([2.1, 0.1, 0.1, 0.1])
    assert (reading.resistance.value, reading.voltage, reading.beyond_range) == (2.0e9, 499.0, False)
    assert reading.resistance.time == pytest.approx(2.4)
    assert not device.on


@pytest.mark.parametrize(
    ("shown", "resistance", "beyond"),
    [
        ("IR,FAIL ,0.500kV,9999M ohm,T=002.0S", 9.999e9, True),
        ("IR,PASS ,0.500kV,>9999M ohm,T=002.0S", 9.999e9, True),
        (">IR, PASS , 0.500kV , 0123M ohm , T=002.0S", 123e6, False),
        ("IR,PASS ,0.500kV,1.250G ohm,T=002.0S", 1.25e9, False),
        # Below its range the tester judges at once.
        ("IR,FAIL ,0.500kV,0000M ohm,T=000.2S", 0.0, False),
    ],
)
def test_what_it_shows(tester: GwInstekGpt9800, device: Device, shown: str, resistance: float, beyond: bool) -> None:
    device.ended = shown
    reading = tester.measure(500.0, 2.0)
    assert reading.resistance.value == pytest.approx(resistance)
    assert reading.beyond_range is beyond


@pytest.mark.parametrize(
    ("shown", "message"),
    [
        ("IR,FAIL ,0.020kV,0000M ohm,R=000.1S", "the test reached 20 V of 500 V"),
        ("IR,FAIL ,0.500kV,2000M ohm,R=000.1S", "the test reached 500 V of 500 V"),
        ("IR,FAIL ,0.500kV,2000M ohm,T=000.7S", r"the test ended FAIL after 0.7 s of 2 s"),
        ("IR,TEST ,0.500kV,2000M ohm,T=000.7S", r"the test has not ended 3 s after its time \(it says TEST\)"),
        ("IR,VIEW ,0.000kV,0000M ohm,  ---.-S", r"it says VIEW.*interlock"),
    ],
)
def test_a_test_that_was_none(tester: GwInstekGpt9800, device: Device, shown: str, message: str) -> None:
    device.ended = shown
    with pytest.raises(MeasurementError, match=message):
        tester.measure(500.0, 2.0)
    assert not device.on


@pytest.mark.parametrize(
    ("voltage", "duration", "message"),
    [
        (650.0, 1.0, r"voltage = 650 V is outside 50 … 600 V, the limit of the station"),
        (20.0, 1.0, "outside 50"),
        (float("nan"), 1.0, "voltage = nan"),
        (510.0, 1.0, "steps of 50 V"),
        (500.0, 0.5, r"duration = 0.5 s is outside 1 … 999.9 s"),
    ],
)
def test_set_points_are_refused_before_anything_is_sent(
    tester: GwInstekGpt9800, wire: Any, voltage: float, duration: float, message: str
) -> None:
    with pytest.raises(SetpointError, match=message):
        tester.measure(voltage, duration)
    assert wire.sent == []


def test_another_voltage_than_set_is_never_switched_on(tester: GwInstekGpt9800, device: Device) -> None:
    device.voltage = "1.000kV"
    with pytest.raises(ReportedError, match=r"the test voltage is '1.000kV' instead of 0.500 kV"):
        tester.measure(500.0, 2.0)
    assert device.tests == 0


def test_what_the_tester_refuses_is_said(tester: GwInstekGpt9800, device: Device) -> None:
    device.errors = ["20,Command Error"]
    with pytest.raises(ReportedError, match="20 Command Error"):
        tester.measure(500.0, 2.0)
    assert device.tests == 0


def test_off_after_ctrl_c(tester: GwInstekGpt9800, device: Device, wire: Any) -> None:
    wire.interrupt = {"MEAS?": 1}
    with pytest.raises(KeyboardInterrupt):
        tester.measure(500.0, 2.0)
    assert not device.on


def test_off_over_a_renewed_connection(tester: GwInstekGpt9800, device: Device, wire: Any) -> None:
    device.ended = "IR,PASS ,0.5"
    wire.fail_write = {"FUNC:TEST?": 1}
    with pytest.raises(CommunicationError, match="unusable reply"):
        tester.measure(500.0, 2.0)
    assert not device.on


def test_an_output_that_stays_on_is_said(tester: GwInstekGpt9800, device: Device) -> None:
    device.stays_on = True
    with pytest.raises(ReportedError, match=r"the output is still on \('TEST ON'\)"):
        tester.measure(500.0, 2.0)


def test_a_tester_that_says_off_once_it_has_discharged(tester: GwInstekGpt9800, device: Device, clock: Any) -> None:
    device.stays_on = True

    def discharged() -> None:
        device.on = device.stays_on = device.on and clock.time < 2.5

    clock.on_sleep = discharged
    tester.measure(500.0, 2.0)
    assert clock.time == pytest.approx(2.5, abs=0.11)


def test_an_object_that_stays_charged_is_said(tester: GwInstekGpt9800, device: Device, clock: Any) -> None:
    device.idle = ["IR,VIEW ,0.480kV,0000M ohm,  ---.-S"]
    with pytest.raises(ReportedError, match=r"480 V are left 5\.\d s after the output went off"):
        tester.measure(500.0, 2.0)


def test_a_result_that_stays_on_the_display_is_no_charge(tester: GwInstekGpt9800, device: Device, clock: Any) -> None:
    device.idle = [device.ended]
    tester.measure(500.0, 2.0)
    assert clock.time == pytest.approx(2.1 + 1.0, abs=0.11)


def test_what_shows_no_voltage_is_not_taken_for_none(tester: GwInstekGpt9800, device: Device) -> None:
    device.idle = ["???"]
    with pytest.raises(CommunicationError, match=r"unusable reply '\?\?\?'"):
        tester.make_safe()


@pytest.mark.parametrize(
    ("identity", "message"),
    [
        ("Keysight Technologies,34461A,MY1,1.0", "answers, expected GPT-9803"),
        ("GPT-9801,GES1,V1.00", "answers, expected GPT-9803"),
    ],
)
def test_another_instrument(manager: Any, wire: Any, device: Device, clock: Any, identity: str, message: str) -> None:
    device.identity = identity
    with pytest.raises(IdentityError, match=message):
        GwInstekGpt9800.open(ADDRESS, Gpt9800Options(), Surroundings(clock, lambda: manager), "insulation_tester")


def test_another_unit(manager: Any, wire: Any, clock: Any) -> None:
    with pytest.raises(IdentityError, match="serial number GES123456789 answers, expected GES1"):
        GwInstekGpt9800.open(
            ADDRESS, Gpt9800Options(serial_number="GES1"), Surroundings(clock, lambda: manager), "insulation_tester"
        )


def test_a_serial_line_has_the_testers_rate(manager: Any, connect: Any, device: Device, clock: Any) -> None:
    connect("ASRL3::INSTR", device)
    tester = GwInstekGpt9800.open(
        "ASRL3::INSTR", Gpt9800Options(baud_rate=57_600), Surroundings(clock, lambda: manager), "insulation_tester"
    )
    rate = pyvisa.constants.VI_ATTR_ASRL_BAUD
    assert [value for (_, name), value in manager.visalib.attributes.items() if name == rate] == [57_600]
    tester.close()


def test_a_guardian_asks_nothing_but_who_it_is(manager: Any, wire: Any, clock: Any) -> None:
    tester = GwInstekGpt9800.open(
        ADDRESS, Gpt9800Options(), Surroundings(clock, lambda: manager, guarding=True), "insulation_tester"
    )
    assert wire.sent == ["*IDN?"]
    tester.make_safe()
    assert wire.sent == ["*IDN?", "FUNC:TEST OFF", "FUNC:TEST?", "MEAS?"]
    tester.close()


@pytest.mark.parametrize(
    ("resistance", "voltage", "gain"),
    [(50e6, 250.0, 0.05), (51e6, 250.0, 0.10), (500e6, 500.0, 0.05), (501e6, 500.0, 0.10)],
)
def test_accuracy(resistance: float, voltage: float, gain: float) -> None:
    assert data.stated_accuracy(resistance, voltage) == Accuracy(gain, 1e6, 1e6, source=data.SOURCE)


def test_a_calibration_replaces_it(manager: Any, wire: Any, clock: Any) -> None:
    own = Accuracy(gain=0.02, source="certificate")
    tester = GwInstekGpt9800.open(
        ADDRESS, Gpt9800Options(accuracy=own), Surroundings(clock, lambda: manager), "insulation_tester"
    )
    assert tester.measure(500.0, 2.0).resistance.accuracy == own
    tester.close()


def test_voltages_of_other_functions() -> None:
    assert parse_output("ACW, FAIL , 0.024kV ,0.013 mA ,R=000.1S").voltage == 24.0
    assert parse_output("GB ,VIEW ,03.00A ,000.0m ohm,T=---.-S").voltage == 0.0


@given(st.text(max_size=40) | st.text("IR,PASWVIEKM ohm=TS.0123456789-", max_size=60))
def test_whatever_it_answers_only_values_come_out(text: str) -> None:
    for parse in (parse_report, parse_output):
        with contextlib.suppress(ValueError):
            assert parse(text).voltage >= 0.0
