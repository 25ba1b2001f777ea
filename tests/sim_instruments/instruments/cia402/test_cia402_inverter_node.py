"""The simulated inverter's node as masters that know the standard meet it, and as its data sheet describes it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

from drivers.catalogue import Surroundings
from drivers.cia402.inverter import Cia402Inverter
from drivers.cia402.options import Cia402Options
from drivers.cia402.stated_objects import StatedObject
from drivers.interfaces import ReportedError
from drivers.transport.can.buses import CanBuses
from sim_instruments.bench import VirtualBench
from sim_instruments.physics.motor.motor import VirtualMotor
from tests.sim_instruments.can_client import aborted

SHEET = Path(__file__).parents[4] / "docs/examples/virtual-inverter.eds"
OPTIONS = Cia402Options(
    maximum_current=20.0,
    maximum_frequency=500.0,
    current_scale=1.0,
    pole_pairs=1,
    heartbeat_time=0.0,
    field_current=StatedObject("0x2000:00", "u32", 1e-3),
    eds=str(SHEET),
)


@pytest.fixture
def master(virtual_bench: VirtualBench) -> Iterator[BaseNode402]:
    """canopen's own node of the profile, which knows the drive by its data sheet alone."""
    virtual_bench.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
    address: Any = virtual_bench.address("inverter")
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.05
    network.connect(interface=address["interface"], channel=address["channel"])
    node = BaseNode402(address["node_id"], str(SHEET))
    network.add_node(node)
    yield node
    network.disconnect()


@pytest.fixture
def driven(bench_motor: VirtualMotor) -> Iterator[tuple[VirtualBench, Cia402Inverter]]:
    with VirtualBench(bench_motor, sockets=False) as bench:
        bench.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
        address: Any = bench.address("inverter")
        place = f"can://{address['interface']}/{address['channel']}?node={address['node_id']}"
        buses = CanBuses(bench)
        inverter = Cia402Inverter.open(place, OPTIONS, Surroundings(bench.clock, can_buses=buses), "inverter")
        yield bench, inverter
        inverter.close()


def test_canopens_own_master_drives_it_through_the_state_machine(
    master: BaseNode402, virtual_bench: VirtualBench
) -> None:
    master.nmt.state = "PRE-OPERATIONAL"
    master.setup_402_state_machine()
    master.nmt.state = "OPERATIONAL"
    assert master.state == "SWITCH ON DISABLED"
    assert not master.is_op_mode_supported("PROFILED POSITION")
    master.op_mode = "PROFILED VELOCITY"
    assert master.op_mode == "PROFILED VELOCITY"
    master.state = "OPERATION ENABLED"
    assert virtual_bench.world.truth()["inverter_enabled"] is True
    for state in ("SWITCHED ON", "READY TO SWITCH ON", "SWITCH ON DISABLED"):
        master.state = state
        assert master.state == state
    virtual_bench.instrument("inverter")._power.trip(0x2310)
    assert master.is_faulted()
    master.reset_from_fault()
    assert master.state == "OPERATION ENABLED"
    codes = [(one.code, one.register) for one in master.emcy.log]
    assert codes == [(0x2310, 0b11), (0, 0)]
    master.state = "SWITCH ON DISABLED"


def test_the_data_sheet_is_what_the_node_serves(master: BaseNode402, virtual_bench: VirtualBench) -> None:
    served = virtual_bench._node("inverter")._node.object_dictionary
    watch = {0x1016, 0x6007}  # of a bench on sockets only

    def rows(dictionary: Any) -> dict[tuple[int, int], Any]:
        variables = [
            one for each in dictionary.values() for one in (each.values() if hasattr(each, "values") else [each])
        ]
        return {
            (one.index, one.subindex): (one.name, one.data_type, one.access_type, one.default)
            for one in variables
            if one.index not in watch
        }

    assert rows(master.object_dictionary) == rows(served)
    for index, subindex in rows(served):
        assert master.sdo.upload(index, subindex) or index == 0x1008


def test_its_user_units_limits_and_polarity_act(driven: tuple[VirtualBench, Cia402Inverter]) -> None:
    bench, inverter = driven
    simulated = bench.instrument("inverter")
    with inverter.driving_frequency(-20.0, 3.0):
        assert bench.world.inverter.output_frequency() == pytest.approx(-20.0, abs=0.05)
        assert simulated.read(0x60FF) == -1_200_000
        simulated.write(0x607E, 0x40)
        bench.clock.sleep(5.0)
        assert bench.world.inverter.output_frequency() == pytest.approx(20.0, abs=0.05)
        simulated.write(0x607E, 0)
        # A coarser unit: the limit stays where it was, the target is taken anew.
        simulated.write(0x60A9, 0x00B44700)
        assert simulated.read(0x607F) == 60_000
        assert simulated.read(0x606C) == pytest.approx(1200, abs=2)
    with inverter.driving_current(2.0):
        simulated.write(0x6072, 100)
        simulated.write(0x6071, 500)
        assert simulated.read(0x6041) & 0x800
        assert bench.world.inverter.q_current() == pytest.approx(1.0, rel=0.1)


def test_a_unit_that_it_has_not_is_refused(master: BaseNode402) -> None:
    for code in (0x00B40300, 0x01B44700, 0xF9B44700):
        assert aborted(lambda code=code: master.sdo.download(0x60A9, 0, code.to_bytes(4, "little"))) == 0x06090030


def test_found_and_given_back_and_a_fault_with_its_emergency(driven: tuple[VirtualBench, Cia402Inverter]) -> None:
    bench, inverter = driven
    node = bench._node("inverter")._node
    assert inverter.found_state[0].found == "pre-operational"
    assert node.nmt.state == "OPERATIONAL"

    def trip() -> None:
        with inverter.driving_current(1.0):
            bench.instrument("inverter")._power.trip(0x2310)
            inverter.measure_current()

    with pytest.raises(
        ReportedError, match=r"0x2310 .*; it sent the emergency 0x2310 .*0x1001 = 03 \(generic, current\)"
    ):
        trip()
    inverter.make_safe()
    inverter.close()
    assert node.nmt.state == "PRE-OPERATIONAL"
    assert bench.instrument("inverter").read(0x6060) == 0


def test_a_node_that_boots_anew_is_noticed(driven: tuple[VirtualBench, Cia402Inverter]) -> None:
    bench, inverter = driven

    def boot() -> None:
        with inverter.driving_frequency(1.0, 1.0):
            bench._node("inverter")._node.network.send_message(0x705, b"\x00")
            inverter.set_current(5.0)

    with pytest.raises(ReportedError, match=r"the node has gone to pre-operational \(NMT\) by itself"):
        boot()
    with inverter.driving_current(1.0):
        assert bench._node("inverter")._node.nmt.state == "OPERATIONAL"


@pytest.mark.parametrize("seed", range(6))
def test_whatever_it_was_left_with_it_turns_as_it_is_told(bench_motor: VirtualMotor, seed: int) -> None:
    with VirtualBench(bench_motor, sockets=False, hostile=seed) as bench:
        bench.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
        before = {index: bench.instrument("inverter").read(index) for index in (0x6060, 0x607E, 0x60A9)}
        address: Any = bench.address("inverter")
        place = f"can://{address['interface']}/{address['channel']}?node={address['node_id']}"
        surroundings = Surroundings(bench.clock, can_buses=CanBuses(bench))
        inverter = Cia402Inverter.open(place, OPTIONS, surroundings, "inverter")
        with inverter.driving_frequency(20.0, 3.0):
            assert bench.world.inverter.output_frequency() == pytest.approx(20.0, abs=0.05)
            assert inverter.measure_frequency().value == pytest.approx(20.0, abs=0.05)
        inverter.close()
        assert {index: bench.instrument("inverter").read(index) for index in before} == before
        assert bench.left["inverter"]


def traffic_of(driven: tuple[VirtualBench, Cia402Inverter], call: Any) -> list[str]:
    """Return what a call writes to the node."""
    _, inverter = driven
    said: list[str] = []
    inverter._node.objects._traffic = lambda direction, text: said.append(text) if direction == "write" else None
    call()
    inverter._node.objects._traffic = None
    return said


def test_what_is_measured_comes_by_process_data_and_by_sdo_where_it_does_not(
    driven: tuple[VirtualBench, Cia402Inverter],
) -> None:
    bench, inverter = driven
    node = bench._node("inverter")._node
    row = next(one for one in inverter.found_state if one.query == "0x1800 process data")
    assert row.found == "PDO: 0x6041, 0x606C, 0x6077"
    assert [node.sdo[0x1A00][entry].raw for entry in range(4)] == [3, 0x60410010, 0x606C0020, 0x60770010]
    assert (node.sdo[0x1800][1].raw, node.sdo[0x1800][2].raw) == (0x185, 1)
    with inverter.driving_current(2.0):
        assert traffic_of(driven, inverter.measure_current) == ["SYNC"]
        assert inverter.measure_current().value == pytest.approx(2.0, abs=0.1)
        bench.instrument("inverter")._power.trip(0x2310)
        with pytest.raises(ReportedError, match="0x2310"):
            inverter.measure_current()
        with pytest.raises(ReportedError, match="0x2310"):
            inverter.make_safe()
    # The mapping is lost: what is asked is answered all the same.
    node.nmt.send_command(128)
    assert "read 0x606C:00" in traffic_of(driven, inverter.measure_frequency)
    assert traffic_of(driven, inverter.measure_frequency) == ["read 0x6041:00", "read 0x606C:00"]
    inverter.close()
    assert [node.sdo[0x1800][1].raw, node.sdo[0x1A00][0].raw] == [0x80000185, 0]


def test_what_a_pdo_does_not_take(master: BaseNode402) -> None:
    sdo = master.sdo
    assert aborted(lambda: setattr(sdo[0x1A00][1], "raw", 0x60FF0020)) == 0x06040041
    for entry in (1, 2, 3):
        sdo[0x1A00][entry].raw = 0x606C0020
    assert aborted(lambda: setattr(sdo[0x1A00][0], "raw", 3)) == 0x06040042
    assert aborted(lambda: setattr(sdo[0x1800][1], "raw", 0x80000186)) == 0x06090030
    sdo[0x1A00][0].raw = 2
    sdo[0x1800][1].raw = 0x185
    assert aborted(lambda: setattr(sdo[0x1A00][0], "raw", 0)) == 0x06010000


def test_canopens_own_master_drives_it_by_process_data(master: BaseNode402) -> None:
    master.nmt.state = "PRE-OPERATIONAL"
    master.tpdo.read()
    status = master.tpdo[1]
    status.clear()
    for name in ("Statusword", "Modes of operation display"):
        status.add_variable(name)
    status.trans_type, status.enabled = 1, True
    status.save()
    master.setup_402_state_machine()
    master.nmt.state = "OPERATIONAL"
    master.network.sync.start(0.005)
    try:
        assert status.wait_for_reception(30.0)
        assert master.tpdo_values[0x6041] == 0x250
        master.state = "OPERATION ENABLED"
        assert master.tpdo_values[0x6041] == 0x237
        master.state = "SWITCH ON DISABLED"
    finally:
        master.network.sync.stop()
