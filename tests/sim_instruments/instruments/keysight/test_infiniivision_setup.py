"""The oscilloscope's settings all at once, and its screen, as pymeasure's KeysightDSOX1102G asks for them."""

import io
import math
from collections.abc import Callable

import numpy as np
import pytest
import pyvisa
from PIL import Image, ImageColor

from sim_instruments.bench import VirtualBench
from sim_instruments.instruments.keysight.infiniivision.screen import COLOURS
from sim_instruments.instruments.oscilloscope import pulse

Session = pyvisa.resources.MessageBasedResource
SETTINGS = (
    ":CHAN1:PROB 10;SCAL 5;OFFS 2",
    ":CHAN2:DISP 1;COUP AC;INV 1;LAB 'EMF'",
    ":TIM:RANG 0.01;POS 1E-3;REF LEFT",
    ":TRIG:SOUR CHAN2;LEV 0.5;SLOP NEG;:TRIG:HOLD 1E-3",
    ":ACQ:TYPE AVER;COUN 16",
    ":WAV:SOUR CHAN2;FORM WORD;BYT LSBF;UNS OFF",
)


@pytest.fixture
def scope(visa: Callable[[str], Session]) -> Session:
    session = visa("oscilloscope")
    session.write("*RST;*CLS")
    return session


def no_error(scope: Session) -> bool:
    return scope.query("SYST:ERR?") == '+0,"No error"'


def told(scope: Session) -> list[str]:
    return [scope.query(f":{header}?") for header in ("CHAN1", "CHAN2", "TIM", "TRIG", "ACQ", "WAV:UNS", "WAV:SOUR")]


def test_subsystems_to_the_byte(scope: Session) -> None:
    for message in SETTINGS:
        scope.write(message)
    assert told(scope)[:5] == [
        ":CHAN1:RANG +4.00000000E+01;OFFS +2.00000000E+00;COUP DC;IMP ONEM;DISP 1;BWL 0;INV 0;"
        'LAB "";UNIT VOLT;PROB +1.00000000E+01;PROB:SKEW +0.00000000E+00;STYP SING',
        ":CHAN2:RANG +4.00000000E+01;OFFS +0.00000000E+00;COUP AC;IMP ONEM;DISP 1;BWL 0;INV 1;"
        'LAB "EMF";UNIT VOLT;PROB +1.00000000E+00;PROB:SKEW +0.00000000E+00;STYP SING',
        ":TIM:MODE MAIN;REF LEFT;MAIN:RANG +1.00000000E-02;POS +1.00000000E-03",
        ":TRIG:MODE EDGE;SWE AUTO;NREJ 0;HFR 0;HOLD +1.00000000E-03;"
        ":TRIG:EDGE:SOUR CHAN2;LEV +5.00000000E-01;SLOP NEG;REJ OFF;COUP DC",
        ":ACQ:MODE RTIM;TYPE AVER;COMP +100;COUN +16",
    ]
    scope.write("TRIG:SOUR LINE")
    assert ";:TRIG:EDGE:SOUR LINE;SLOP NEG" in scope.query(":TRIG?")
    assert no_error(scope)


@pytest.mark.parametrize(
    ("message", "error"),
    [
        (":CHAN5?", -114),
        (":TIM? 1", -108),
        (":SYST:SET 3", -104),
        (":SYST:SET #15HELLO", -161),
        ("*RCL 3", -256),
        ("*SAV 10", -222),
    ],
)
def test_what_it_refuses(scope: Session, message: str, error: int) -> None:
    scope.write(message)
    assert int(scope.query("SYST:ERR?").split(",")[0]) == error


@pytest.mark.parametrize("way", ["block", "place", "learnt"])
def test_settings_come_back(scope: Session, way: str) -> None:
    for message in SETTINGS:
        scope.write(message)
    before = told(scope)
    kept = scope.query({"block": ":SYST:SET?", "place": "*SAV 4;*OPC?", "learnt": "*LRN?"}[way])
    scope.write("*RST")
    assert told(scope) != before
    scope.write({"block": f":SYST:SET {kept}", "place": "*RCL 4", "learnt": kept}[way])
    assert told(scope) == before
    assert no_error(scope)


def test_a_label_with_anything_in_it_comes_back(scope: Session) -> None:
    scope.encoding = "latin-1"
    scope.write(""":CHAN1:LAB 'a;"b, é'""")
    kept = scope.query(":SYST:SET?")
    scope.write(f"*RST;:SYST:SET {kept}")
    assert scope.query(":CHAN1:LAB?") == '"a;""b, é"'
    # A set-up within a set-up is refused.
    scope.write(f":SYST:SET #8{len(kept) + 10:08d}:SYST:SET {kept}")
    assert scope.query("SYST:ERR?").startswith("-161,")
    assert no_error(scope)


def test_rejection_is_the_couplings_too(scope: Session) -> None:
    assert scope.query("TRIG:REJ LFR;REJ?;:TRIG:COUP?") == "LFR;LFR"
    assert scope.query("TRIG:EDGE:REJ HFR;REJ?;:TRIG:COUP?;HFR?") == "HFR;DC;1"
    assert scope.query("TRIG:REJ OFF;HFR?;:SYST:PRES;:TRIG:REJ?") == "0;OFF"


def test_points_are_told_before_there_is_a_record(scope: Session) -> None:
    assert scope.query(":STOP;:WAV:POIN?") == "+62500"
    assert no_error(scope)


def screen(scope: Session, query: str) -> Image.Image:
    content = bytes(scope.query_binary_values(query, datatype="B"))
    return Image.open(io.BytesIO(content))


def test_the_screen_is_a_picture_of_the_trace(scope: Session, virtual_bench: VirtualBench) -> None:
    world = virtual_bench.world
    world.attach_voltage_probe(1, "A", "B")
    world.turn_shaft(20.0)
    virtual_bench.clock.sleep(1.0)
    scope.write(":CHAN1:SCAL 1;:TIM:RANG 0.1;:DIG CHAN1")
    picture = screen(scope, ":DISPlay:DATA? png, color")
    assert (picture.format, picture.size) == ("PNG", (800, 480))
    rows = np.flatnonzero((np.asarray(picture) == ImageColor.getrgb(COLOURS[1])).all(axis=2)[25:].any(axis=1)) + 25
    amplitude = math.sqrt(3.0) * 0.08 * 20.0
    # Eight divisions of 1 V are the 459 rows below the heading.
    assert (rows.max() - rows.min()) / 459.0 * 8.0 == pytest.approx(2.0 * amplitude, rel=0.05)
    assert screen(scope, ":DISP:DATA? PNG,GRAY").mode == "L"
    assert [screen(scope, f":DISP:DATA? {form}").format for form in ("BMP", "BMP8bit")] == ["BMP", "BMP"]
    scope.write(":DISP:DATA? JPEG")
    assert int(scope.query("SYST:ERR?").split(",")[0]) == -141


@pytest.mark.parametrize("query", ["FREQ", "PER", "RIS", "FALL", "DUTY", "PHAS", "DEL", "OVER", "PWID"])
def test_a_trace_without_edges_has_no_times(scope: Session, query: str) -> None:
    scope.write(":DIG CHAN1")
    assert float(scope.query(f":MEAS:{query}?")) == 9.9e37
    assert no_error(scope)


def test_phase_between_two_windings(scope: Session, virtual_bench: VirtualBench) -> None:
    world = virtual_bench.world
    world.attach_voltage_probe(1, "A", "B")
    world.attach_voltage_probe(2, "B", "C")
    world.turn_shaft(20.0)
    virtual_bench.clock.sleep(1.0)
    scope.write(":CHAN1:SCAL 1;:CHAN2:SCAL 1;:TIM:RANG 0.3;:DIG CHAN1,CHAN2")
    late = 120.0 / 360.0 * 2.0 * math.pi / (4.0 * 20.0)
    assert abs(float(scope.query(":MEAS:PHAS? CHAN1,CHAN2"))) == pytest.approx(120.0, abs=2.0)
    assert abs(float(scope.query(":MEAS:DEL? CHAN1,CHAN2"))) == pytest.approx(late, rel=0.02)
    assert float(scope.query(":MEAS:PHAS? CHAN1,CHAN1")) == pytest.approx(0.0, abs=1e-6)


def test_levels_and_edges_of_a_trace() -> None:
    ramp = np.linspace(0.0, 1.0, 101)
    signal = np.concatenate([np.zeros(200), ramp, np.ones(299), 1.0 - ramp, np.zeros(299)] * 2)
    assert pulse.base_and_top(signal) == pytest.approx((0.0, 1.0), abs=0.01)
    assert pulse.edge_time(signal, rising=True) == pytest.approx(80.0, abs=1.5)
    assert pulse.edge_time(signal, rising=False) == pytest.approx(80.0, abs=1.5)
    assert pulse.period(signal) == pytest.approx(1000.0, abs=1.0)
    assert pulse.width(signal, positive=True) == pytest.approx(400.0, abs=2.0)
    assert pulse.width(signal, positive=False) == pytest.approx(600.0, abs=2.0)
    assert pulse.duty_cycle(signal) == pytest.approx(40.0, abs=0.3)
    assert pulse.delay(signal, np.roll(signal, 100)) == pytest.approx(100.0, abs=1.0)
    assert pulse.phase(signal, np.roll(signal, 250)) == pytest.approx(90.0, abs=0.5)
    assert pulse.overshoot(np.where(np.arange(len(signal)) == 400, 1.2, signal)) == pytest.approx(20.0, abs=1.5)
    assert pulse.preshoot(np.where(np.arange(len(signal)) == 100, -0.1, signal)) == pytest.approx(10.0, abs=1.5)
    flat = np.zeros(10)
    assert {f(flat) for f in (pulse.period, pulse.duty_cycle, pulse.overshoot, pulse.preshoot)} == {
        pulse.NOT_MEASURABLE
    }
    assert pulse.delay(flat, signal) == pulse.phase(flat, signal) == pulse.NOT_MEASURABLE
    assert pulse.edge_time(flat, rising=True) == pulse.width(flat, positive=True) == pulse.NOT_MEASURABLE
