"""The six-step drive's node on the bus that the inverter's is on."""

import threading
from collections.abc import Iterator
from dataclasses import replace

import can
import canopen
import pytest
from canopen import objectdictionary as od

from sim_instruments.bench import ROLES, VirtualBench
from sim_instruments.faults.line_faults import Fault
from sim_instruments.instruments.errors import DriveErrors, Errors
from sim_instruments.six_step.load import balance_load
from sim_instruments.six_step.machine import virtual_motor
from sim_instruments.six_step.state import Bridge
from tests.sim_instruments.can_client import aborted, remote_node, silence_of
from tests.sim_instruments.motors import SIX_STEP

EXACT = DriveErrors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
TYPES = {
    0x1000: od.UNSIGNED32,
    0x1008: od.VISIBLE_STRING,
    0x2010: od.INTEGER32,
    0x2011: od.UNSIGNED8,
    0x603F: od.UNSIGNED16,
    0x6040: od.UNSIGNED16,
    0x6041: od.UNSIGNED16,
    0x6060: od.INTEGER8,
    0x6061: od.INTEGER8,
    0x606C: od.INTEGER32,
    0x6079: od.UNSIGNED32,
}


def make_bench(errors: DriveErrors = EXACT, seed: int = 1) -> VirtualBench:
    bench = VirtualBench(virtual_motor(SIX_STEP), seed=seed, errors=replace(Errors(), drive=errors), six_step=SIX_STEP)
    bench.world.connect({"A": "drive_1", "B": "drive_2", "C": "drive_3"})
    return bench


@pytest.fixture
def bench() -> Iterator[VirtualBench]:
    with make_bench() as made:
        yield made


@pytest.fixture
def node(bench: VirtualBench) -> Iterator[canopen.RemoteNode]:
    with remote_node(bench.address("drive"), TYPES) as made:
        yield made


def run(node: canopen.RemoteNode) -> None:
    node.sdo[0x6060].raw = -1
    for word in (6, 7, 0xF):
        node.sdo[0x6040].raw = word


def test_the_role_is_there_only_with_a_drive(bench: VirtualBench) -> None:
    assert tuple(bench.addresses()) == (*ROLES, "drive")
    inverter, drive = bench.address("inverter"), bench.address("drive")
    assert isinstance(inverter, dict)
    assert isinstance(drive, dict)
    assert (inverter["channel"], inverter["node_id"]) == (drive["channel"], 5)
    assert drive["node_id"] == 6
    with VirtualBench(virtual_motor(SIX_STEP)) as plain:
        assert "drive" not in plain.addresses()
        with pytest.raises(ValueError, match="'drive' is unknown"):
            plain.address("drive")
        with pytest.raises(ValueError, match="'drive' is unknown"):
            plain.faults("drive")
        with pytest.raises(ValueError, match="'drive' is unknown"):
            plain.instrument("drive")


def test_identity(node: canopen.RemoteNode) -> None:
    assert node.sdo[0x1000].raw == 0x00020192
    assert node.sdo[0x1008].raw == "Virtual six-step drive"
    assert node.sdo.upload(0x1018, 2) == (0x403).to_bytes(4, "little")


def test_the_way_up_and_down(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    node.sdo[0x6060].raw = -1
    assert node.sdo[0x6061].raw == -1
    states = [node.sdo[0x6041].raw]
    for word in (6, 7, 0xF, 7, 6, 0):
        node.sdo[0x6040].raw = word
        states.append(node.sdo[0x6041].raw)
        assert bench.world.truth()["six_step_enabled"] is (word == 0xF)
    assert states == [0x250, 0x231, 0x233, 0x237, 0x233, 0x231, 0x250]


def test_readings_of_a_loaded_motor(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    world = bench.world
    world.couple_dynamometer()
    run(node)
    machine = world.dynamometer.machine
    world.dynamometer.set_mode("torque")
    world.dynamometer.command(-0.5 + machine.coulomb_friction + machine.viscous_friction * 340.5)
    world.dynamometer.enable(True)
    bench.clock.sleep(3.0)
    # Three seconds of physics take longer on a busy machine than the client waits for a reply.
    bench.world.truth()
    model = balance_load(Bridge(SIX_STEP), 0.5)
    assert node.sdo[0x606C].raw == pytest.approx(21678 * 600, abs=1200)
    assert node.sdo[0x2010].raw == pytest.approx(1000 * model.average_supply_current, rel=1e-3)
    assert node.sdo[0x6079].raw == pytest.approx(1000 * model.average_bus_voltage, rel=1e-4)
    seen = set()
    for _ in range(60):
        seen.add(node.sdo[0x2011].raw)
    assert seen == {1, 2, 3, 4, 5, 6}


def test_bytes_on_the_bus(bench: VirtualBench) -> None:
    address = bench.address("drive")
    assert isinstance(address, dict)
    with can.Bus(interface=address["interface"], channel=address["channel"]) as bus:

        def exchange(request: str) -> str:
            bus.send(can.Message(arbitration_id=0x606, data=bytes.fromhex(request), is_extended_id=False))
            while (reply := bus.recv(1.0)) is not None:
                if reply.arbitration_id == 0x586:
                    return reply.data.hex(" ")
            return ""

        assert exchange("40 00 10 00 00 00 00 00") == "43 00 10 00 92 01 02 00"
        # 24.320 V on an idle bus is 5F00h mV.
        assert exchange("40 79 60 00 00 00 00 00") == "43 79 60 00 00 5f 00 00"
        assert exchange("40 10 20 00 00 00 00 00") == "43 10 20 00 00 00 00 00"
        # At an angle of 0 the state is T2T3 of a delta: H1 and H2.
        assert exchange("40 11 20 00 00 00 00 00") == "4f 11 20 00 03 00 00 00"
        assert exchange("2f 60 60 00 ff 00 00 00") == "60 60 60 00 00 00 00 00"
        assert exchange("40 61 60 00 00 00 00 00") == "4f 61 60 00 ff 00 00 00"
        assert exchange("2b 40 60 00 06 00 00 00") == "60 40 60 00 00 00 00 00"
        assert exchange("40 41 60 00 00 00 00 00") == "4b 41 60 00 31 02 00 00"
        assert exchange("40 02 65 00 00 00 00 00") == "43 02 65 00 00 00 01 00"
        # A mode that it does not have, and a word that only the drive writes.
        assert exchange("2f 60 60 00 03 00 00 00") == "80 60 60 00 30 00 09 06"
        assert exchange("2b 41 60 00 00 00 00 00") == "80 41 60 00 02 00 01 06"


def test_no_other_mode_and_none_while_it_runs(node: canopen.RemoteNode) -> None:
    run(node)
    assert aborted(lambda: setattr(node.sdo[0x6060], "raw", 0)) == 0x08000022
    assert aborted(lambda: setattr(node.sdo[0x6060], "raw", 4)) == 0x06090030
    assert aborted(lambda: setattr(node.sdo[0x6079], "raw", 4)) == 0x06010002


def test_halt_and_quick_stop_switch_the_bridge_off(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    run(node)
    for stop, status in ((0x10F, 0x237), (0x00B, 0x217)):
        node.sdo[0x6040].raw = stop
        assert node.sdo[0x6041].raw == status
        assert bench.world.truth()["six_step_enabled"] is False
        node.sdo[0x6040].raw = 0xF
        assert bench.world.truth()["six_step_enabled"] is True


@pytest.mark.parametrize(
    ("wiring", "locked", "code"),
    [
        ({"A": "drive_1", "B": "drive_2"}, False, 0x7122),
        ({"A": "drive_2", "B": "drive_1", "C": "drive_3"}, False, 0x2310),
        ({"A": "drive_1", "B": "drive_2", "C": "drive_3"}, True, 0x7121),
    ],
)
def test_a_fault_latches_until_an_edge_of_the_reset_bit(
    node: canopen.RemoteNode, bench: VirtualBench, wiring: dict[str, str], locked: bool, code: int
) -> None:
    bench.world.connect(wiring)
    if locked:
        bench.world.lock_rotor()
    run(node)
    assert node.sdo[0x6041].raw == 0x218
    assert node.sdo[0x603F].raw == code
    assert node.sdo.upload(0x1001, 0)[0] & 0x01
    node.sdo[0x6040].raw = 0xF
    assert node.sdo[0x6041].raw == 0x218
    bench.world.connect({"A": "drive_1", "B": "drive_2", "C": "drive_3"})
    bench.world.release_rotor()
    node.sdo[0x6040].raw = 0x80
    assert node.sdo[0x6041].raw == 0x250
    assert node.sdo[0x603F].raw == 0
    run(node)
    assert node.sdo[0x6041].raw == 0x237


def test_a_wire_that_breaks_while_it_runs(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    run(node)
    bench.clock.sleep(0.5)
    bench.world.set_open_phase("C")
    assert node.sdo[0x6041].raw == 0x218
    assert node.sdo[0x2010].raw >= 0


def test_errors_and_noise_of_a_unit() -> None:
    def readings(errors: DriveErrors, seed: int) -> list[int]:
        with make_bench(errors, seed) as bench:
            return [value for _ in range(200) if (value := bench.instrument("drive").read(0x6079)) is not None]

    unit = replace(EXACT, voltage_gain=1e-3, voltage_offset=5e-3, voltage_noise=2e-3)
    seen = readings(unit, 1)
    assert sum(seen) / len(seen) == pytest.approx(24320 * 1.001 + 5, abs=1.0)
    assert len(set(seen)) > 3
    assert seen == readings(unit, 1)
    assert seen != readings(unit, 2)


def test_faults_of_its_own_line(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    bench.faults("drive").add(Fault.on("silence", "read 6041H"))
    with silence_of(node), pytest.raises(canopen.SdoCommunicationError):
        _ = node.sdo[0x6041].raw
    assert node.sdo[0x6041].raw == 0x250
    assert not bench.faults("inverter")


def test_everything_is_closed() -> None:
    before = set(threading.enumerate())
    with make_bench() as bench:
        bench.address("drive")
        assert set(threading.enumerate()) != before
    assert set(threading.enumerate()) == before
