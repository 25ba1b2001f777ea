"""Buses that other processes are on: an slcan gateway, and a multicast group."""

import socket
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import can
import pytest

from drivers.catalogue import Surroundings
from drivers.cia402.options import CanInterlockOptions, Cia402SixStepOptions
from drivers.cia402.power_state import PowerState
from drivers.cia402.six_step import Cia402SixStep
from drivers.interfaces import CommunicationError
from drivers.interlocks.can import CanInterlock
from drivers.transport.can.buses import CanBuses
from drivers.transport.can.listening import LatestFrame
from drivers.transport.can.sockets import keep_to_own_group
from sim_instruments.transports.can.gateway import CanGateway
from sim_instruments.transports.loop_thread import LoopThread
from sim_instruments.transports.tcp_service import TcpService
from tests.drivers.can_bus.conftest import SIX_STEP

CHANNEL = "six-step"
OPTIONS = Cia402SixStepOptions(**SIX_STEP)


@pytest.fixture
def gateway() -> Iterator[tuple[str, ExitStack]]:
    """A gateway's address to the bus that the node is on, and what ends it."""
    with ExitStack() as ending:
        loop = LoopThread("gateway")
        ending.callback(loop.close)
        made = CanGateway(CHANNEL)
        loop.run(made.start())
        ending.callback(lambda: loop.run(made.stop()))
        service = TcpService(made.serve, "127.0.0.1")
        loop.run(service.start())
        ending.callback(lambda: loop.run(service.stop()))
        yield f"can://slcan/socket://127.0.0.1:{service.port}", ending


def test_a_drive_behind_a_gateway(node: Any, clock: Any, gateway: Any) -> None:
    drive = Cia402SixStep.open(f"{gateway[0]}?node=6", OPTIONS, Surroundings(clock), "drive")
    with drive.running():
        assert node.state is PowerState.OPERATION_ENABLED
    assert node.state is PowerState.SWITCH_ON_DISABLED
    drive.close()


def test_an_interlock_behind_a_gateway(gateway: Any) -> None:
    contact = CanInterlock(gateway[0], CanInterlockOptions(frame=0x1A0, byte=0, bit=1), name="door")
    with can.Bus(CHANNEL, interface="virtual") as sender:
        frame = can.Message(arbitration_id=0x1A0, data=b"\x02", is_extended_id=False)
        # One frame alone may come before the adapter is open.
        cycle = sender.send_periodic(frame, 0.01)
        assert contact.closed() is True
        cycle.stop()
        for _ in range(20):
            sender.send(frame)
        sender.send(can.Message(arbitration_id=0x1A0, data=b"\x01", is_extended_id=False))
        while contact.closed():
            pass
        with pytest.raises(CommunicationError, match=r"no frame 0x1A0 for"):
            contact.closed()
    contact.close()


def test_a_gateway_that_hangs_up(node: Any, clock: Any, gateway: Any, capfd: pytest.CaptureFixture[str]) -> None:
    address, ending = gateway
    buses = CanBuses()
    drive = Cia402SixStep.open(f"{address}?node=6", OPTIONS, Surroundings(clock, can_buses=buses), "drive")
    ending.close()
    with pytest.raises(CommunicationError, match="no usable reply"):
        drive.hall_state()
    with pytest.raises(CommunicationError, match=r"cannot be opened at .*refused"):
        drive._node._connection.reopen()
    drive.close()
    assert capfd.readouterr().err == ""


def test_an_interlock_whose_gateway_hangs_up(gateway: Any) -> None:
    address, ending = gateway
    contact = CanInterlock(address, CanInterlockOptions(frame=0x1A0, byte=0, bit=1), name="door")
    ending.close()
    with pytest.raises(CommunicationError, match="door: the bus fails"):
        contact.closed()
    contact.close()
    with pytest.raises(CommunicationError, match="the bus is closed"):
        contact.closed()


def test_a_frame_that_is_too_old_says_nothing() -> None:
    frames = LatestFrame()
    frames.on_message_received(can.Message(arbitration_id=0x1A0, data=b"\x02"))
    assert frames.take(0.0) is None
    frames.on_message_received(can.Message(arbitration_id=0x1A0, data=b"\x02"))
    assert frames.take(60.0) == b"\x02"
    assert frames.take(0.0) is None


def test_a_bit_rate_that_no_adapter_has(clock: Any, gateway: Any) -> None:
    with pytest.raises(CommunicationError, match="Invalid bitrate, choose one of"):
        Cia402SixStep.open(f"{gateway[0]}?node=6&bitrate=123", OPTIONS, Surroundings(clock), "drive")


class GroupMember:
    """A socket in a multicast group of the loopback interface, as python-can's `udp_multicast` has it."""

    def __init__(self, group: str, port: int = 0) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.bind(("", port))
        loopback = socket.inet_aton("127.0.0.1")
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + loopback)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, loopback)
        self.socket.settimeout(5.0)

    def fileno(self) -> int:
        return self.socket.fileno()


def test_a_multicast_bus_hears_its_own_group_only() -> None:
    first = GroupMember("239.74.1.1")
    port = first.socket.getsockname()[1]
    other = GroupMember("239.74.1.2", port)
    with first.socket, other.socket:
        keep_to_own_group(first)  # type: ignore[arg-type]
        first.socket.sendto(b"the other group's", ("239.74.1.2", port))
        first.socket.sendto(b"its own", ("239.74.1.1", port))
        assert first.socket.recv(64) == b"its own"
