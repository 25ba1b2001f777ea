import threading
from collections.abc import Callable, Iterator

import canopen
import pytest
from canopen import objectdictionary as od

from sim_instruments.bench import VirtualBench
from sim_instruments.faults.line_faults import Fault
from sim_instruments.physics.motor.motor import VirtualMotor
from tests.sim_instruments.can_client import aborted, remote_node, silence_of

TYPES = {
    0x6040: od.UNSIGNED16,
    0x6041: od.UNSIGNED16,
    0x603F: od.UNSIGNED16,
    0x6060: od.INTEGER8,
    0x6061: od.INTEGER8,
    0x60FF: od.INTEGER32,
    0x606C: od.INTEGER32,
    0x6071: od.INTEGER16,
    0x6077: od.INTEGER16,
    0x6078: od.INTEGER16,
    0x6075: od.UNSIGNED32,
    0x2000: od.UNSIGNED32,
    0x1000: od.UNSIGNED32,
    0x1008: od.VISIBLE_STRING,
    0x5FFF: od.UNSIGNED16,
}


@pytest.fixture
def node(virtual_bench: VirtualBench) -> Iterator[canopen.RemoteNode]:
    with remote_node(virtual_bench.address("inverter"), TYPES) as made:
        yield made


@pytest.fixture
def bench(virtual_bench: VirtualBench) -> VirtualBench:
    virtual_bench.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
    return virtual_bench


def enable(node: canopen.RemoteNode) -> None:
    for word in (6, 7, 0xF):
        node.sdo[0x6040].raw = word


def write(node: canopen.RemoteNode, index: int, value: int) -> Callable[[], object]:
    return lambda: setattr(node.sdo[index], "raw", value)


def test_identity(node: canopen.RemoteNode) -> None:
    assert node.sdo[0x1000].raw == 0x00020192
    assert node.sdo[0x1008].raw == "Virtual inverter"
    assert node.sdo.upload(0x1018, 1) == (0x2FF).to_bytes(4, "little")
    assert node.sdo[0x6075].raw == 10_000


def test_the_way_up_and_down(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    states = [node.sdo[0x6041].raw]
    for word in (6, 7, 0xF, 7, 6, 0):
        node.sdo[0x6040].raw = word
        states.append(node.sdo[0x6041].raw)
    assert states == [0x250, 0x231, 0x233, 0x237, 0x233, 0x231, 0x250]


def test_what_the_state_machine_does_not_allow(node: canopen.RemoteNode) -> None:
    for word in (7, 0xF, 2):
        node.sdo[0x6040].raw = word
        assert node.sdo[0x6041].raw == 0x250
    node.sdo[0x6040].raw = 6
    node.sdo[0x6040].raw = 0xF
    assert node.sdo[0x6041].raw == 0x237
    node.sdo[0x6040].raw = 0xB
    assert node.sdo[0x6041].raw == 0x217
    node.sdo[0x6040].raw = 0
    assert node.sdo[0x6041].raw == 0x250


def test_open_loop_frequency(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    node.sdo[0x6060].raw = 3
    assert node.sdo[0x6061].raw == 3
    node.sdo[0x2000].raw = 5000
    enable(node)
    node.sdo[0x60FF].raw = 1_200_000
    bench.clock.sleep(3.0)
    assert node.sdo[0x606C].raw == 1_200_000
    assert node.sdo[0x6041].raw == 0x637
    assert node.sdo[0x6078].raw == pytest.approx(500, abs=5)
    assert bench.world.inverter.output_frequency() == pytest.approx(20.0)
    node.sdo[0x6040].raw = 0x10F
    bench.clock.sleep(3.0)
    assert node.sdo[0x606C].raw == 0
    node.sdo[0x6040].raw = 0
    assert bench.world.truth()["inverter_enabled"] is False


def test_torque_mode(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    node.sdo[0x6060].raw = 4
    enable(node)
    node.sdo[0x6071].raw = -200
    bench.clock.sleep(0.05)
    assert node.sdo[0x6077].raw == pytest.approx(-200, abs=3)
    assert bench.world.truth()["shaft_speed"] < -1.0


def test_aborts(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    assert aborted(lambda: node.sdo[0x5FFF].raw) == 0x06020000
    assert aborted(lambda: node.sdo.upload(0x1018, 9)) == 0x06090011
    assert aborted(write(node, 0x6041, 1)) == 0x06010002
    assert aborted(write(node, 0x6060, 1)) == 0x06090030
    assert aborted(write(node, 0x60FF, 60_000_001)) == 0x06090031
    assert aborted(write(node, 0x60FF, -60_000_001)) == 0x06090032
    assert aborted(write(node, 0x2000, 10_000_000)) == 0x06090031
    assert aborted(lambda: node.sdo.download(0x6040, 0, b"\x06\x00\x00\x00")) == 0x06070010
    assert node.sdo[0x60FF].raw == 0
    node.sdo[0x6060].raw = 3
    enable(node)
    assert aborted(write(node, 0x6060, 4)) == 0x08000022


def test_a_fault_latches_until_an_edge_of_the_reset_bit(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    bench.world.connect({"A": "inverter_u", "B": "inverter_v"})
    node.sdo[0x6060].raw = 3
    node.sdo[0x2000].raw = 1000
    enable(node)
    assert node.sdo[0x6041].raw == 0x218
    assert node.sdo[0x603F].raw == 0xFF00
    assert node.sdo.upload(0x1001, 0) == b"\x81"
    for word in (6, 7, 0xF):
        node.sdo[0x6040].raw = word
        assert node.sdo[0x6041].raw == 0x218
    node.sdo[0x6040].raw = 0x80
    assert node.sdo[0x6041].raw == 0x250
    assert node.sdo[0x603F].raw == 0
    bench.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
    enable(node)
    assert node.sdo[0x6041].raw == 0x237


def test_transfers_take_virtual_time(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    before = bench.clock.now()
    _ = node.sdo[0x6041].raw
    assert bench.clock.now() - before == pytest.approx(2e-3)


def test_faults_of_the_bus(node: canopen.RemoteNode, bench: VirtualBench) -> None:
    faults = bench.faults("inverter")
    faults.add(Fault.on("silence", "read 6041H"))
    with silence_of(node), pytest.raises(canopen.SdoCommunicationError):
        _ = node.sdo[0x6041].raw
    assert node.sdo[0x6041].raw == 0x250
    faults.add(Fault.on("replace", "write 6040H"))
    assert aborted(write(node, 0x6040, 6)) == 0x08000000
    faults.add(Fault.on("half", "read 6041H"))
    with silence_of(node), pytest.raises((canopen.SdoCommunicationError, canopen.SdoAbortedError)):
        _ = node.sdo[0x6041].raw
    before = bench.clock.now()
    faults.add(Fault.on("late", "read 6041H", delay=0.5))
    assert node.sdo[0x6041].raw == 0x250
    assert bench.clock.now() - before == pytest.approx(0.502)


def test_every_bench_has_a_channel_of_its_own(bench_motor: VirtualMotor) -> None:
    before = set(threading.enumerate())
    with VirtualBench(bench_motor) as one, VirtualBench(bench_motor) as two:
        addresses = [bench.address("inverter") for bench in (one, two)]
        assert addresses[0] != addresses[1]
    assert set(threading.enumerate()) == before
