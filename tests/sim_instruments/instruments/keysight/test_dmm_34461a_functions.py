import math
from collections.abc import Callable

import pytest
import pyvisa

from sim_instruments.bench import VirtualBench
from sim_instruments.instruments.keysight.dmm_34461a.temperature import NONE, rtd_temperature, thermistor_temperature
from sim_instruments.physics.motor.motor import VirtualMotor
from tests.sim_instruments.motors import BENCH_MOTOR

Session = pyvisa.resources.MessageBasedResource
#: Both test leads of a two-wire measurement.
LEADS = 0.06
OVERLOAD = 9.9e37


@pytest.fixture
def meter(visa: Callable[[str], Session]) -> Session:
    session = visa("voltmeter")
    session.timeout = 20_000
    session.write("*RST;*CLS")
    return session


@pytest.fixture
def on_motor(meter: Session, virtual_bench: VirtualBench) -> Session:
    virtual_bench.world.attach_voltmeter("A", "B")
    return meter


def spinning(bench: VirtualBench, speed: float = 20.0 * math.pi) -> float:
    """Turn the shaft (rad/s) and return the RMS (V) of the line-to-line EMF."""
    bench.world.turn_shaft(speed)
    bench.clock.sleep(5.0)
    return math.sqrt(3.0) * BENCH_MOTOR.back_emf_constant_mechanical * speed / math.sqrt(2.0)


@pytest.mark.parametrize(
    ("message", "reply"),
    [
        # As pymeasure's HP34401A and qcodes' Keysight34461A send them.
        ('FUNC "RES";:FUNC?', '"RES"'),
        ('SENSe:FUNCtion "VOLT:AC";:SENSe:FUNCtion?', '"VOLT:AC"'),
        ("FUNC 'frequency';:FUNC?", '"FREQ"'),
        ("RES:RANG 1000;:RES:RANG?;RANG:AUTO?", "+1.00000000E+03;0"),
        ("SENSe:CURR:RANGe:AUTO OFF;:SENSe:CURR:RANGe:AUTO?", "0"),
        ("FREQ:VOLT:RANG 1;RANG?", "+1.00000000E+00"),
        ("FREQ:APER 0.5;APER?;:PER:APER?", "+1.00000000E+00;+1.00000000E+00"),
        # What CONFigure says of a frequency is the frequency, not the voltage.
        ("CONF:FREQ 50,5E-4;:FREQ:APER?;VOLT:RANG:AUTO?", "+1.00000000E-01;1"),
        ("CONF:PER DEF,MIN;:PER:APER?;:CONF:FREQ 1E3,1;:FREQ:APER?", "+1.00000000E+00;+1.00000000E-02"),
        ("VOLT:AC:BAND 50;BAND?", "+2.00000000E+01"),
        ("RES:NPLC 1;:FRES:NPLC?", "+1.00000000E+00"),
        ("RES:RANG 1E3;RES 1E-3;RES?;NPLC?", "+1.00000000E-03;+1.00000000E+01"),
        ("CONF:CURR:DC 10;:CURR:TERM?;RANG?", "+10;+1.00000000E+01"),
        ("CURR:AC:TERM 3;TERM?", "+3"),
        ("CONF:RES 100,1E-3;:CONF?", '"RES +1.000000E+02,+1.000000E-03"'),
        ("CONF:DIOD;:CONF?", '"DIOD"'),
        ("CONF:TEMP THER,5000;:TEMP:TRAN:TYPE?;:UNIT:TEMP K;TEMP?", "THER;K"),
        ("TEMP:TRAN:FRTD:RES 1000;RES:REF?", "+1.00000000E+03"),
        ("TRIG:DEL 0.1;DEL:AUTO?;AUTO ON;:TRIG:DEL?", "0;+0.00000000E+00"),
        ("TRIG:SLOP POS;SLOP?", "POS"),
        ('DISPLAY:TEXT "Acquiring";:DISPLAY:TEXT?;:DISPlay:TEXT:CLEar;DATA?', '"Acquiring";""'),
        ("ROUT:TERM?;:SYST:LFR?", "FRON;+50"),
    ],
)
def test_replies_to_the_byte(meter: Session, message: str, reply: str) -> None:
    assert meter.query(message) == reply
    assert meter.query("SYST:ERR?") == '+0,"No error"'


@pytest.mark.parametrize(
    ("query", "reading"),
    [
        ("MEAS:RES? DEF,DEF", OVERLOAD),
        ("MEAS:FRES? DEF,DEF", OVERLOAD),
        ("MEAS:TEMP?", OVERLOAD),
        ("MEAS:CONT?", OVERLOAD),
        ("MEAS:DIOD?", 9.8e37),
        ("MEAS:VOLT:AC? DEF,DEF", 0.0),
        ("MEAS:CURR:DC? DEF,DEF", 0.0),
        ("MEAS:CURR:AC? DEF,DEF", 0.0),
        ("MEAS:FREQ?", 0.0),
        ("MEAS:PER?", 0.0),
    ],
)
def test_with_its_leads_on_nothing(meter: Session, query: str, reading: float) -> None:
    assert float(meter.query(query)) == pytest.approx(reading, rel=1e-9, abs=5e-5)


def test_two_and_four_wires(on_motor: Session, virtual_bench: VirtualBench) -> None:
    virtual_bench.world.connect({"A": "supply+", "B": "supply-"})
    assert float(on_motor.query("MEAS:FRES? DEF,DEF")) == pytest.approx(1.0, abs=1e-3)
    assert float(on_motor.query("MEAS:RES? DEF,DEF")) == pytest.approx(1.0 + LEADS, abs=1e-3)
    assert float(on_motor.query("MEAS:CONT?")) == pytest.approx(1.0 + LEADS, abs=0.05)
    assert float(on_motor.query("MEAS:DIOD?")) == pytest.approx((1.0 + LEADS) * 1e-3, abs=3e-4)
    # No sensor has so little.
    assert float(on_motor.query("MEAS:TEMP? RTD,85")) == OVERLOAD
    assert on_motor.query("STAT:QUES?") == "+512"
    on_motor.write("CONF:FRES 100;:FRES:NULL:VAL:AUTO ON;:FRES:NULL ON")
    assert float(on_motor.query("READ?")) == 0.0
    assert float(on_motor.query("FRES:NULL:VAL?")) == pytest.approx(1.0, abs=1e-3)


def test_a_third_terminal_joined_is_in_parallel(on_motor: Session, virtual_bench: VirtualBench) -> None:
    virtual_bench.world.connect({"A": "supply+", "C": "supply+"})
    # Half an ohm and four milliohms of wire, beside half an ohm, and another half in series.
    parallel = 1.0 / (1.0 / 0.5 + 1.0 / 0.504)
    assert float(on_motor.query("MEAS:FRES?")) == pytest.approx(0.5 + parallel, abs=1e-3)
    virtual_bench.world.connect({"A": "lcr_high", "B": "lcr_low"})
    assert float(on_motor.query("MEAS:FRES?")) == pytest.approx(1.0 / (1.0 + 1.0 / 100.004), abs=1e-3)
    virtual_bench.world.set_open_phase("B")
    virtual_bench.world.connect({})
    assert float(on_motor.query("MEAS:FRES?")) == pytest.approx(1.0, abs=1e-3)


def test_delta_windings() -> None:
    motor = VirtualMotor(**{**vars(BENCH_MOTOR), "connection": "delta"})
    with VirtualBench(motor, seed=1) as bench:
        bench.world.attach_voltmeter("A", "B")
        assert bench.world.voltmeter_resistance(0.0)[0] == pytest.approx(1.0 / 3.0)
        bench.world.attach_voltmeter("S+", "S-")
        assert bench.world.voltmeter_resistance(0.0)[0] == math.inf
        bench.world.connect({"A": "supply+", "B": "supply-"})
        assert bench.world.voltmeter_resistance(0.0)[0] == pytest.approx(1.0 / 3.0 + 0.004)
        bench.world.supply.switch(True)
        assert bench.world.voltmeter_resistance(0.0)[0] < 0.01


def test_a_voltage_that_is_there_counts_as_the_test_currents(on_motor: Session, virtual_bench: VirtualBench) -> None:
    world = virtual_bench.world
    world.lock_rotor()
    world.connect({"A": "supply+", "B": "supply-"})
    world.supply.set_voltage(6.0)
    world.supply.set_current_limit(0.02)
    world.supply.switch(True)
    virtual_bench.clock.sleep(0.5)
    # 20 mV at 1 mA are 20 Ω beside the windings' own.
    assert float(on_motor.query("CONF:FRES 100;:READ?")) == pytest.approx(21.0, rel=1e-2)
    world.supply.set_current_limit(1.0)
    virtual_bench.clock.sleep(0.5)
    assert float(on_motor.query("READ?")) == OVERLOAD


def test_the_emf_of_a_turning_shaft(on_motor: Session, virtual_bench: VirtualBench) -> None:
    rms = spinning(virtual_bench)
    assert float(on_motor.query("MEAS:VOLT:AC? DEF,DEF")) == pytest.approx(rms, rel=2e-3)
    # Ten turns a second of four pole pairs.
    assert float(on_motor.query("MEAS:FREQ?")) == pytest.approx(40.0, rel=1e-3)
    assert float(on_motor.query("MEAS:FREQ? 40,1E-3")) == pytest.approx(40.0, rel=1e-3)
    assert float(on_motor.query("MEAS:PER?")) == pytest.approx(0.025, rel=1e-3)
    assert float(on_motor.query("MEAS:VOLT:AC? 0.1")) == OVERLOAD
    # Whole periods have no mean, and yet no resistance can be seen beside them.
    assert float(on_motor.query("MEAS:RES? DEF,DEF")) == float(on_motor.query("MEAS:FRES?")) == OVERLOAD
    before = virtual_bench.clock.now()
    on_motor.query("CONF:VOLT:AC;:VOLT:AC:BAND 3;:READ?")
    assert virtual_bench.clock.now() - before == pytest.approx(2.5)


def test_a_mean_beside_peaks_beyond_the_range_is_none(on_motor: Session, virtual_bench: VirtualBench) -> None:
    spinning(virtual_bench)
    assert abs(float(on_motor.query("MEAS:VOLT:DC? 1"))) == OVERLOAD
    assert abs(float(on_motor.query("MEAS:VOLT:DC? 10"))) < 0.01
    # Autoranging goes by the peaks, too.
    assert abs(float(on_motor.query("MEAS:VOLT:DC?"))) < 0.01
    assert on_motor.query("VOLT:RANG?") == "+1.00000000E+01"


@pytest.mark.parametrize("speed", [400.0, 1234.5])
def test_no_speed_falls_in_step_with_the_sampling(on_motor: Session, virtual_bench: VirtualBench, speed: float) -> None:
    rms = spinning(virtual_bench, speed)
    assert float(on_motor.query("MEAS:VOLT:AC?")) == pytest.approx(rms, rel=3e-3)
    assert float(on_motor.query("MEAS:FREQ?")) == pytest.approx(4.0 * speed / (2.0 * math.pi), rel=1e-3)


def test_temperature_of_sensors() -> None:
    assert rtd_temperature(138.5055, 100.0) == pytest.approx(100.0, abs=1e-3)
    assert rtd_temperature(60.2558, 100.0) == pytest.approx(-100.0, abs=1e-3)
    assert rtd_temperature(10.0, 100.0) == NONE
    assert thermistor_temperature(5000.0) == pytest.approx(25.0, abs=0.02)
    assert thermistor_temperature(1.0) == thermistor_temperature(math.inf) == NONE
