import math
from collections.abc import Callable, Iterator
from types import SimpleNamespace

import numpy as np
import pytest
import pyvisa
from numpy.typing import NDArray

from sim_instruments.bench import VirtualBench
from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.instruments.errors import ScopeErrors
from sim_instruments.instruments.keysight.infiniivision.oscilloscope import KeysightInfiniiVision
from sim_instruments.instruments.oscilloscope.edge import Edge, EdgeFinder
from sim_instruments.transports.visa.library import InProcessVisaLibrary

Session = pyvisa.resources.MessageBasedResource
FloatArray = NDArray[np.float64]
PERFECT = ScopeErrors((0.0,) * 4, (0.0,) * 4, 0.0)
AMPLITUDE, FREQUENCY = 3.0, 50.0
STEP_AT = 7.0


class Signals:
    """A world of four signals: a sine, a step at 7 s, a constant, nothing."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.disturbances = Disturbances()

    def probe_signal(self, channel: int, times: FloatArray) -> FloatArray:
        assert times.max(initial=0.0) <= self.clock.now() + 1e-12
        if channel == 1:
            return AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * times)
        if channel == 2:
            return np.where(times < STEP_AT, 0.0, 1.0 - np.exp(-(times - STEP_AT) / 0.01))
        return np.full_like(times, 2.0 if channel == 3 else 0.0)

    def hold_probes(self, first: float, last: float) -> SimpleNamespace:
        """Hand the signals out for the stretch that was asked for, and for no other time."""
        slack = 1e-9 * (last - first)

        def signal(channel: int, times: FloatArray) -> FloatArray:
            assert first - slack <= times.min() and times.max() <= last + slack  # noqa: PT018
            return Signals.probe_signal(self, channel, times)

        return SimpleNamespace(signal=signal)


@pytest.fixture
def signals() -> Signals:
    return Signals()


@pytest.fixture
def make(signals: Signals) -> Iterator[Callable[..., Session]]:
    opened = []

    def open_scope(errors: ScopeErrors = PERFECT, bits: int = 8) -> Session:
        face = KeysightInfiniiVision(signals, np.random.default_rng(1), errors, bits=bits)  # type: ignore[arg-type]
        library = InProcessVisaLibrary({"TCPIP0::scope::inst0::INSTR": face})
        opened.append(SimpleNamespace(face=face, library=library))
        session = pyvisa.ResourceManager(library).open_resource(
            "TCPIP0::scope::inst0::INSTR", read_termination="\n", write_termination="\n"
        )
        session.write("*CLS")
        return session

    yield open_scope
    for entry in opened:
        entry.library.shut()
        entry.face.close()


@pytest.fixture
def scope(make: Callable[..., Session]) -> Session:
    return make()


def acquire(scope: Session, setup: str) -> None:
    scope.write(f"*RST;:STOP;{setup};:DIG")
    assert scope.query("*OPC?;:SYST:ERR?") == '1;+0,"No error"'


def transfer(scope: Session, channel: int, form: str = "BYTE") -> tuple[FloatArray, FloatArray]:
    scope.write(f":WAV:SOUR CHAN{channel};FORM {form};BYT LSBF;UNS ON")
    preamble = [float(value) for value in scope.query(":WAV:PRE?").split(",")]
    termination, scope.read_termination = scope.read_termination, None
    if form == "ASC":
        scope.write(":WAV:DATA?")
        data = scope.read_raw()
        assert data[:2] == b"#8"
        values = np.array([float(text) for text in data[10:].split(b",")])
    else:
        datatype = "B" if form == "BYTE" else "H"
        codes = scope.query_binary_values(":WAV:DATA?", datatype=datatype, container=np.array, chunk_size=1 << 24)
        values = (codes - preamble[9]) * preamble[7] + preamble[8]
    scope.read_termination = termination
    assert preamble[2] == len(values)
    return (np.arange(len(values)) - preamble[6]) * preamble[4] + preamble[5], values


SINE = ":CHAN1:RANG 8;OFFS 0;:TIM:RANG 0.1;REF CENT;POS 0;:TRIG:SOUR CHAN1;LEV 0;SLOP POS;:TRIG:SWE NORM"


@pytest.mark.parametrize(("form", "resolution"), [("BYTE", 8 / 199), ("WORD", 8 / 199), ("ASC", 8 / 199)])
def test_codes_scale_back_to_the_signal(scope: Session, form: str, resolution: float) -> None:
    acquire(scope, SINE)
    scope.write(":WAV:POIN 1000")
    times, values = transfer(scope, 1, form)
    assert len(values) == 1000
    assert times[0] == pytest.approx(-0.05)
    assert np.median(np.diff(times)) == pytest.approx(1e-4)
    expected = AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * times)
    residual = values - expected
    assert abs(residual.mean()) < 5e-3
    assert residual.std() < 1.2 * math.hypot(resolution / math.sqrt(12.0), 0.02)


def test_the_preamble_to_the_byte(scope: Session) -> None:
    acquire(scope, ":CHAN1:SCAL 1;OFFS 0.5;:TIM:SCAL 0.01;REF LEFT")
    scope.write(":WAV:SOUR CHAN1;FORM BYTE;POIN 500")
    assert scope.query(":WAV:PRE?") == (
        "+0,+0,+500,+1,+2.00000000E-04,-1.00000000E-02,+0,+4.02010050E-02,+5.00000000E-01,+128"
    )
    scope.write(":WAV:FORM WORD")
    assert scope.query(":WAV:PRE?").startswith("+1,+0,+500,")
    assert scope.query(":WAV:YINC?;YOR?;YREF?") == "+1.57035176E-04;+5.00000000E-01;+32768"
    assert scope.query(":WAV:XINC?;XOR?;XREF?") == "+2.00000000E-04;-1.00000000E-02;+0"
    scope.write(":WAV:FORM ASC")
    assert scope.query(":WAV:PRE?").startswith("+4,")


def test_block_header_and_byte_orders(scope: Session) -> None:
    acquire(scope, SINE)
    scope.write(":WAV:POIN 100;FORM WORD;BYT MSBF")
    scope.read_termination = None
    scope.write(":WAV:DATA?")
    big = scope.read_raw()
    assert big[:10] == b"#800000200"
    assert big[-1:] == b"\n"
    assert len(big) == 211
    scope.write(":WAV:BYT LSBF;DATA?")
    little = scope.read_raw()
    assert np.array_equal(np.frombuffer(big[10:-1], ">u2"), np.frombuffer(little[10:-1], "<u2"))
    scope.write(":WAV:UNS OFF;DATA?")
    signed = np.frombuffer(scope.read_raw()[10:-1], "<i2").astype(int)
    assert np.array_equal(signed + 32768, np.frombuffer(little[10:-1], "<u2"))
    scope.write(":WAV:FORM BYTE;DATA?")
    octets = scope.read_raw()
    assert octets[:10] == b"#800000100"
    scope.write(":WAV:YREF?")
    assert scope.read_raw() == b"+0\n"


def test_what_is_off_the_screen_is_clipped(scope: Session) -> None:
    acquire(scope, SINE.replace("RANG 8", "RANG 2"))
    scope.write(":WAV:FORM BYTE;POIN 1000")
    scope.read_termination = None
    scope.write(":WAV:DATA?")
    codes = np.frombuffer(scope.read_raw()[10:-1], "u1")
    assert codes.min() == 1
    assert codes.max() == 255
    assert 0.3 < np.mean((codes == 1) | (codes == 255)) < 0.95


def test_more_bits_are_finer(make: Callable[..., Session]) -> None:
    acquire(make(bits=12), SINE)
    scope = make(bits=12)
    acquire(scope, SINE + ";:ACQ:TYPE HRES")
    scope.write(":WAV:POIN 1000")
    times, values = transfer(scope, 1, "WORD")
    residual = values - AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * times)
    assert residual.std() < 0.008
    assert np.diff(np.unique(values)).min() == pytest.approx(8 / 199 / 16, rel=1e-3)


def test_averaging_quietens(scope: Session) -> None:
    scope.timeout = 10_000
    acquire(scope, SINE + ";:ACQ:TYPE AVER;COUN 64")
    scope.write(":WAV:POIN 1000")
    assert scope.query(":WAV:COUN?;TYPE?") == "+64;AVER"
    times, values = transfer(scope, 1, "WORD")
    residual = values - AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * times)
    assert residual.std() < 0.006


def test_own_errors_show(make: Callable[..., Session]) -> None:
    scope = make(ScopeErrors((0.02, 0.0, 0.0, 0.0), (0.0, 0.0, 0.01, 0.0), 0.0))
    acquire(scope, SINE + ";:CHAN3:DISP ON;RANG 8")
    scope.write(":WAV:POIN 1000")
    times, values = transfer(scope, 1)
    amplitude = 2.0 * np.mean(values * np.sin(2.0 * np.pi * FREQUENCY * times))
    assert amplitude == pytest.approx(1.02 * AMPLITUDE, rel=2e-3)
    assert transfer(scope, 3)[1].mean() == pytest.approx(2.0 + 0.08, abs=0.01)


def test_a_normal_trigger_waits_for_its_edge(scope: Session, signals: Signals) -> None:
    scope.timeout = 20_000
    scope.write("*RST;:STOP;:CHAN2:DISP ON;RANG 2;:TRIG:SOUR CHAN2;LEV 0.5;:TRIG:SWE NORM;:TIM:RANG 0.1;REF LEFT;:SING")
    signals.clock.sleep(1.0)
    assert scope.query(":OPER:COND?;:TER?;:RST?") == "+40;+0;SING"
    assert scope.query("*OPC?") == "1"
    # The level is reached ln 2 time constants after the step, and the record ends 90 ms later.
    crossing = STEP_AT + 0.01 * math.log(2.0)
    assert crossing + 0.09 <= signals.clock.now() < crossing + 0.12
    assert scope.query(":OPER:COND?;:TER?;:TER?;:RST?") == "+0;+1;+0;STOP"
    times, values = transfer(scope, 2, "WORD")
    expected = np.where(times < -(crossing - STEP_AT), 0.0, 1.0 - 0.5 * np.exp(-times / 0.01))
    # The noise at the comparator moves the trigger a little along the edge.
    assert np.abs(values - expected).mean() < 0.02


def test_a_time_out_waiting_for_a_trigger_is_virtual(scope: Session, signals: Signals) -> None:
    scope.timeout = 2000
    scope.write("*RST;:STOP;:TRIG:SOUR CHAN4;LEV 1;:TRIG:SWE NORM;:DIG;*OPC?")
    with pytest.raises(pyvisa.VisaIOError):
        scope.read()
    assert signals.clock.now() == pytest.approx(2.0)
    scope.clear()
    assert scope.query(":OPER:COND?;:SYST:ERR?") == '+0;+0,"No error"'


def test_polling_alone_lets_a_record_end(scope: Session) -> None:
    scope.write(f"*RST;:STOP;{SINE};:SING")
    polls = 0
    while int(scope.query(":OPER:COND?")) & 8:
        polls += 1
        assert polls < 1000
    assert scope.query(":TER?") == "+1"


def test_an_automatic_trigger_comes_by_itself(scope: Session, signals: Signals) -> None:
    scope.write("*RST;:STOP;:TRIG:SOUR CHAN4;LEV 1;:TRIG:SWE AUTO;:TIM:RANG 0.02;:DIG")
    assert scope.query("*OPC?") == "1"
    assert signals.clock.now() < 0.2


def test_a_forced_trigger(scope: Session, signals: Signals) -> None:
    scope.write("*RST;:STOP;:TRIG:SOUR CHAN4;LEV 1;:TRIG:SWE NORM;:TIM:RANG 0.02;:SING")
    signals.clock.sleep(1.0)
    scope.write(":TRIG:FORC")
    assert scope.query("*OPC?;:TER?") == "1;+1"
    assert signals.clock.now() == pytest.approx(1.01, abs=2e-3)


def test_running_shows_the_last_trigger(scope: Session, signals: Signals) -> None:
    scope.write(f"*RST;{SINE};:RUN")
    signals.clock.sleep(3.003)
    assert scope.query(":OPER:COND?")[:2] == "+8" or scope.query(":OPER:COND?") == "+40"
    scope.write(":STOP;:WAV:POIN 1000")
    times, values = transfer(scope, 1)
    assert np.interp(0.0, times, values) == pytest.approx(0.0, abs=0.1)
    assert np.interp(0.005, times, values) == pytest.approx(AMPLITUDE, abs=0.1)


def test_without_a_record_there_is_nothing_to_read(scope: Session) -> None:
    scope.write("*RST;:STOP;:TRIG:SWE NORM;:WAV:PRE?")
    with pytest.raises(pyvisa.VisaIOError):
        scope.read()
    assert scope.query("SYST:ERR?").startswith("-230")


def test_the_same_record_reads_the_same_twice(scope: Session, signals: Signals) -> None:
    acquire(scope, SINE)
    scope.write(":WAV:POIN 1000")
    first = transfer(scope, 1)[1]
    signals.clock.sleep(500.0)
    assert np.array_equal(transfer(scope, 1)[1], first)


def test_an_old_record_is_kept_although_its_past_is_forgotten(scope: Session, signals: Signals) -> None:
    acquire(scope, SINE)
    signals.clock.sleep(500.0)
    signals.probe_signal = None  # type: ignore[assignment]
    scope.write(":WAV:POIN 1000")
    times, values = transfer(scope, 1)
    assert np.abs(values - AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * times)).mean() < 0.05


def test_a_million_points(scope: Session) -> None:
    acquire(scope, SINE)
    scope.write(":WAV:POIN:MODE RAW;:WAV:POIN 1000000")
    times, values = transfer(scope, 1, "WORD")
    assert len(values) == 1_000_000
    assert times[-1] == pytest.approx(0.05, abs=1e-6)
    scope.write(":WAV:POIN:MODE NORM")
    assert scope.query(":WAV:POIN?") == "+62500"


def test_memory_and_sample_rate(scope: Session) -> None:
    scope.write("*RST;:TIM:RANG 0.1")
    assert scope.query(":ACQ:SRAT?;POIN?") == "+2.50000000E+07;+2500000"
    scope.write(":TIM:RANG 1E-6")
    assert scope.query(":ACQ:SRAT?") == "+5.00000000E+09"
    scope.write(":CHAN2:DISP ON")
    assert scope.query(":ACQ:SRAT?") == "+2.50000000E+09"


@pytest.mark.parametrize(
    ("message", "reply"),
    [
        (":CHANnel1:SCALe 0.5;RANGe?", "+4.00000000E+00"),
        (":CHAN1:RANG 16V;SCAL?", "+2.00000000E+00"),
        (":CHAN4:PROB 10;:CHAN4:UNIT AMP;SCAL 2A;UNIT?", "AMP"),
        (":CHAN1:PROB 10;SCAL?", "+5.00000000E+01"),
        (":CHAN2:OFFS -1.5;OFFS?", "-1.50000000E+00"),
        (":CHAN3:DISP?;COUP?;BWL?", "0;DC;0"),
        (":TIM:SCAL 1ms;RANG?;POS?;REF?", "+1.00000000E-02;+0.00000000E+00;CENT"),
        (":TRIG:MODE?;SWE?;:TRIG:SOUR?;SLOP?", "EDGE;AUTO;CHAN1;POS"),
        (":TRIG:EDGE:SOUR CHAN2;LEV 1;LEV? CHAN2", "+1.00000000E+00"),
        (":TRIG:LEV 0.5,CHAN3;:TRIG:LEV? CHAN3", "+5.00000000E-01"),
        (":ACQ:TYPE HRES;TYPE?;COUN?", "HRES;+8"),
        (":WAV:SOUR CHANNEL2;SOUR?;POIN:MODE?", "CHAN2;NORM"),
    ],
)
def test_settings(scope: Session, message: str, reply: str) -> None:
    scope.write("*RST")
    assert scope.query(message) == reply
    assert scope.query("SYST:ERR?") == '+0,"No error"'


@pytest.mark.parametrize(
    ("message", "error"),
    [
        (":CHAN1:SCAL 5.1", -222),
        (":CHAN5:SCAL 1", -114),
        (":CHAN1:SCAL 1A", -131),
        (":TIM:RANG 1000", -222),
        (":TRIG:LEV 1000", -222),
        (":TRIG:SOUR CHAN9", -141),
        (":WAV:FORM REAL", -141),
        (":WAV:POIN 10", -222),
    ],
)
def test_refusals(scope: Session, message: str, error: int) -> None:
    scope.write("*RST")
    scope.write(message)
    assert int(scope.query("SYST:ERR?").split(",")[0]) == error


def test_measurements(scope: Session) -> None:
    acquire(scope, SINE)
    assert float(scope.query(":MEAS:FREQ? CHAN1")) == pytest.approx(FREQUENCY, rel=2e-3)
    assert float(scope.query(":MEAS:VPP? CHAN1")) == pytest.approx(2 * AMPLITUDE, rel=0.05)
    assert float(scope.query(":MEAS:SOUR CHAN1;VRMS?")) == pytest.approx(AMPLITUDE / math.sqrt(2.0), rel=5e-3)


@pytest.mark.parametrize("slope", ["POS", "NEG", "EITH"])
def test_crossings_are_exact(slope: str) -> None:
    phase = 0.3

    def signal(times: FloatArray) -> FloatArray:
        return np.sin(2.0 * np.pi * 10.0 * times + phase)

    finder = EdgeFinder(signal, Edge(0.25, slope, 0.05), 0.0, 1e-3)  # type: ignore[arg-type]
    rising = (math.asin(0.25) - phase) / (2.0 * math.pi * 10.0) + 0.1
    falling = (math.pi - math.asin(0.25) - phase) / (2.0 * math.pi * 10.0)
    wanted = {"POS": rising, "NEG": falling, "EITH": falling}[slope]
    found = None
    for until in np.arange(0.01, 0.3, 0.01):
        found = finder.first(float(until), 0.0)
        if found is not None:
            break
    assert found == pytest.approx(wanted, abs=1e-8)


def test_a_single_shot_that_nobody_fetches_is_taken_before_its_time_is_forgotten(
    virtual_bench: VirtualBench, visa: Callable[[str], Session]
) -> None:
    scope, supply = visa("oscilloscope"), visa("supply")
    scope.write("*RST;:STOP;:TRIG:SOUR EXT;:TRIG:SWE AUTO;:SING")
    for switched in ("ON", "OFF") * 4:
        virtual_bench.clock.sleep(100.0)
        supply.write(f"OUTP {switched},(@1)")
    assert scope.query(":CHAN1:IMP ONEM;:RST?;:SYST:ERR?").startswith("STOP;+0")


def test_a_step_of_the_bench_is_caught(virtual_bench: VirtualBench, visa: Callable[[str], Session]) -> None:
    world, scope, supply = virtual_bench.world, visa("oscilloscope"), visa("supply")
    world.lock_rotor()
    world.connect({"A": "supply+", "B": "supply-", "C": "supply-"})
    world.attach_current_probe(4, "A")
    supply.write("APPL CH1,1,10")
    scope.write("*RST;:STOP;:CHAN4:DISP ON;UNIT AMP;PROB 10;RANG 2.4;OFFS 0.6;:TIM:RANG 0.02;REF LEFT")
    scope.write(":TRIG:SOUR CHAN4;LEV 0.2;:TRIG:SWE NORM;:SING")
    virtual_bench.clock.sleep(0.5)
    supply.write("OUTP ON,(@1)")
    assert scope.query("*OPC?") == "1"
    times, values = transfer(scope, 4, "WORD")
    assert np.interp(0.0, times[:], values) == pytest.approx(0.2, abs=0.05)
    assert abs(values[times < -1.5e-3].mean()) < 0.01
    assert values[-1000:].mean() == pytest.approx(world.truth()["supply_current"], rel=0.01)
