"""The oscilloscope's :MEASure queries by their bytes."""

import math
from collections.abc import Callable

import pytest
import pyvisa

from sim_instruments.bench import VirtualBench

Session = pyvisa.resources.MessageBasedResource
FREQUENCY, AMPLITUDE, MEAN = 300.0, 2.0, 1.5


@pytest.fixture
def scope(visa: Callable[[str], Session], virtual_bench: VirtualBench, monkeypatch: pytest.MonkeyPatch) -> Session:
    session = visa("oscilloscope")
    session.write("*RST;*CLS;:CHAN1:SCAL 1;:TIM:RANG 0.01;:TRIG:SOUR CHAN1;LEV 1.5;:TRIG:SWE AUTO")
    acquisition = virtual_bench.instrument("oscilloscope").acquisition
    monkeypatch.setattr(acquisition, "_signal", lambda _, times: wave(times))
    monkeypatch.setattr(acquisition, "_hold", lambda *_: Wave())
    session.write("DIG CHAN1")
    assert session.query("*OPC?") == "1"
    return session


def wave(times: "object") -> "object":
    import numpy as np

    return MEAN + AMPLITUDE * np.sin(2.0 * math.pi * FREQUENCY * np.asarray(times))


class Wave:
    def signal(self, channel: int, times: object) -> object:
        return wave(times)


@pytest.mark.parametrize(
    ("query", "value"),
    [
        ("VRMS?", math.hypot(MEAN, AMPLITUDE / math.sqrt(2.0))),
        ("VRMS? DISP", math.hypot(MEAN, AMPLITUDE / math.sqrt(2.0))),
        ("VRMS? CYCL,AC,CHAN1", AMPLITUDE / math.sqrt(2.0)),
        ("VRMS? DISP,AC", AMPLITUDE / math.sqrt(2.0)),
        ("VRMS? AC,CHANNEL1", AMPLITUDE / math.sqrt(2.0)),
        ("VRMS? DISPLAY,DC,CHAN1", math.hypot(MEAN, AMPLITUDE / math.sqrt(2.0))),
        ("VAV? CYCL", MEAN),
        ("VPP? CHAN1", 2.0 * AMPLITUDE),
        ("FREQ? CHAN1", FREQUENCY),
        ("COUN?", FREQUENCY),
        ("PER?", 1.0 / FREQUENCY),
        ("VAMP? CHAN1", 2.0 * AMPLITUDE),
        ("VTOP?", MEAN + AMPLITUDE),
        ("VBAS?", MEAN - AMPLITUDE),
        ("DUTY? CHAN1", 50.0),
        # From 10 % to 90 % of a sine is asin(0.8) to either side of its middle.
        ("RIS?", math.asin(0.8) / (math.pi * FREQUENCY)),
        ("FALL? CHAN1", math.asin(0.8) / (math.pi * FREQUENCY)),
        ("PWID?", 0.5 / FREQUENCY),
        ("NWID? CHAN1", 0.5 / FREQUENCY),
    ],
)
def test_what_is_asked_is_what_is_answered(scope: Session, query: str, value: float) -> None:
    assert float(scope.query(f"MEAS:{query}")) == pytest.approx(value, rel=0.06, abs=0.08 if query[0] == "V" else 0.0)
    assert scope.query("SYST:ERR?") == '+0,"No error"'


@pytest.mark.parametrize(
    ("query", "error"),
    [
        ("VPP? CHAN9", -141),
        ("VPP? DISP", -141),
        ("VRMS? AC,DISP", -141),
        ("VRMS? DISP,AC,CHAN1,CHAN2", -108),
        ("VAV? AC", -141),
        ("VRMS? 1", -104),
        ("FREQ? CHAN1,CHAN2", -108),
    ],
)
def test_what_is_not_its_own_is_refused(scope: Session, query: str, error: int) -> None:
    scope.timeout = 200
    with pytest.raises(pyvisa.VisaIOError):
        scope.query(f"MEAS:{query}")
    assert int(scope.query("SYST:ERR?").split(",")[0]) == error


def test_a_passive_probe_on_fifty_ohms_shows_next_to_nothing(scope: Session) -> None:
    scope.write("CHAN1:PROB 10;SCAL 1;IMP FIFT;:DIG CHAN1")
    assert scope.query("CHAN1:IMP?") == "FIFT"
    assert abs(float(scope.query("MEAS:VAV?"))) < 0.01
    scope.write("CHAN1:IMP ONEM;:DIG CHAN1")
    assert float(scope.query("MEAS:VAV?")) == pytest.approx(MEAN, rel=0.05)


def test_segments_need_a_licence(scope: Session) -> None:
    scope.write("ACQ:MODE SEGM")
    assert scope.query("SYST:ERR?").startswith("-241")
    assert scope.query("ACQ:MODE?") == "RTIM"


def test_a_channel_that_somebody_left_on_halves_memory_and_rate(scope: Session) -> None:
    scope.write("TIM:RANG 8E-3")
    rate, points = float(scope.query("ACQ:SRAT?")), int(scope.query("ACQ:POIN?"))
    scope.write("CHAN2:DISP ON")
    assert float(scope.query("ACQ:SRAT?")) == pytest.approx(0.5 * rate, rel=0.01)
    assert int(scope.query("ACQ:POIN?")) == pytest.approx(0.5 * points, rel=0.01)
