from collections.abc import Callable

import pytest
import pyvisa

from sim_instruments.bench import VirtualBench
from sim_instruments.catalogue import SimulatedUnit, find
from sim_instruments.instruments.errors import SupplyErrors
from sim_instruments.instruments.keysight.e36300.supply import KeysightE36313A

Open = Callable[[str], pyvisa.resources.MessageBasedResource]


@pytest.fixture
def supply(visa: Open) -> pyvisa.resources.MessageBasedResource:
    return visa("supply")


@pytest.fixture
def loaded(virtual_bench: VirtualBench, supply: pyvisa.resources.MessageBasedResource):
    virtual_bench.world.connect({"A": "supply+", "B": "supply-"})
    virtual_bench.world.lock_rotor()
    return supply


def test_replies_to_the_byte(supply: pyvisa.resources.MessageBasedResource) -> None:
    supply.write("*RST")
    assert supply.query("VOLT? (@1)") == "+0.00000000E+00"
    supply.write("VOLT 1.5,(@1,3);:CURR 0.25,(@2)")
    assert supply.query("VOLT? (@1:3)") == "+1.50000000E+00,+0.00000000E+00,+1.50000000E+00"
    assert supply.query("SOUR:CURR:LEV:IMM:AMPL? (@2)") == "+2.50000000E-01"
    assert supply.query("VOLT? MAX,(@1)") == "+6.18000000E+00"
    assert supply.query("VOLT? MAX") == "+6.18000000E+00"
    assert supply.query("CURR? MAX,(@1);CURR? MAX,(@2)") == "+1.03000000E+01;+2.06000000E+00"
    assert supply.query("OUTP? (@1)") == "0"
    assert supply.query("INST:SEL?;NSEL?") == "CH1;+1"
    supply.write("INST:SEL P25V")
    assert supply.query("INST?;:VOLT?") == "CH2;+0.00000000E+00"
    supply.write('DISP:TEXT "TEST; A,B"')
    assert supply.query("DISP:TEXT?") == '"TEST; A,B"'
    assert supply.query("SYST:ERR?") == '+0,"No error"'


@pytest.mark.parametrize(
    ("command", "error"),
    [
        ("VOLT 6.2,(@1)", -222),
        ("VOLT -1,(@1)", -222),
        ("CURR 10.4,(@1)", -222),
        ("VOLT 1,(@4)", -222),
        ("VOLT 26,(@2)", -222),
        ("VOLT 1,2,3", -108),
        ("OUTP:PROT:CLE 1", -104),
        ("APPL CH1,99,1", -222),
    ],
)
def test_what_the_model_cannot_do(supply: pyvisa.resources.MessageBasedResource, command: str, error: int) -> None:
    supply.write("*CLS;*RST")
    supply.write(command)
    assert int(supply.query("SYST:ERR?").split(",")[0]) == error
    assert supply.query("VOLT? (@1)") == "+0.00000000E+00"


def test_constant_current_and_constant_voltage(
    loaded: pyvisa.resources.MessageBasedResource, virtual_bench: VirtualBench
) -> None:
    loaded.write("APPL CH1,3,1;:OUTP ON,(@1)")
    assert loaded.query("APPL? CH1") == '"3.0000,1.0000"'
    virtual_bench.clock.sleep(0.5)
    assert loaded.query("STAT:QUES:INST:ISUM1:COND?") == "+1"
    assert float(loaded.query("MEAS:CURR? (@1)")) == pytest.approx(1.0, abs=3e-3)
    loaded.write("CURR 10,(@1);:VOLT 1,(@1)")
    virtual_bench.clock.sleep(0.5)
    assert loaded.query("STAT:QUES:INST:ISUM1:COND?") == "+2"
    assert float(loaded.query("MEAS:VOLT? (@1)")) == pytest.approx(1.0, abs=1e-3)
    # 1 V over two windings of 0.5 Ω, two leads and the output.
    assert float(loaded.query("MEAS:CURR? (@1)")) == pytest.approx(1.0, abs=0.02)
    loaded.write("OUTP OFF,(@1)")
    virtual_bench.clock.sleep(0.5)
    assert loaded.query("STAT:QUES:INST:ISUM1:COND?") == "+0"
    assert abs(float(loaded.query("MEAS:CURR? (@1)"))) < 2e-3


def test_measuring_takes_a_line_cycle(
    loaded: pyvisa.resources.MessageBasedResource, virtual_bench: VirtualBench
) -> None:
    before = virtual_bench.clock.now()
    loaded.query("MEAS:VOLT? (@1)")
    assert virtual_bench.clock.now() - before == pytest.approx(0.02)


def test_readings_are_quantised_and_noisy(loaded: pyvisa.resources.MessageBasedResource) -> None:
    loaded.write("APPL CH1,2,5;:OUTP ON,(@1)")
    readings = [float(loaded.query("MEAS:CURR? (@1)")) for _ in range(50)]
    assert len(set(readings)) > 3
    assert all(abs(reading * 1e4 - round(reading * 1e4)) < 1e-3 for reading in readings)


def test_over_current_protection_trips_and_is_cleared(
    loaded: pyvisa.resources.MessageBasedResource, virtual_bench: VirtualBench
) -> None:
    loaded.write("APPL CH1,3,1;:CURR:PROT:STAT ON,(@1);:OUTP ON,(@1)")
    virtual_bench.clock.sleep(1.0)
    assert loaded.query("CURR:PROT:TRIP? (@1);:VOLT:PROT:TRIP? (@1);:OUTP? (@1)") == "1;0;0"
    assert loaded.query("STAT:QUES:INST:ISUM1:COND?;:SYST:ERR?") == '+3;+0,"No error"'
    loaded.write("OUTP ON,(@1)")
    assert loaded.query("SYST:ERR?").startswith("-221")
    # Cleared, the output is what it was before, and trips again; told to be off meanwhile, it stays off.
    loaded.write("OUTP:PROT:CLE (@1)")
    assert loaded.query("CURR:PROT:TRIP? (@1);:OUTP? (@1)") == "0;1"
    virtual_bench.clock.sleep(1.0)
    assert loaded.query("CURR:PROT:TRIP? (@1);:OUTP? (@1)") == "1;0"
    loaded.write("OUTP OFF,(@1);:OUTP:PROT:CLE (@1)")
    assert loaded.query("CURR:PROT:TRIP? (@1);:OUTP? (@1);:STAT:QUES:INST:ISUM1:COND?") == "0;0;+0"
    loaded.write("CURR:PROT:STAT OFF,(@1);:OUTP ON,(@1)")
    virtual_bench.clock.sleep(1.0)
    assert loaded.query("OUTP? (@1)") == "1"


def test_the_delay_of_over_current_protection_starts_where_it_is_told_to(
    loaded: pyvisa.resources.MessageBasedResource, virtual_bench: VirtualBench
) -> None:
    assert loaded.query("CURR:PROT:DEL:STAR? (@1)") == "SCH"
    loaded.write("APPL CH1,0.5,2;:CURR:PROT:DEL 0.2,(@1);:CURR:PROT:STAT ON,(@1);:OUTP ON,(@1)")
    virtual_bench.clock.sleep(1.0)
    # A change starts the delay anew; what is in constant current when it ends trips then.
    loaded.write("CURR 0.3,(@1)")
    virtual_bench.clock.sleep(0.15)
    assert loaded.query("CURR:PROT:TRIP? (@1)") == "0"
    virtual_bench.clock.sleep(0.1)
    assert loaded.query("CURR:PROT:TRIP? (@1)") == "1"
    loaded.write("OUTP OFF,(@1);:OUTP:PROT:CLE (@1);:CURR:PROT:DEL:STAR CCTRans,(@1)")
    assert loaded.query("CURR:PROT:DEL:STAR? (@1)") == "CCTR"
    loaded.write("OUTP ON,(@1)")
    virtual_bench.clock.sleep(0.15)
    loaded.write("VOLT 0.6,(@1)")
    virtual_bench.clock.sleep(0.1)
    assert loaded.query("CURR:PROT:TRIP? (@1)") == "1"


def test_over_voltage_protection_trips(
    loaded: pyvisa.resources.MessageBasedResource, virtual_bench: VirtualBench
) -> None:
    loaded.write("APPL CH1,2,10;:VOLT:PROT 1,(@1);:OUTP ON,(@1)")
    virtual_bench.clock.sleep(0.5)
    assert loaded.query("VOLT:PROT:TRIP? (@1)") == "1"
    assert virtual_bench.world.truth()["output_on"] is False


def test_reset_switches_off(loaded: pyvisa.resources.MessageBasedResource, virtual_bench: VirtualBench) -> None:
    loaded.write("APPL CH1,2,10;:OUTP ON,(@1)")
    assert virtual_bench.world.truth()["output_on"] is True
    loaded.write("*RST")
    assert virtual_bench.world.truth()["output_on"] is False


def test_questionable_status_summarises(
    loaded: pyvisa.resources.MessageBasedResource, virtual_bench: VirtualBench
) -> None:
    loaded.write("STAT:QUES:INST:ISUM1:ENAB 1;:STAT:QUES:ENAB 8192;*SRE 8;:APPL CH1,3,1;:OUTP ON,(@1)")
    virtual_bench.clock.sleep(0.5)
    assert loaded.read_stb() & 0x48 == 0x48
    assert loaded.query("STAT:QUES:INST:ISUM1?") == "+1"


def test_a_unit_has_the_errors_it_is_given(virtual_bench: VirtualBench) -> None:
    import numpy as np

    unit = KeysightE36313A(
        virtual_bench.world, np.random.default_rng(0), SupplyErrors(set_voltage_gain=0.01, voltage_gain=-0.01)
    )
    unit.write(b"VOLT 2;:OUTP ON")
    virtual_bench.clock.sleep(0.1)
    true = virtual_bench.world.supply.voltage(0.01)
    assert true == pytest.approx(2.02, abs=1e-3)
    unit.write(b"MEAS:VOLT?")
    assert float(unit.read(100, 1.0)[0]) == pytest.approx(true * 0.99, abs=1e-3)


def test_another_output_may_be_the_one_that_is_wired(virtual_bench: VirtualBench) -> None:
    bench = VirtualBench(virtual_bench.world.motor, [SimulatedUnit(find("keysight-e36313a"), options={"channel": 2})])
    manager = pyvisa.ResourceManager(bench.visa_library)
    supply = manager.open_resource(bench.address("supply"), read_termination="\n")
    bench.world.connect({"A": "supply+", "B": "supply-"})
    bench.world.lock_rotor()
    supply.write("VOLT 12,(@2);:CURR 0.8,(@2);:OUTP ON,(@1,2)")
    bench.clock.sleep(0.5)
    assert supply.query("STAT:QUES:INST:ISUM2:COND?;:STAT:QUES:INST:ISUM1:COND?") == "+1;+2"
    assert bench.world.supply.current(0.01) == pytest.approx(0.8, abs=2e-3)
    supply.write("CURR:PROT:STAT ON,(@2)")
    bench.clock.sleep(0.5)
    assert supply.query("CURR:PROT:TRIP? (@1,2);:OUTP? (@1,2)") == "0,1;1,0"
    supply.close()
    manager.close()
    bench.close()
