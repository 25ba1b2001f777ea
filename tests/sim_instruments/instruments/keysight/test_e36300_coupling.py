"""Coupling of the supply's outputs by the instrument's own bytes."""

import numpy as np
import pytest

from sim_instruments.bench import VirtualBench
from sim_instruments.instruments.keysight.e36300.supply import KeysightE36313A


def told(unit: KeysightE36313A, message: str) -> str:
    unit.write(message.encode() + b"\n")
    return unit.read(1000, 10.0)[0].decode().strip()


@pytest.mark.parametrize(
    ("message", "reply"),
    [
        ("OUTP:PAIR?", "OFF"),
        ("OUTP:PAIR SERIES;PAIR?", "SER"),
        ("OUTP:PAIR PAR;:OUTP:PAIR OFF;PAIR?", "OFF"),
        ("OUTP:TRAC ON;TRAC:STAT?", "1"),
        ("VOLT:SENS EXT,(@1,3);SENS? (@1:3)", "EXT,INT,EXT"),
        ("VOLT:MODE LIST,(@2);MODE? (@1:3)", "FIX,LIST,FIX"),
        ("CURR:MODE?", "FIX"),
        ("OUTP:PAIR SER;:VOLT:SENS EXT;*RST;:OUTP:PAIR?;:VOLT:SENS?", "OFF;INT"),
        ("OUTP:TRAC ON;:VOLT 7,(@3);:VOLT? (@2,3)", "+7.00000000E+00,+7.00000000E+00"),
        ("VOLT 7,(@3);:VOLT? (@2,3)", "+0.00000000E+00,+7.00000000E+00"),
    ],
)
def test_what_it_replies(virtual_bench: VirtualBench, message: str, reply: str) -> None:
    unit = KeysightE36313A(virtual_bench.world, np.random.default_rng(0))
    assert told(unit, message) == reply
    assert told(unit, "SYST:ERR?") == '+0,"No error"'


@pytest.mark.parametrize(
    ("message", "error"),
    [
        ("OUTP:PAIR SER;:VOLT 5,(@3)", -221),
        ("OUTP:PAIR PAR;:OUTP ON,(@3)", -221),
        ("VOLT:MODE LIST;:VOLT 1", -221),
        ("CURR:MODE LIST;:APPL CH1,1,1", -221),
        ("OUTP:PAIR BOTH", -224),
        ("VOLT:SENS MID", -224),
    ],
)
def test_what_it_refuses(virtual_bench: VirtualBench, message: str, error: int) -> None:
    unit = KeysightE36313A(virtual_bench.world, np.random.default_rng(0))
    unit.write(message.encode() + b"\n")
    assert int(told(unit, "SYST:ERR?").split(",")[0]) == error


@pytest.mark.parametrize(("setting", "share"), [("OUTP:PAIR SER", 0.5), ("VOLT:SENS EXT,(@2)", 1.01), ("*CLS", 1.0)])
def test_what_stands_at_the_terminals_is_not_what_is_read(
    virtual_bench: VirtualBench, setting: str, share: float
) -> None:
    world = virtual_bench.world
    unit = KeysightE36313A(world, np.random.default_rng(0), wired=2)
    unit.write(setting.encode() + b"\nVOLT 5,(@2);:OUTP ON,(@2)\n")
    virtual_bench.clock.sleep(0.5)
    assert world.supply.voltage(0.02) == pytest.approx(5.0 * share, rel=1e-3)
    assert float(told(unit, "MEAS:VOLT? (@2)")) == pytest.approx(5.0, rel=1e-3)


def test_pairing_switches_both_outputs_off(virtual_bench: VirtualBench) -> None:
    unit = KeysightE36313A(virtual_bench.world, np.random.default_rng(0))
    assert told(unit, "OUTP ON,(@1:3);:OUTP:PAIR PAR;:OUTP? (@1:3)") == "1,0,0"
