"""Faults of the bench itself, in the world's truth."""

import math
from typing import Any

import pytest

from sim_instruments.bench import VirtualBench
from sim_instruments.faults.catalogue import FAULT
from sim_instruments.physics.motor.motor import VirtualMotor

SERIES = {"A": "supply+", "B": "supply-", "C": "supply-"}


def add(bench: VirtualBench, **described: Any) -> None:
    bench.injector.add(FAULT.validate_python(described))


def truth(bench: VirtualBench) -> dict[str, Any]:
    return bench.world.truth()


@pytest.fixture
def supply(virtual_bench: VirtualBench, visa: Any) -> Any:
    """The supply at 1.5 V behind 0.75 Ω: 2 A, with an output that is on."""
    virtual_bench.world.lock_rotor()
    virtual_bench.world.connect(SERIES)
    session = visa("supply")
    session.write("VOLT 1.5,(@1);CURR 5,(@1);:OUTP ON,(@1)")
    virtual_bench.clock.sleep(1.0)
    return session


@pytest.mark.parametrize(("reports", "said"), [("on", "1"), ("off", "0")])
def test_a_supply_that_acknowledges_off_and_stays_on(
    virtual_bench: VirtualBench, supply: Any, reports: str, said: str
) -> None:
    add(virtual_bench, fault="stuck_output", role="supply", reports=reports, duration=10.0)
    supply.write("OUTP OFF,(@1)")
    virtual_bench.clock.sleep(1.0)
    assert supply.query("OUTP? (@1)") == said
    assert supply.query("SYST:ERR?") == '+0,"No error"'
    assert float(supply.query("MEAS:CURR? (@1)")) == pytest.approx(2.0, rel=0.05)
    assert supply.query("STAT:QUES:INST:ISUM1:COND?") == ("+2" if reports == "on" else "+0")
    assert truth(virtual_bench)["output_on"] is truth(virtual_bench)["energised"] is True
    assert truth(virtual_bench)["faults"]["stuck_output"] == {"supply": reports}
    virtual_bench.clock.sleep(10.0)
    # What it was told last comes true when it mends.
    assert truth(virtual_bench)["energised"] is False
    assert truth(virtual_bench)["supply_current"] == pytest.approx(0.0, abs=1e-3)


def test_a_supply_that_was_told_nothing_stays_on_when_it_mends(virtual_bench: VirtualBench, supply: Any) -> None:
    add(virtual_bench, fault="stuck_output", role="supply")
    supply.write("OUTP OFF,(@1)")
    supply.write("OUTP ON,(@1)")
    virtual_bench.injector.clear()
    assert truth(virtual_bench)["output_on"] is True


def test_cc_where_cv_is_expected(virtual_bench: VirtualBench, supply: Any) -> None:
    assert supply.query("STAT:QUES:INST:ISUM1:COND?") == "+2"
    add(virtual_bench, fault="current_limited", current=0.5, duration=5.0)
    virtual_bench.clock.sleep(1.0)
    assert supply.query("STAT:QUES:INST:ISUM1:COND?") == "+1"
    assert truth(virtual_bench)["supply_mode"] == "cc"
    assert float(supply.query("MEAS:CURR? (@1)")) == pytest.approx(0.5, abs=0.02)
    assert float(supply.query("CURR? (@1)")) == 5.0
    virtual_bench.clock.sleep(5.0)
    assert truth(virtual_bench)["supply_mode"] == "cv"
    assert truth(virtual_bench)["supply_current"] == pytest.approx(2.0, rel=0.05)


def test_a_motor_whose_wires_come_off_under_current(virtual_bench: VirtualBench, supply: Any) -> None:
    add(virtual_bench, fault="motor_unplugged", at=virtual_bench.clock.now() + 0.5, duration=2.0)
    virtual_bench.clock.sleep(0.4)
    assert truth(virtual_bench)["supply_current"] == pytest.approx(2.0, rel=0.05)
    virtual_bench.clock.sleep(0.2)
    assert truth(virtual_bench)["terminal_currents"] == dict.fromkeys("ABC", 0.0)
    assert truth(virtual_bench)["output_on"] is True
    assert truth(virtual_bench)["supply_voltage"] == pytest.approx(1.5, rel=0.01)
    virtual_bench.clock.sleep(2.0)
    assert truth(virtual_bench)["supply_current"] == pytest.approx(2.0, rel=0.05)


def test_a_motor_whose_wires_come_off_while_the_inverter_turns_it(virtual_bench: VirtualBench) -> None:
    world = virtual_bench.world
    world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
    world.inverter.command_amplitude(3.0)
    world.inverter.command_frequency(40.0)
    world.inverter.enable(True)
    virtual_bench.clock.sleep(3.0)
    assert truth(virtual_bench)["shaft_speed"] == pytest.approx(2.0 * math.pi * 10.0)
    add(virtual_bench, fault="motor_unplugged")
    assert truth(virtual_bench)["inverter_fault"] == "output phase missing"
    virtual_bench.clock.sleep(30.0)
    assert truth(virtual_bench)["shaft_speed"] == 0.0
    assert truth(virtual_bench)["energised"] is False


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_dynamometer_that_runs_away_until_it_is_switched_off(virtual_bench: VirtualBench, way: float) -> None:
    machine = virtual_bench.world.dynamometer
    virtual_bench.world.couple_dynamometer()
    machine.enable(True)
    machine.command(way * 100.0)
    virtual_bench.clock.sleep(1.0)
    add(virtual_bench, fault="speed_runaway", role="dynamometer", speed=300.0)
    virtual_bench.clock.sleep(0.2)
    assert truth(virtual_bench)["shaft_speed"] == pytest.approx(way * 200.0, rel=1e-3)
    machine.command(0.0)
    virtual_bench.clock.sleep(1.0)
    # Whatever it is told, it goes on the way that it went.
    assert truth(virtual_bench)["shaft_speed"] == pytest.approx(way * 300.0, rel=1e-3)
    assert truth(virtual_bench)["dynamometer_command"] == 0.0
    machine.enable(False)
    virtual_bench.clock.sleep(60.0)
    assert truth(virtual_bench)["shaft_speed"] == pytest.approx(0.0, abs=1e-3)


def test_a_runaway_goes_no_further_than_the_machine_can(virtual_bench: VirtualBench) -> None:
    machine = virtual_bench.world.dynamometer
    add(virtual_bench, fault="speed_runaway", role="dynamometer")
    machine.set_mode("torque")
    machine.enable(True)
    virtual_bench.clock.sleep(5.0)
    assert truth(virtual_bench)["dynamometer_speed"] == pytest.approx(machine.machine.maximum_speed, rel=1e-3)
    assert truth(virtual_bench)["shaft_speed"] == 0.0
    assert truth(virtual_bench)["energised"] is True


@pytest.mark.parametrize("mode", ["frequency", "current"])
def test_an_inverter_that_runs_away(virtual_bench: VirtualBench, mode: Any) -> None:
    world = virtual_bench.world
    world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
    world.inverter.set_mode(mode)
    world.inverter.command_amplitude(5.0)
    world.inverter.command_frequency(20.0)
    world.inverter.command_q_current(0.3)
    world.inverter.enable(True)
    virtual_bench.clock.sleep(3.0 if mode == "frequency" else 0.05)
    before = truth(virtual_bench)["shaft_speed"]
    add(virtual_bench, fault="speed_runaway", role="inverter", speed=100.0)
    virtual_bench.clock.sleep(3.0 if mode == "frequency" else 0.05)
    assert truth(virtual_bench)["shaft_speed"] > 2.5 * before
    if mode == "frequency":
        assert world.inverter.output_frequency() == pytest.approx(100.0 * 4 / (2.0 * math.pi))


def test_a_rotor_that_jams_while_it_is_driven(virtual_bench: VirtualBench) -> None:
    world = virtual_bench.world
    world.couple_dynamometer()
    world.dynamometer.enable(True)
    world.dynamometer.command(100.0)
    virtual_bench.clock.sleep(1.0)
    add(virtual_bench, fault="stuck_rotor", at=2.0, duration=1.0)
    virtual_bench.clock.sleep(1.5)
    assert truth(virtual_bench)["shaft_speed"] == 0.0
    assert world.dynamometer.torque() == pytest.approx(world.dynamometer.machine.maximum_torque)
    virtual_bench.clock.sleep(2.0)
    assert truth(virtual_bench)["shaft_speed"] == pytest.approx(100.0, rel=1e-3)


def test_a_winding_that_overheats_as_a_first_order_lag(virtual_bench: VirtualBench, supply: Any) -> None:
    before = truth(virtual_bench)
    add(virtual_bench, fault="thermal_runaway", temperature=225.0, time_constant=30.0, duration=60.0)
    virtual_bench.clock.sleep(30.0)
    hot = before["winding_temperature"]
    expected = 225.0 + (hot - 225.0) * math.exp(-1.0)
    assert truth(virtual_bench)["winding_temperature"] == pytest.approx(expected, abs=0.01)
    # Copper: the current at a constant voltage falls with the resistance.
    factor = 1.0 + 0.00393 * (expected - hot)
    assert truth(virtual_bench)["supply_current"] == pytest.approx(before["supply_current"] / factor, rel=0.02)
    virtual_bench.clock.sleep(30.0)
    peak = truth(virtual_bench)["winding_temperature"]
    virtual_bench.clock.sleep(600.0)
    assert truth(virtual_bench)["winding_temperature"] < peak - 20.0


def test_a_winding_without_current_overheats_as_well(virtual_bench: VirtualBench, bench_motor: VirtualMotor) -> None:
    add(virtual_bench, fault="thermal_runaway", temperature=125.0, time_constant=10.0)
    virtual_bench.clock.sleep(100.0)
    assert truth(virtual_bench)["winding_temperature"] == pytest.approx(125.0, abs=0.1)
    virtual_bench.world.connect({"A": "lcr_high", "B": "lcr_low"})
    warm = virtual_bench.world.impedance(100.0, 1.0, 0.1).real
    assert warm == pytest.approx(1.0 * (1.0 + 0.00393 * 100.0), rel=0.05)


@pytest.mark.parametrize("role", ["inverter", "dynamometer"])
@pytest.mark.parametrize("reports", ["on", "off"])
def test_drives_that_stay_on(virtual_bench: VirtualBench, role: str, reports: str) -> None:
    world = virtual_bench.world
    add(virtual_bench, fault="stuck_output", role=role, reports=reports)
    if role == "dynamometer":
        drive = virtual_bench.instrument("dynamometer").units[1]
        drive.write(0x2001, [1000])
        drive.write(0x2000, [0b10010])
        virtual_bench.clock.sleep(2.0)
        drive.write(0x0016, [1])
        drive.write(0x2000, [0b01])
        shown = drive.read(0x2101, 3)
        # State and output frequency.
        assert (shown[0] & 0b11, shown[2]) == ((0b11, pytest.approx(1000, abs=2)) if reports == "on" else (0, 0))
    else:
        world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
        face = virtual_bench.instrument("inverter")
        face.write(0x6060, 3)
        face.write(0x2000, 3000)
        face.write(0x60FF, 1000)
        for word in (0x06, 0x07, 0x0F, 0x00):
            face.write(0x6040, word)
        assert (face.read(0x6041) or 0) & 0x6F == (0x27 if reports == "on" else 0x40)
    assert truth(virtual_bench)["energised"] is True
    virtual_bench.injector.clear()
    assert truth(virtual_bench)["energised"] is False
