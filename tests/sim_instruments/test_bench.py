import os
import threading

import numpy as np
import pytest
import pyvisa

from sim_instruments.bench import ROLES, VirtualBench
from sim_instruments.catalogue import SimulatedUnit, find
from sim_instruments.instruments.errors import Errors, ScopeErrors, SupplyErrors
from sim_instruments.physics.motor.motor import VirtualMotor


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def reading(motor: VirtualMotor, seed: int) -> str:
    with VirtualBench(motor, seed=seed) as bench:
        bench.world.lock_rotor()
        bench.world.connect({"A": "lcr_high", "B": "lcr_low"})
        bridge = pyvisa.ResourceManager(bench.visa_library).open_resource(str(bench.address("lcr_meter")))
        return str(bridge.query("FUNC:IMP LSRS;:FORM:ASC:LONG ON;:TRIG:SOUR BUS;:TRIG;:FETC?"))


def test_addresses_of_every_role(virtual_bench: VirtualBench) -> None:
    addresses = virtual_bench.addresses()
    assert tuple(addresses) == ROLES
    assert addresses["supply"] == "TCPIP0::supply::inst0::INSTR"
    assert addresses["lcr_meter"] == "TCPIP0::lcr-meter::inst0::INSTR"
    assert addresses["oscilloscope"] == "TCPIP0::oscilloscope::inst0::INSTR"
    assert str(addresses["dynamometer"]).startswith("tcp://127.0.0.1:")
    assert os.path.exists(str(addresses["tachometer"]))
    inverter = addresses["inverter"]
    assert isinstance(inverter, dict)
    assert (inverter["interface"], inverter["node_id"]) == ("virtual", 5)
    assert virtual_bench.addresses() == addresses
    assert tuple(virtual_bench.instruments) == ROLES


def test_unknown_roles_are_named(virtual_bench: VirtualBench) -> None:
    with pytest.raises(ValueError, match="'thermometer' is unknown"):
        virtual_bench.address("thermometer")
    with pytest.raises(ValueError, match="'thermometer' is unknown"):
        virtual_bench.faults("thermometer")


def test_every_line_has_faults_of_its_own(virtual_bench: VirtualBench) -> None:
    faults = [virtual_bench.faults(role) for role in ROLES]
    assert len({id(entry) for entry in faults}) == len(ROLES)


def test_a_seed_decides_every_noise(bench_motor: VirtualMotor) -> None:
    assert reading(bench_motor, 1) == reading(bench_motor, 1)
    assert reading(bench_motor, 1) != reading(bench_motor, 2)


def test_nothing_starts_before_it_is_asked_for_and_all_is_closed(bench_motor: VirtualMotor) -> None:
    threads, files = threading.active_count(), descriptors()
    with VirtualBench(bench_motor) as bench:
        assert (threading.active_count(), descriptors()) == (threads, files)
        bench.addresses()
        manager = pyvisa.ResourceManager(bench.visa_library)
        manager.open_resource(str(bench.address("supply")))
        assert threading.active_count() > threads
    assert (threading.active_count(), descriptors()) == (threads, files)
    bench.clock.sleep(5.0)


def test_closing_after_an_error(bench_motor: VirtualMotor) -> None:
    threads = threading.active_count()

    def fail() -> None:
        with VirtualBench(bench_motor, line="rtu") as bench:
            bench.addresses()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert threading.active_count() == threads


def test_healthy_units_are_far_better_than_drawn_ones() -> None:
    healthy = Errors()
    drawn = [Errors.drawn(np.random.default_rng(seed)) for seed in range(200)]
    assert abs(healthy.supply.voltage_gain) < np.std([unit.supply.voltage_gain for unit in drawn])
    channels = np.array([unit.oscilloscope.reference + np.array(unit.oscilloscope.gain) for unit in drawn])
    assert np.abs(channels).max() <= 0.02
    assert np.std(channels) == pytest.approx(0.0133, rel=0.15)
    # The reference is common: the channels' mean is not much better than one of them.
    assert np.std(channels.mean(axis=1)) > 0.8 * np.std(channels)
    assert max(abs(share) for unit in drawn for share in unit.lcr_meter.share) <= 1.0
    assert max(abs(unit.dynamometer.torque_gain) for unit in drawn) <= 2e-3
    assert max(abs(unit.tachometer.gain) for unit in drawn) <= 5e-4
    assert Errors.drawn(np.random.default_rng(1)) == Errors.drawn(np.random.default_rng(1))
    assert isinstance(drawn[0].supply, SupplyErrors)
    assert isinstance(drawn[0].oscilloscope, ScopeErrors)


def test_two_units_share_no_name_and_the_shaft_has_one_machine(bench_motor: VirtualMotor) -> None:
    supply, dynamometer = SimulatedUnit(find("keysight-e36313a")), find("delta-dyn200")
    with pytest.raises(ValueError, match="two units share a name among supply, supply"):
        VirtualBench(bench_motor, [supply, supply])
    units = [SimulatedUnit(dynamometer), SimulatedUnit(dynamometer, name="other")]
    refused = pytest.raises(ValueError, match=r"other: one dynamometer is on the shaft already \(dynamometer\)")
    with VirtualBench(bench_motor, units, sockets=False) as bench, refused:
        bench.instrument("other")


def test_a_supply_that_is_not_connected_feeds_nothing(bench_motor: VirtualMotor) -> None:
    units = [SimulatedUnit(find("keysight-e36313a")), SimulatedUnit(find("keysight-e36313a"), name="spare")]
    with VirtualBench(bench_motor, units, sockets=False) as bench:
        bench.world.connect({"A": "supply+", "B": "supply-"})
        spare = bench.instrument("spare")
        spare.write(b"VOLT 3;:OUTP ON;:MEAS:VOLT?\n")
        assert float(spare.read(100, 1.0)[0]) == pytest.approx(3.0, abs=0.01)
        assert not bench.world.supply.is_on


def test_an_unknown_simulated_instrument_lists_those_there_are() -> None:
    with pytest.raises(LookupError, match="there is no simulated instrument 'x'; there are cia402-inverter"):
        find("x")
