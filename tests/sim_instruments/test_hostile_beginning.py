"""A bench that begins as a last user may have left it."""

import re

import canopen
import pytest
import pyvisa

from drivers.catalogue import Surroundings
from drivers.keysight.options import Keysight34970AOptions
from drivers.keysight.switch_unit_34970a import Keysight34970A
from sim_instruments.bench import VirtualBench
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.server.served_bench import ServedBench
from tests.sim_instruments.can_client import aborted, remote_node
from tests.sim_instruments.transports.can.test_bus import TYPES

SCPI = ("supply", "lcr_meter", "oscilloscope", "voltmeter", "insulation_tester", "switch_matrix")


def states(motor: VirtualMotor, hostile: int | None) -> dict[str, tuple[str, ...]]:
    with VirtualBench(motor, sockets=False, fixture=True, hostile=hostile) as bench:
        for role in bench.roles:
            bench.address(role)
            bench.instrument(role)
        return bench.left


def test_without_it_nothing_is_left(bench_motor: VirtualMotor) -> None:
    assert states(bench_motor, None) == {}


def test_a_seed_decides_the_state(bench_motor: VirtualMotor) -> None:
    assert states(bench_motor, 3) == states(bench_motor, 3)
    assert states(bench_motor, 3) != states(bench_motor, 4)
    assert set(states(bench_motor, 3)) >= {*SCPI, "dynamometer", "inverter", "rotor_actuator"}


@pytest.mark.parametrize("role", SCPI)
def test_every_message_of_a_table_is_one_that_the_instrument_takes(bench_motor: VirtualMotor, role: str) -> None:
    with VirtualBench(bench_motor, sockets=False, fixture=True) as bench:
        instrument = bench.instrument(role)
        assert isinstance(instrument, ScpiInstrument)
        for message in (message for row in instrument.leftovers for message in row if message):
            instrument.write(b"*CLS\n" + message.encode() + b"\nSYST:ERR?\n")
            assert re.match(rb'\+?0,"?No [Ee]rror', instrument.read(100, 1.0)[0]), message
            if role == "insulation_tester":
                instrument.write(b"MANU:EDIT:MODE IR\n")


@pytest.mark.parametrize("seed", range(8))
def test_what_is_left_is_what_the_instrument_says(bench_motor: VirtualMotor, seed: int) -> None:
    with VirtualBench(bench_motor, sockets=False, hostile=seed) as bench:
        meter = bench.instrument("lcr_meter")
        meter.write(b"INIT:CONT?;:DISP:PAGE?;:SYST:ERR?\n")
        continuous, page, error = meter.read(100, 1.0)[0].decode().strip().split(";")
        assert continuous == ("0" if "INIT:CONT OFF" in bench.left["lcr_meter"] else "1")
        pages = [message for message in bench.left["lcr_meter"] if message.startswith("DISP:PAGE")]
        assert page == (pages[0].split(";")[0].split()[1] if pages else "MEAS")
        assert error == '+0,"No error"'


def test_relays_that_nobody_opened_are_told_and_open_before_others_close(bench_motor: VirtualMotor) -> None:
    with VirtualBench(bench_motor, sockets=False, fixture=True, hostile=1) as bench:
        address, options = bench.address("switch_matrix"), Keysight34970AOptions(bench.crosspoints)
        surroundings = Surroundings(bench.clock, lambda: pyvisa.ResourceManager(bench.visa_library))
        matrix = Keysight34970A.open(str(address), options, surroundings, "switch_matrix")
        (told,) = matrix.found_state
        assert bench.left["switch_matrix"] == ("ROUT:CLOS (@111,122)", "ROUT:CLOS (@133)", "ROUT:CLOS (@601)")
        assert (told.query, told.found) == ("ROUT:CLOS?", "A:supply+, B:supply-, C:lcr_high, leads:short")
        matrix.connect(["A:lcr_high", "B:lcr_low"])
        assert matrix.closed() == {"A:lcr_high", "B:lcr_low"}
        matrix.close()


def test_a_served_bench_begins_so_too(bench_motor: VirtualMotor) -> None:
    with ServedBench(bench_motor, hostile=2) as served:
        assert set(served.bench.left) >= {"lcr_meter", "oscilloscope", "dynamometer", "inverter"}
        in_process = states(bench_motor, 2)
        assert served.bench.left["dynamometer"] == in_process["dynamometer"]


def test_over_many_seeds_each_state_comes(bench_motor: VirtualMotor) -> None:
    seen: set[str] = set()
    for seed in range(60):
        with VirtualBench(bench_motor, sockets=False, hostile=seed) as bench:
            bench.instrument("lcr_meter")
            seen.update(bench.left["lcr_meter"])
    assert seen >= {"INIT:CONT OFF", "TRIG:SOUR HOLD", "AMPL:ALC ON", "CORR:LENG 4", "CORR:LOAD:STAT ON", "FORM REAL"}


def test_a_node_in_pre_operational_is_enabled_only_once_it_has_been_started(bench_motor: VirtualMotor) -> None:
    with VirtualBench(bench_motor, hostile=1) as bench:
        bench.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
        with remote_node(bench.address("inverter"), TYPES) as node:
            assert node.sdo[0x1008].raw == "Virtual inverter"
            node.sdo[0x6040].raw = 6
            node.sdo[0x6040].raw = 7
            assert aborted(lambda: setattr(node.sdo[0x6040], "raw", 0xF)) == 0x08000022
            started(node)
            node.sdo[0x6040].raw = 0xF
            assert node.sdo[0x6041].raw & 0x6F == 0x27


def started(node: canopen.RemoteNode) -> None:
    """Send NMT start of this node, 000h: 01h and its identifier; the reply to a request comes after it has been taken."""
    node.network.send_message(0, [0x01, node.id])
    assert node.sdo[0x1000].raw == 0x00020192
