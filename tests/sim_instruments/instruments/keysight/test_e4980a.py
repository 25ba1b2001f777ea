import math
import struct
from collections.abc import Callable

import numpy as np
import pytest
import pyvisa

from sim_instruments.bench import VirtualBench
from sim_instruments.instruments.errors import LcrErrors
from sim_instruments.instruments.keysight.e4980a import accuracy
from sim_instruments.instruments.keysight.e4980a.lcr_meter import KeysightE4980A
from sim_instruments.instruments.keysight.e4980a.parameters import TOKENS, pair
from sim_instruments.physics.motor.motor import VirtualMotor

Session = pyvisa.resources.MessageBasedResource
LINE_RESISTANCE, LEAD_RESISTANCE, LEAD_INDUCTANCE = 1.0, 6.0e-3, 0.2e-6


@pytest.fixture
def bridge(visa: Callable[[str], Session], virtual_bench: VirtualBench) -> Session:
    virtual_bench.world.lock_rotor()
    virtual_bench.world.connect({"A": "lcr_high", "B": "lcr_low"})
    session = visa("lcr_meter")
    session.timeout = 20_000
    session.write("*RST;*CLS;:FUNC:IMP LSRS;:TRIG:SOUR BUS")
    return session


def short_correct(bridge: Session, bench: VirtualBench) -> None:
    bench.world.short_leads(True)
    bridge.write("CORR:SHOR:EXEC")
    assert bridge.query("*OPC?") == "1"
    bridge.write("CORR:SHOR:STAT ON")
    bench.world.short_leads(False)


def test_a_reading_has_its_twelve_characters(bridge: Session) -> None:
    bridge.write("TRIG:IMM")
    reply = bridge.query("FETC?")
    inductance, resistance, status = reply.split(",")
    assert [len(part) for part in (inductance, resistance, status)] == [12, 12, 2]
    assert status == "+0"
    bridge.write("FORM:ASC:LONG ON")
    assert [len(part) for part in bridge.query("FETC?").split(",")] == [16, 16, 2]
    bridge.write("COMP ON")
    assert bridge.query("FETC?").endswith(",+0,+0")


def test_leads_stay_in_the_reading_until_they_are_corrected(bridge: Session, virtual_bench: VirtualBench) -> None:
    def read() -> tuple[float, float]:
        bridge.write("APER LONG,4;:FREQ 1000;:TRIG")
        inductance, resistance, _ = map(float, bridge.query("FETC?").split(","))
        return inductance, resistance

    raw = read()
    short_correct(bridge, virtual_bench)
    corrected = read()
    assert raw[1] - corrected[1] == pytest.approx(LEAD_RESISTANCE, abs=1e-3)
    assert corrected[1] == pytest.approx(LINE_RESISTANCE, rel=2e-3)
    virtual_bench.world.short_leads(True)
    left = read()
    assert left[0] == pytest.approx(5e-9, abs=20e-9)
    assert left[1] == pytest.approx(20e-6, abs=60e-6)


def test_a_short_correction_without_a_short_is_refused(bridge: Session, virtual_bench: VirtualBench) -> None:
    virtual_bench.world.connect({})
    bridge.write("CORR:SHOR")
    assert bridge.query("*OPC?;:SYST:ERR?").startswith('1;-200,"Execution error')
    bridge.write("CORR:OPEN")
    assert bridge.query("*OPC?;:SYST:ERR?") == '1;+0,"No error"'


def test_open_terminals_overload(bridge: Session, virtual_bench: VirtualBench) -> None:
    virtual_bench.world.connect({"A": "lcr_high"})
    assert bridge.query("TRIG;:FETC?") == "+9.90000E+37,+9.90000E+37,+1"
    bridge.write("VOLT 1.1")
    assert bridge.query("FETCH?") == "+9.90000E+37,+9.90000E+37,-1"


def test_level_control_cannot_regulate_into_a_winding(bridge: Session) -> None:
    bridge.write("AMPL:ALC ON")
    assert bridge.query("TRIG;:FETC?").endswith(",+4")


@pytest.mark.parametrize(
    ("aperture", "frequency", "seconds"),
    [("SHOR", 20, 0.330), ("MED", 20, 0.380), ("LONG", 20, 0.480), ("MED", 1000, 0.110), ("LONG", 1000, 0.240)],
)
def test_a_measurement_takes_the_data_sheets_time(
    bridge: Session, virtual_bench: VirtualBench, aperture: str, frequency: int, seconds: float
) -> None:
    bridge.write(f"APER {aperture}, 2;:FREQ {frequency};:TRIG:DEL 0.1")
    assert bridge.query("APER?") == f"{aperture},2"
    before = virtual_bench.clock.now()
    bridge.write("*TRG")
    assert virtual_bench.clock.now() == before
    bridge.read()
    assert virtual_bench.clock.now() - before == pytest.approx(2 * seconds + 0.1, rel=1e-6)


def test_the_current_is_limited_by_the_source(bridge: Session) -> None:
    assert float(bridge.query("TRIG;:FETC:SMON:IAC?")) == pytest.approx(1.0 / 101.5, rel=0.01)


def test_levels_of_the_other_mode_are_errors(bridge: Session) -> None:
    bridge.write("CURR:LEV 5MA")
    assert bridge.query(":CURR:LEV?") == "+5.00000E-03"
    bridge.write(":VOLT:LEV?")
    assert bridge.query("SYST:ERR?").startswith("-230")
    bridge.write(":VOLT:LEV 1")
    assert bridge.query(":VOLT:LEV?") == "+1.00000E+00"
    bridge.write(":CURR:LEV?")
    assert bridge.query("SYST:ERR?").startswith("-230")


@pytest.mark.parametrize(
    ("message", "reply"),
    [
        (":FREQ:CW 20HZ;CW?", "+2.00000E+01"),
        ("FREQ 1MHZ;:FREQ?", "+1.00000E+06"),
        ("FREQ 1.5 KHZ;:FREQ?", "+1.50000E+03"),
        ("FREQ? MAX", "+1.00000E+06"),
        (":APER MED,1;:APER?", "MED,1"),
        ("APERture LONG , 16;:APERture?", "LONG,16"),
        ("FUNCtion:IMPedance:TYPE LSRS;TYPE?", "LSRS"),
        ("FUNC:IMP:RANG 100;:FUNC:IMP:RANG?;RANG:AUTO?", "+1.00000E+02;0"),
        ("FUNC:IMP:RANG:AUTO ON;AUTO?", "1"),
        ("TRIG:SOUR HOLD;SOUR?", "HOLD"),
        ("DISP:PAGE LIST;PAGE?", "LIST"),
        ("LIST:FREQ 1E2,1E3,1E4;FREQ?", "+1.00000E+02,+1.00000E+03,+1.00000E+04"),
        ("LIST:FREQ 1E2;CLE:ALL;:LIST:FREQ?", "+9.90000E+37"),
        ("FUNC:DEV1:MODE PERC;:FUNC:DEV2:REF:VAL -3;VAL?;:FUNC:DEV1:MODE?", "-3.00000E+00;PERC"),
        ("BIAS:STAT OFF;STAT?;:BIAS:VOLT 1.5;VOLT:LEV?", "0;+1.50000E+00"),
        ("DISP:LINE 'winding AB';LINE?", '"winding AB"'),
        ("LIST:MODE SEQ;MODE?", "SEQ"),
        ("FORM REAL,64;:FORM ASC,12;:FORM?", "ASC"),
        ("CORR:LENG 1;LENG?", "+1"),
        ("CORR:OPEN:STAT ON;STAT?", "1"),
        ("FORM:DATA ASC;:FORM?", "ASC"),
        ("*OPT?", "102"),
        ("INIT:CONT OFF;:INIT;:ABOR;:INIT:CONT?", "0"),
    ],
)
def test_what_clients_send(bridge: Session, message: str, reply: str) -> None:
    assert bridge.query(message) == reply
    assert bridge.query("SYST:ERR?") == '+0,"No error"'


@pytest.mark.parametrize(
    ("command", "error"),
    [
        ("FREQ 19", -222),
        ("FREQ 2MHZ", -222),
        ("VOLT 2.1", -222),
        ("FUNC:IMP DCR", -141),
        ("FUNC:IMP LPRS", -141),
        ("FUNC:IMP LSRD", -241),
        ("APER FAST", -141),
        ("APER MED,257", -222),
        ("INIT", -213),
        ("DCR?", -113),
        ("CORR:LENG 3", -224),
        ("BIAS:STAT ON", -241),
        ("FUNC:DEV1:MODE RATIO", -141),
        ("FUNC:DEV3:MODE ABS", -114),
        ("LIST:FREQ 1,100", -222),
        ("LIST:VOLT 0.1,3", -222),
        ("FORM REAL,32", -222),
        ("FORM REAL,64,1", -108),
    ],
)
def test_what_it_refuses(bridge: Session, command: str, error: int) -> None:
    bridge.write(command)
    assert int(bridge.query("SYST:ERR?").split(",")[0]) == error


def test_a_trigger_that_nobody_waits_for_is_ignored(bridge: Session) -> None:
    bridge.write("INIT:CONT OFF;:TRIG")
    assert bridge.query("SYST:ERR?").startswith("-211")
    bridge.write("INIT;:TRIG")
    assert bridge.query("FETC?;:SYST:ERR?").endswith('+0;+0,"No error"')


def numbers(reply: str) -> list[float]:
    return [float(part) for part in reply.split(",")]


def test_what_was_there_before_is_fetched_after_a_trigger_that_was_ignored(bridge: Session) -> None:
    bridge.write("FREQ 1000;:TRIG")
    before = bridge.query("FETC?")
    bridge.write("INIT:CONT OFF;:TRIG")
    assert bridge.query("FETC?") == before
    assert bridge.query("SYST:ERR?") == '-211,"Trigger ignored"'
    bridge.write("INIT:CONT ON;:TRIG")
    assert bridge.query("FETC?") != before
    assert bridge.query("SYST:ERR?") == '+0,"No error"'


def test_free_running_that_is_switched_off_keeps_its_last_reading(bridge: Session, virtual_bench: VirtualBench) -> None:
    bridge.write("TRIG:SOUR INT;:INIT:CONT OFF")
    assert bridge.query("FETC?") == "+9.90000E+37,+9.90000E+37,-1"
    bridge.write("INIT:CONT ON")
    virtual_bench.clock.sleep(1.0)
    bridge.write("INIT:CONT OFF")
    kept = bridge.query("FETC?")
    assert kept.endswith(",+0")
    virtual_bench.clock.sleep(1.0)
    assert bridge.query("FETC?") == kept
    bridge.write("INIT")
    assert bridge.query("FETC?") != kept


def test_pages_without_a_measurement_ignore_the_trigger(bridge: Session) -> None:
    bridge.write("DISP:PAGE MSET;:TRIG")
    assert bridge.query("FETC?;:SYST:ERR?") == '+9.90000E+37,+9.90000E+37,-1;-211,"Trigger ignored"'
    bridge.write("DISP:PAGE MEAS;:TRIG")
    assert bridge.query("FETC?;:SYST:ERR?").endswith(',+0;+0,"No error"')


def test_the_list_page_gives_four_figures_a_point(bridge: Session) -> None:
    bridge.write("DISP:PAGE LIST")
    assert bridge.query("FETC?") == "+9.90000E+37,+9.90000E+37,-1,+0"
    bridge.write("FUNC:IMP RX;:LIST:FREQ 1E2,1E4;:TRIG")
    figures = numbers(bridge.query("FETC?"))
    assert len(figures) == 8
    assert figures[2:4] == figures[6:8] == [0.0, 0.0]
    assert figures[5] == pytest.approx(100.0 * figures[1], rel=0.02)


def test_a_stepped_list_measures_the_next_point_at_each_trigger(bridge: Session) -> None:
    bridge.write("FUNC:IMP RX;:LIST:MODE STEP;FREQ 1E2,1E4;:DISP:PAGE LIST")
    assert bridge.query("FETC?") == "+9.90000E+37,+9.90000E+37,-1,+0"
    first, second, again = (numbers(bridge.query("TRIG;:FETC?")) for _ in range(3))
    assert len(first) == 4
    assert second[1] == pytest.approx(100.0 * first[1], rel=0.02)
    assert again[1] == pytest.approx(first[1], rel=0.02)


def test_a_list_of_levels(bridge: Session) -> None:
    bridge.write("FUNC:IMP RX;:FREQ 1E3;:LIST:VOLT 0.5,1;:DISP:PAGE LIST;:TRIG")
    figures = numbers(bridge.query("FETC?"))
    assert figures[0] == pytest.approx(figures[4], rel=0.01)
    assert bridge.query("LIST:VOLT?;FREQ?;CURR?") == "+5.00000E-01,+1.00000E+00;+9.90000E+37;+9.90000E+37"
    monitored = float(bridge.query("FUNC:SMON:VAC ON;:FETC:SMON:VAC?"))
    bridge.write("LIST:CURR 2.5E-3,5E-3;:TRIG")
    assert len(numbers(bridge.query("FETC?"))) == 8
    assert float(bridge.query("FETC:SMON:VAC?")) == pytest.approx(0.5 * monitored, rel=0.02)


def test_an_emf_beyond_what_the_bridge_takes_is_an_overload(bridge: Session, virtual_bench: VirtualBench) -> None:
    world = virtual_bench.world
    world.release_rotor()
    world.turn_shaft(20.0)
    virtual_bench.clock.sleep(1.0)
    # 2.8 V drive less than 50 mA through 100 Ω, 8.4 V more.
    assert bridge.query("TRIG;:FETC?").endswith(",+0")
    world.turn_shaft(60.0)
    virtual_bench.clock.sleep(1.0)
    assert bridge.query("TRIG;:FETC?") == "+9.90000E+37,+9.90000E+37,+1"
    bridge.write("CORR:OPEN;*OPC?")
    assert bridge.read() == "1"
    assert bridge.query("SYST:ERR?").startswith("-200,")


def test_deviations_from_a_reference(bridge: Session) -> None:
    def figures() -> list[float]:
        return numbers(bridge.query("TRIG;:FETC?"))

    inductance, resistance, _ = figures()
    bridge.write(f"FUNC:DEV2:REF {resistance:E};:FUNC:DEV2:MODE ABS")
    assert figures()[:2] == pytest.approx([inductance, 0.0], abs=5e-3)
    bridge.write(f"FUNC:DEV1:REF {0.5 * inductance:E};:FUNC:DEV1:MODE PERC")
    assert figures()[0] == pytest.approx(100.0, abs=0.5)
    bridge.write("FUNC:DEV1:MODE OFF;:FUNC:DEV2:MODE OFF")
    assert figures()[:2] == pytest.approx([inductance, resistance], rel=5e-3)


def test_a_cable_that_is_not_there_turns_the_phase(bridge: Session) -> None:
    bridge.write("FUNC:IMP RX;:FREQ 100KHZ;:TRIG")
    plain = complex(*numbers(bridge.query("FETC?"))[:2])
    bridge.write("CORR:LENG 4;:TRIG")
    turned = complex(*numbers(bridge.query("FETC?"))[:2])
    assert np.angle(turned / plain) == pytest.approx(2.0 * math.pi * 1e5 * 4.0 / 2e8, rel=0.05)


def test_a_load_correction_that_somebody_left(virtual_bench: VirtualBench) -> None:
    unit = KeysightE4980A(virtual_bench.world, np.random.default_rng(0))
    unit.load_factor = 1.1 + 0.0j
    virtual_bench.world.lock_rotor()
    virtual_bench.world.connect({"A": "lcr_high", "B": "lcr_low"})

    def resistance(state: bytes) -> float:
        unit.write(b"FUNC:IMP RX;:TRIG:SOUR BUS;:CORR:LOAD:STAT %s;:TRIG;:FETC?" % state)
        return numbers(unit.read(1000, 10.0)[0].decode())[0]

    assert resistance(b"ON") == pytest.approx(1.1 * resistance(b"OFF"), rel=2e-3)


def test_a_bias_is_seen_by_the_option_that_makes_it(virtual_bench: VirtualBench) -> None:
    unit = KeysightE4980A(virtual_bench.world, np.random.default_rng(0), options=("102", "001"))
    virtual_bench.world.lock_rotor()
    virtual_bench.world.connect({"A": "lcr_high", "B": "lcr_low"})
    unit.write(b"FUNC:IMP VDID;:TRIG:SOUR BUS;:BIAS:VOLT 2;:BIAS:STAT ON;:TRIG;:FETC?")
    volts, amperes, _ = numbers(unit.read(1000, 10.0)[0].decode())
    assert amperes == pytest.approx(2.0 / 101.0, rel=1e-3)
    assert volts == pytest.approx(amperes * LINE_RESISTANCE, rel=0.02)


def test_free_running_gives_the_last_full_cycle(bridge: Session, virtual_bench: VirtualBench) -> None:
    bridge.write("TRIG:SOUR INT;:APER MED,1;:FREQ 1000")
    before = virtual_bench.clock.now()
    first = bridge.query("FETC?")
    assert virtual_bench.clock.now() - before == pytest.approx(0.11)
    assert bridge.query("FETC?") == first
    virtual_bench.clock.sleep(1.0)
    now = virtual_bench.clock.now()
    assert bridge.query("FETC?") != first
    assert virtual_bench.clock.now() == now


def test_binary_replies(bridge: Session) -> None:
    bridge.write("FORM REAL;:TRIG")
    bridge.read_termination = None
    bridge.write("FETC?")
    data = bridge.read_raw()
    assert data[:4] == b"#224"
    inductance, resistance, status = struct.unpack(">3d", data[4:28])
    assert (inductance > 1e-3, resistance > 0.9, status) == (True, True, 0.0)


def test_formatted_and_corrected_reads(bridge: Session) -> None:
    bridge.write("TRIG")
    inductance, resistance, _ = map(float, bridge.query("FETC:IMP:FORM?").split(","))
    real, imaginary = map(float, bridge.query("FETC:IMP:CORR?").split(","))
    assert real == pytest.approx(resistance, rel=1e-5)
    assert imaginary == pytest.approx(2.0 * math.pi * 1000.0 * inductance, rel=1e-5)


def test_every_function_keeps_the_impedance(bridge: Session) -> None:
    z, f = complex(0.8, 6.0), 1000.0
    w = 2.0 * math.pi * f
    y = 1.0 / z
    values = {token: pair(token, z, f, 0.7) for token in TOKENS}
    assert values["RX"] == (0.8, 6.0)
    assert values["LSRS"] == pytest.approx((6.0 / w, 0.8))
    assert values["LSQ"][1] == pytest.approx(7.5)
    assert values["LSD"][1] == pytest.approx(1.0 / 7.5)
    assert values["LSRD"][1] == 0.7
    assert complex(values["GB"][0], values["GB"][1]) == pytest.approx(y)
    lp, rp = values["LPRP"]
    assert 1.0 / (1.0 / rp + 1.0 / complex(0.0, w * lp)) == pytest.approx(z)
    cp, g = values["CPG"]
    assert 1.0 / complex(g, w * cp) == pytest.approx(z)
    cs, rs = values["CSRS"]
    assert complex(rs, -1.0 / (w * cs)) == pytest.approx(z)
    magnitude, degrees = values["ZTD"]
    assert magnitude * np.exp(1j * math.radians(degrees)) == pytest.approx(z)


def test_direct_current_needs_its_option(virtual_bench: VirtualBench) -> None:
    unit = KeysightE4980A(virtual_bench.world, np.random.default_rng(0), options=("102", "001"))
    virtual_bench.world.lock_rotor()
    virtual_bench.world.connect({"A": "lcr_high", "B": "lcr_low"})
    unit.write(b"*OPT?;:FUNC:IMP LSRD;:TRIG:SOUR BUS;:TRIG;:FETC?")
    options, values = unit.read(1000, 10.0)[0].decode().strip().split(";")
    assert options == "001,102"
    assert float(values.split(",")[1]) == pytest.approx(LINE_RESISTANCE + LEAD_RESISTANCE, abs=5e-3)
    with pytest.raises(ValueError, match="032, 052, 102"):
        KeysightE4980A(virtual_bench.world, np.random.default_rng(0), options=("001",))


def test_accuracy_formula_at_the_sheets_points() -> None:
    assert accuracy.basic_accuracy("SHOR", 125.0, 0.3) == pytest.approx(0.10e-2)
    assert accuracy.basic_accuracy("MED", 1000.0, 1.0) == pytest.approx(0.05e-2)
    assert accuracy.basic_accuracy("MED", 20.0, 1.0) == pytest.approx(0.10e-2)
    assert accuracy.short_offset("MED", 1000.0, 1.0, 0.1) == pytest.approx(0.8e-3)
    assert accuracy.short_offset("MED", 1000.0, 1.0, 10.0) == pytest.approx(1.68e-3)


def test_drawn_units_stay_within_the_accuracy(bench_motor: VirtualMotor) -> None:
    generator = np.random.default_rng(3)
    errors = []
    for seed in range(60):
        with VirtualBench(bench_motor, seed=seed) as bench:
            bench.world.lock_rotor()
            bench.world.connect({"A": "lcr_high", "B": "lcr_low"})
            unit = KeysightE4980A(bench.world, np.random.default_rng(seed), LcrErrors.drawn(generator))
            unit.write(b"FUNC:IMP RX;:APER LONG,8;:TRIG:SOUR BUS;:TRIG;:FETC?")
            real, imaginary, _ = map(float, unit.read(1000, 100.0)[0].split(b","))
            true = bench.world.impedance(1000.0, 1.0, 0.1)
            limit = accuracy.basic_accuracy("LONG", 1000.0, 1.0) * abs(true)
            limit += accuracy.short_offset("LONG", 1000.0, 1.0, abs(true))
            errors.append(abs(complex(real, imaginary) - true) / limit)
    assert 0.3 < max(errors) < 1.05
    assert np.mean(errors) > 0.2
