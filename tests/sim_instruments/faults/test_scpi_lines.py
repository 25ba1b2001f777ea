"""Faults of SCPI instruments' lines: the bytes that come, or the error that the VISA session raises."""

from typing import Any

import pytest
import pyvisa
from pyvisa.constants import StatusCode

from sim_instruments.bench import VirtualBench
from sim_instruments.faults.catalogue import FAULT


def add(bench: VirtualBench, **described: Any) -> None:
    bench.injector.add(FAULT.validate_python(described))


@pytest.fixture
def supply(visa: Any) -> Any:
    session = visa("supply")
    session.write("VOLT 1.5,(@1);VOLT 12,(@2);:OUTP ON,(@1:2)")
    return session


def test_a_stale_reply_comes_in_the_place_of_the_next_until_device_clear(
    virtual_bench: VirtualBench, supply: Any
) -> None:
    add(virtual_bench, fault="stale", role="supply", pattern="VOLT")
    with pytest.raises(pyvisa.VisaIOError, match="VI_ERROR_TMO"):
        supply.query("VOLT? (@1)")
    assert float(supply.query("CURR? (@1)")) == 1.5
    assert float(supply.query("VOLT? (@2)")) == 10.0
    assert float(supply.query("VOLT? (@1)")) == 12.0
    supply.clear()
    assert float(supply.query("VOLT? (@2)")) == 12.0


def test_a_frozen_meter_repeats_its_first_reading(virtual_bench: VirtualBench, supply: Any) -> None:
    add(virtual_bench, fault="frozen", role="supply", duration=5.0)
    first = supply.query("MEAS:VOLT? (@1)")
    supply.write("VOLT 3,(@1)")
    assert {supply.query("MEAS:VOLT? (@1)") for _ in range(3)} == {first}
    # What is no reading is answered as ever.
    assert float(supply.query("VOLT? (@1)")) == 3.0
    virtual_bench.clock.sleep(5.0)
    assert float(supply.query("MEAS:VOLT? (@1)")) == pytest.approx(3.0, abs=0.01)


@pytest.mark.parametrize(("kind", "said"), [("not_a_number", "NAN"), ("overflow", "+9.90000000E+37")])
def test_readings_that_are_none(virtual_bench: VirtualBench, supply: Any, kind: str, said: str) -> None:
    add(virtual_bench, fault=kind, role="supply")
    assert supply.query("MEAS:VOLT? (@1,2)") == f"{said},{said}"
    assert supply.query("OUTP? (@1)") == "1"


def test_a_bridge_without_readings(virtual_bench: VirtualBench, visa: Any) -> None:
    bridge = visa("lcr_meter")
    add(virtual_bench, fault="overflow", role="lcr_meter")
    assert bridge.query("FETC?").startswith("+9.90000000E+37,+9.90000000E+37,+")
    bridge.write("FORM REAL")
    assert bridge.query_binary_values("FETC?", "d", is_big_endian=True)[:2] == [9.9e37, 9.9e37]


@pytest.mark.parametrize(("kind", "code"), [("not_a_number", 0), ("overflow", 255)])
def test_a_record_that_is_all_holes_or_all_clipped(
    virtual_bench: VirtualBench, visa: Any, kind: str, code: int
) -> None:
    scope = visa("oscilloscope")
    scope.write("*RST")
    scope.write("TRIG:SWE AUTO")
    scope.write("DIG CHAN1")
    assert scope.query("*OPC?") == "1"
    add(virtual_bench, fault=kind, role="oscilloscope")
    scope.write("WAV:FORM BYTE")
    samples = scope.query_binary_values("WAV:DATA?", "B")
    assert set(samples) == {code}
    scope.write("WAV:FORM ASC")
    scope.write("WAV:DATA?")
    assert scope.read().split(",")[-1] == {"not_a_number": "NAN", "overflow": "+9.90000000E+37"}[kind]


def test_the_reply_of_another_output(virtual_bench: VirtualBench, supply: Any) -> None:
    add(virtual_bench, fault="wrong_channel", role="supply", duration=100.0)
    assert float(supply.query("MEAS:VOLT? (@1)")) == pytest.approx(12.0, abs=0.01)
    assert float(supply.query("VOLT? (@3)")) == 1.5
    # What is set goes where it should.
    supply.write("VOLT 2,(@1)")
    virtual_bench.injector.clear()
    assert float(supply.query("VOLT? (@1)")) == 2.0


def test_the_record_of_another_channel(virtual_bench: VirtualBench, visa: Any) -> None:
    scope = visa("oscilloscope")
    add(virtual_bench, fault="wrong_channel", role="oscilloscope", pattern="WAV:SOUR", times=None)
    scope.write("WAV:SOUR CHAN4")
    assert scope.query("WAV:SOUR?") == "CHAN1"


def test_a_cable_that_is_pulled_out_and_put_back(virtual_bench: VirtualBench, supply: Any, visa: Any) -> None:
    add(virtual_bench, fault="disconnect", role="supply", after=1.0, duration=3.0)
    assert supply.query("*OPC?") == "1"
    virtual_bench.clock.sleep(1.0)
    for act in (lambda: supply.query("*OPC?"), supply.read, supply.clear, supply.read_stb):
        with pytest.raises(pyvisa.VisaIOError) as lost:
            act()
        assert lost.value.error_code == StatusCode.error_connection_lost
    with pytest.raises(pyvisa.VisaIOError, match="VI_ERROR_RSRC_NFOUND"):
        visa("supply")
    virtual_bench.clock.sleep(3.0)
    with pytest.raises(pyvisa.VisaIOError, match="VI_ERROR_CONN_LOST"):
        supply.query("*OPC?")
    again = visa("supply")
    # The instrument itself noticed nothing.
    assert again.query("OUTP? (@1)") == "1"
    supply.close()


def test_one_seed_gives_the_same_garbage(bench_motor: Any) -> None:
    def run() -> str:
        with VirtualBench(bench_motor, seed=3) as bench:
            manager = pyvisa.ResourceManager(bench.visa_library)
            add(bench, fault="garbage", role="voltmeter", count=2)
            with manager.open_resource(bench.address("voltmeter"), encoding="latin-1") as meter:
                return str(meter.query("READ?")) + str(meter.query("READ?"))

    assert run() == run()
