import math
from collections.abc import Callable

import numpy as np
import pytest
import pyvisa

from sim_instruments.bench import VirtualBench
from sim_instruments.instruments.errors import Errors, VoltmeterErrors
from sim_instruments.instruments.keysight.dmm_34461a import conversion
from sim_instruments.instruments.keysight.dmm_34461a.functions import VOLT_DC
from sim_instruments.instruments.keysight.dmm_34461a.multimeter import Keysight34461A
from sim_instruments.physics.motor.motor import VirtualMotor

Session = pyvisa.resources.MessageBasedResource
FLAWLESS = VoltmeterErrors((0.0,) * 5, (0.0,) * 5)
#: One year's limits by range: of reading, of range.
LIMITS = {0.1: (50e-6, 35e-6), 1.0: (40e-6, 7e-6), 10.0: (35e-6, 5e-6), 100.0: (45e-6, 6e-6), 1000.0: (45e-6, 10e-6)}


@pytest.fixture
def meter(visa: Callable[[str], Session], virtual_bench: VirtualBench) -> Session:
    virtual_bench.world.attach_voltmeter("A", "B")
    session = visa("voltmeter")
    session.timeout = 20_000
    session.write("*RST;*CLS")
    return session


@pytest.fixture
def fed(meter: Session, virtual_bench: VirtualBench) -> Session:
    feed(virtual_bench, 1.0)
    return meter


def feed(bench: VirtualBench, current: float) -> None:
    """Drive a current (A) through windings A and B, 1 Ω together, and let the supply settle."""
    world = bench.world
    world.lock_rotor()
    world.connect({"A": "supply+", "B": "supply-"})
    world.supply.set_voltage(6.0)
    world.supply.set_current_limit(current)
    world.supply.switch(True)
    bench.clock.sleep(0.2)


def first_error(meter: Session) -> int:
    return int(meter.query("SYST:ERR?").split(",")[0])


@pytest.mark.parametrize(
    ("message", "reply"),
    [
        ("*IDN?", "Keysight Technologies,34461A,MY57201234,A.03.00-02.40-03.00-00.52-04-02"),
        ("CONF?", '"VOLT +1.000000E+01,+1.000000E-05"'),
        ("CONF:VOLT:DC 0.1;:CONF?", '"VOLT +1.000000E-01,+1.000000E-07"'),
        ("CONFigure:VOLTage:DC 1,0.001;:CONF?;:VOLT:NPLC?", '"VOLT +1.000000E+00,+1.000000E-04";+2.00000000E-02'),
        ("CONF:DC 1,1E-6;:VOLT:DC:NPLC?", "+1.00000000E+01"),
        ("CONF:VOLT:DC 1,0.0001;:VOLT:ZERO:AUTO?", "0"),
        ("VOLT:DC:NPLC 10;:VOLT:DC:NPLC?", "+1.00000000E+01"),
        (":SENSe:VOLTage:DC:NPLCycles 5;NPLC?", "+1.00000000E+01"),
        ("VOLT:NPLC? MIN;NPLC? MAX", "+2.00000000E-02;+1.00000000E+02"),
        ("VOLT:DC:RANG 0.25;RANG?;RANG:AUTO?", "+1.00000000E+00;0"),
        ("VOLT:DC:RANG 100 MV;RANG?", "+1.00000000E-01"),
        ("VOLT:RANG:UPP MAX;UPP?", "+1.00000000E+03"),
        ("VOLT:DC:RANG:AUTO OFF;AUTO?", "0"),
        ("VOLT:RANG 10;:VOLT:RES 3E-5;RES?", "+3.00000000E-05"),
        ("INP:IMP:AUTO ON;AUTO?", "1"),
        ("INP:IMP:AUTO ON;:VOLT:IMP:AUTO?", "1"),
        ("TRIG:SOUR BUS;SOUR?", "BUS"),
        ("TRIG:DEL 0.5;DEL?;:TRIG:COUN 3;COUN?", "+5.00000000E-01;+3"),
        ("SAMP:COUN 10;COUN?", "+10"),
        ("FUNC 'VOLT:DC';:FUNC?", '"VOLT"'),
        ("VOLT:ZERO:AUTO ONCE;AUTO?", "0"),
        ("DATA:POIN?", "+0"),
        ("SYST:VERS?", "1994.0"),
    ],
)
def test_replies_to_the_byte(meter: Session, message: str, reply: str) -> None:
    assert meter.query(message) == reply
    assert meter.query("SYST:ERR?") == '+0,"No error"'


@pytest.mark.parametrize(
    ("command", "error"),
    [
        ("VOLT:DC:NPLC 0.01", -222),
        ("VOLT:DC:NPLC 101", -222),
        ("VOLT:DC:RANG 1200", -222),
        ("CONF:VOLT:DC AUTO,1E-6", -221),
        ("CONF:VOLT:DC 1,1E-8", -222),
        ("VOLT:DC:RES 1E-6", -221),
        ("TRIG:SOUR INT", -224),
        ("SAMP:COUN 0", -222),
        ("FUNC 'CAP'", -224),
        ("FUNC 'VOLT:DC:RAT'", -224),
        ("*TRG", -211),
        ("TRIG:SOUR BUS;:READ?", -214),
        ("FETC?", -230),
        ("CONF", -113),
        ("MEAS:CAP?", -113),
        ("CONF:VOLT:DC:RAT", -113),
        ("MEAS:RES? 2E8", -222),
        ("CONF:RES AUTO,1E-3", -221),
        ("CONF:CURR:DC 11", -222),
        ("CURR:RANG 10", -222),
        ("CURR:TERM 5", -224),
        ("CONF:CONT 1", -108),
        ("CONF:TEMP THER,85", -222),
        ("CONF:TEMP TC,K", -224),
        ("CONF:TEMP FRTD,85,1,0.1", -224),
        ("VOLT:AC:NPLC 1", -113),
        ("VOLT:AC:BAND 1", -222),
        ("CONT:RANG 100", -113),
        ("DIOD:NULL ON", -113),
        ("FREQ:APER 5", -222),
        ("TRIG:COUN INF", -224),
        ("CONF:TEMP;:CONF?", -221),
        ("CONF:FREQ;:CONF?", -221),
        ("CONF:FREQ 1E6", -222),
        ("VOLT:DC:RANG? MIN,MAX", -108),
        ("READ? 1", -108),
        ("ABOR 0", -108),
        ("CONF? 1", -108),
    ],
)
def test_what_it_refuses(meter: Session, command: str, error: int) -> None:
    meter.write(command)
    assert first_error(meter) == error


@pytest.mark.parametrize("refused", ["CONF:CAP", "CONF:VOLT:DC:RAT 1", "FUNC 'CAP'", "MEAS:CAP?"])
@pytest.mark.parametrize("again", ["CONF:VOLT:DC 10", "FUNC 'VOLT'", "*RST"])
def test_no_figure_after_a_refused_function(fed: Session, refused: str, again: str) -> None:
    assert float(fed.query("READ?")) == pytest.approx(1.0, abs=1e-3)
    fed.write(refused)
    fed.timeout = 500
    for query, error in (("FETC?", -230), ("READ?", -221)):
        fed.write("*CLS")
        with pytest.raises(pyvisa.VisaIOError):
            fed.query(query)
        assert first_error(fed) == error
    fed.write("*CLS")
    fed.write("INIT")
    assert first_error(fed) == -221
    fed.timeout = 20_000
    fed.write(f"*CLS;{again}")
    assert float(fed.query("READ?")) == pytest.approx(1.0, abs=1e-3)


def test_a_reading_to_the_byte(virtual_bench: VirtualBench) -> None:
    class Steady(np.random.Generator):
        def normal(self, loc: object = 0.0, scale: object = 1.0, size: object = None) -> float:  # type: ignore[override]
            return 0.0

    unit = Keysight34461A(virtual_bench.world, Steady(np.random.PCG64(0)), FLAWLESS)
    unit.write(b"READ?\n")
    assert unit.read(100, 1.0)[0] == b"+0.00000000E+00\n"
    virtual_bench.world.attach_voltmeter("B", "A")
    feed(virtual_bench, 1.0)
    unit.write(b"CONF:VOLT:DC 1;:READ?\n")
    assert unit.read(100, 1.0)[0] == b"-1.00000000E+00\n"
    unit.write(b"CONF:VOLT:DC 0.1;:READ?\n")
    assert unit.read(100, 1.0)[0] == b"-9.90000000E+37\n"


def test_kelvin_leads_leave_the_clamps_out(fed: Session, virtual_bench: VirtualBench) -> None:
    fed.write("CONF:VOLT:DC 1")
    current = virtual_bench.world.supply.current(0.0)
    assert float(fed.query("READ?")) / current == pytest.approx(1.0, abs=12e-6)
    # The supply's own terminals see the two leads of 2 mΩ as well.
    assert virtual_bench.world.supply.voltage(0.1) / current == pytest.approx(1.004, abs=1e-6)


@pytest.mark.parametrize(
    ("setting", "seconds"),
    [
        ("VOLT:NPLC 10", 0.4),
        ("VOLT:NPLC 10;:VOLT:ZERO:AUTO OFF", 0.2),
        ("VOLT:NPLC 100;:VOLT:ZERO:AUTO OFF", 2.0),
        ("VOLT:NPLC 0.2;:VOLT:ZERO:AUTO OFF;:SAMP:COUN 5", 0.02),
        ("VOLT:NPLC 1;:SAMP:COUN 3;:TRIG:COUN 2;DEL 0.01", 0.3),
    ],
)
def test_integration_takes_bench_time(fed: Session, virtual_bench: VirtualBench, setting: str, seconds: float) -> None:
    fed.write(setting)
    before = virtual_bench.clock.now()
    fed.query("READ?")
    assert virtual_bench.clock.now() - before == pytest.approx(seconds)


def test_a_reading_is_the_mean_over_its_own_integration(virtual_bench: VirtualBench, meter: Session) -> None:
    feed(virtual_bench, 1.0)
    meter.write("CONF:VOLT:DC 10;:VOLT:DC:ZERO:AUTO OFF;:SAMP:COUN 2;:INIT")
    virtual_bench.clock.sleep(0.3)
    virtual_bench.world.supply.set_current_limit(0.5)
    virtual_bench.clock.sleep(5.0)
    first, second = map(float, meter.query("FETC?").split(","))
    assert first == pytest.approx(1.0, abs=1e-3)
    assert second == pytest.approx(0.75, abs=0.02)
    assert meter.query("FETC?") == f"{first:+.8E},{second:+.8E}"
    assert meter.query("DATA:POIN?") == "+2"


def test_triggers_of_the_bus(fed: Session) -> None:
    fed.write("CONF:VOLT:DC 1;:TRIG:SOUR BUS;COUN 2;:SAMP:COUN 2;:INIT")
    assert int(fed.query("STAT:OPER:COND?")) == 0x20
    fed.write("*TRG")
    assert int(fed.query("STAT:OPER:COND?")) == 0x10
    fed.write("*TRG")
    assert first_error(fed) == -211
    assert fed.query("*OPC?;:DATA:POIN?") == "1;+2"
    fed.write("INIT")
    assert first_error(fed) == -213
    fed.write("*TRG")
    assert len(fed.query("FETC?").split(",")) == 4
    fed.write("INIT;:ABOR;:INIT;*TRG")
    assert fed.query("SYST:ERR?") == '+0,"No error"'


def test_autoranging(meter: Session, virtual_bench: VirtualBench) -> None:
    for current, full_scale in ((0.05, 0.1), (0.115, 0.1), (0.125, 1.0), (5.0, 10.0), (1.1, 10.0), (0.5, 1.0)):
        feed(virtual_bench, current)
        assert float(meter.query("READ?")) == pytest.approx(current, rel=1e-3)
        assert float(meter.query("VOLT:DC:RANG?")) == full_scale
    feed(virtual_bench, 0.05)
    meter.write("VOLT:DC:RANG:AUTO ONCE")
    assert meter.query("VOLT:DC:RANG?;RANG:AUTO?") == "+1.00000000E-01;0"


def test_overload_is_latched(fed: Session) -> None:
    fed.write("CONF:VOLT:DC 0.1")
    assert fed.query("STAT:QUES?") == "+0"
    assert fed.query("READ?") == "+9.90000000E+37"
    assert fed.query("STAT:QUES?;QUES?") == "+1;+0"
    assert float(fed.query("MEAS:VOLT:DC?")) == pytest.approx(1.0, abs=1e-3)


def test_new_settings_forget_the_readings(fed: Session) -> None:
    fed.query("READ?")
    fed.write("VOLT:DC:NPLC 1;:FETC?")
    assert first_error(fed) == -230


def test_readings_that_the_bench_no_longer_knows_are_stale(meter: Session, virtual_bench: VirtualBench) -> None:
    meter.write("INIT")
    for number in range(4):
        virtual_bench.clock.sleep(400.0)
        virtual_bench.world.connect(
            {"A": "supply+", "B": "supply-"} if number % 2 else {"A": "lcr_high", "B": "lcr_low"}
        )
    meter.write("FETC?")
    assert first_error(meter) == -230


def test_noise_falls_with_integration(meter: Session) -> None:
    spread = []
    for cycles in ("0.2", "10"):
        meter.write(f"CONF:VOLT:DC 0.1;:VOLT:DC:NPLC {cycles};:SAMP:COUN 200")
        meter.timeout = 200_000
        spread.append(np.std([float(part) for part in meter.query("READ?").split(",")]))
    assert spread[1] == pytest.approx(0.3e-7, rel=0.3)
    assert spread[0] == pytest.approx(10.0 * spread[1], rel=0.4)


def test_units_stay_within_the_data_sheet() -> None:
    generator = np.random.default_rng(5)
    worst = dict.fromkeys(LIMITS, 0.0)
    for _ in range(200):
        unit = Errors.drawn(generator).voltmeter
        for full_scale, (gain, offset) in LIMITS.items():
            voltage = float(generator.uniform(-full_scale, full_scale))
            reading = conversion.convert(voltage, VOLT_DC, full_scale, conversion.RESOLUTIONS[100.0], unit, generator)
            limit = gain * abs(voltage) + offset * full_scale
            worst[full_scale] = max(worst[full_scale], abs(reading - voltage) / limit)
    assert all(0.6 < share < 1.2 for share in worst.values())
    healthy = VoltmeterErrors()
    for index, (gain, offset) in enumerate(LIMITS.values()):
        assert abs(healthy.gain[index]) <= 0.11 * gain
        assert abs(healthy.offset[index]) <= 0.11 * offset


def test_world_knows_its_voltmeter(virtual_bench: VirtualBench) -> None:
    world, clock = virtual_bench.world, virtual_bench.clock
    truth = set(world.truth())
    assert world.voltmeter_voltage(0.1) == 0.0
    world.attach_voltmeter("A", "B")
    feed(virtual_bench, 1.0)
    assert world.voltmeter_voltage(0.0) == pytest.approx(1.0)
    world.attach_voltmeter("C", "B")
    assert world.voltmeter_voltage(0.01) == pytest.approx(0.5)
    assert world.voltmeter_voltage(0.0, -1.0) == 0.0
    world.set_swapped(("C", "B"))
    clock.sleep(0.1)
    assert world.voltmeter_voltage(0.01) == pytest.approx(0.5)
    assert set(world.truth()) == truth
    with pytest.raises(ValueError, match="still to come"):
        world.voltmeter_voltage(0.1, clock.now() + 1.0)
    with pytest.raises(ValueError, match="not A twice"):
        world.attach_voltmeter("A", "A")
    with pytest.raises(ValueError, match="'N' is unknown"):
        world.attach_voltmeter("N", "A")  # type: ignore[arg-type]
    world.detach_voltmeter()
    assert world.voltmeter_voltage(0.01) == 0.0


def test_the_emf_of_a_turning_shaft_averages_out(bench_motor: VirtualMotor) -> None:
    with VirtualBench(bench_motor) as bench:
        bench.world.attach_voltmeter("A", "B")
        bench.world.turn_shaft(2.0 * math.pi)
        bench.clock.sleep(3.0)
        # Four pole pairs at one turn a second: 0.25 s is a whole period of the EMF.
        assert bench.world.voltmeter_voltage(0.25) == pytest.approx(0.0, abs=1e-9)
        amplitude = math.sqrt(3.0) * bench_motor.back_emf_constant_mechanical * 2.0 * math.pi
        values = [bench.world.voltmeter_voltage(0.0, 2.0 + k / 400.0) for k in range(100)]
        assert max(values) == pytest.approx(amplitude, rel=1e-3)


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("VOLT:NULL:VAL 0.25;STAT ON", 0.75),
        ("VOLT:DC:NULL:VAL:AUTO ON;:VOLT:NULL:STAT ON", 0.0),
        ("CALC:SCAL:GAIN 2;OFFS 0.5;STAT ON", 2.5),
        ("CALC:SCAL:FUNC PCT;REF 0.5;STAT ON", 100.0),
        ("VOLT:NULL:VAL 0.5;STAT ON;:CALC:SCAL:GAIN 3;STAT ON", 1.5),
        ("CALC:SCAL:GAIN 2;OFFS 0.5", 1.0),
    ],
)
def test_null_and_scaling_go_into_every_reading_until_they_are_off(fed: Session, setting: str, told: float) -> None:
    fed.write(setting)
    assert float(fed.query("READ?")) == pytest.approx(told, abs=2e-2)
    assert float(fed.query("READ?")) == pytest.approx(told, abs=2e-2)
    fed.write("CONF:VOLT:DC 10")
    assert float(fed.query("READ?")) == pytest.approx(1.0, abs=2e-2)
    assert fed.query("VOLT:NULL:STAT?;:CALC:SCAL:STAT?;:SYST:ERR?") == '0;0;+0,"No error"'
