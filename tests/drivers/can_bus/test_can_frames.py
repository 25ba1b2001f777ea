"""Whatever frames a CAN bus delivers, and whatever stands as an address: instrument errors come out, or values."""

import contextlib
import string
from collections.abc import Callable

import canopen
import pytest
from canopen.sdo import SdoClient
from hypothesis import given
from hypothesis import strategies as st

from drivers.cia402.options import Cia402SixStepOptions
from drivers.cia402.power_state import PowerStateMachine
from drivers.cia402.watchdog import HeartbeatWatchdog
from drivers.interfaces import CommunicationError, InstrumentError, ReportedError
from drivers.transport.can.addresses import parse_address
from drivers.transport.can.objects import ABSENT, NodeObjects
from tests.drivers.can_bus.conftest import SIX_STEP

OBJECTS = (0x1000, 0x1008, 0x1016, 0x6007, 0x6040, 0x6041, 0x6079)
#: Server command specifiers: expedited and segmented uploads, downloads, segments, aborts, and anything else.
COMMANDS = st.sampled_from(
    (0x43, 0x47, 0x4B, 0x4F, 0x41, 0x40, 0x42, 0x60, 0x20, 0x00, 0x10, 0x01, 0x80)
) | st.integers(0, 255)


def frame(command: int, index: int, subindex: int, data: bytes) -> bytes:
    return bytes([command]) + index.to_bytes(2, "little") + bytes([subindex]) + data


FRAMES = st.lists(
    st.builds(frame, COMMANDS, st.sampled_from(OBJECTS), st.integers(0, 2), st.binary(min_size=4, max_size=4))
    | st.binary(max_size=8),
    max_size=8,
)


class OddBus:
    """A bus on which every request is answered by the next of some frames, until there are none."""

    def __init__(self, frames: list[bytes]) -> None:
        self.frames = list(frames)
        self.client = SdoClient(0x606, 0x586, canopen.ObjectDictionary())
        self.client.RESPONSE_TIMEOUT = 0.0005
        self.client.network = self

    def send_message(self, can_id: int, data: bytes) -> None:
        if self.frames:
            self.client.on_response(0x586, self.frames.pop(0), 0.0)


class StillClock:
    """Time that passes only by sleeping."""

    time = 0.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds


class Silence:
    """Takes heartbeats and sends none."""

    def start_heartbeat(self, producer: int, period: float) -> None:
        """Do nothing."""


def power(objects: NodeObjects) -> PowerStateMachine:
    options = Cia402SixStepOptions(**SIX_STEP)
    return PowerStateMachine(objects, StillClock(), timeout=0.05, poll_interval=options.poll_interval)


ACTIONS: tuple[Callable[[NodeObjects], object], ...] = (
    lambda objects: objects.read(0x6041, 0, 2),
    lambda objects: objects.read_text(0x1008, 0),
    lambda objects: objects.read_optional(0x6007, 0, 2, signed=True),
    lambda objects: objects.write(0x6040, 0, 6, 2),
    lambda objects: power(objects).enable(),
    lambda objects: power(objects).disable(),
    lambda objects: HeartbeatWatchdog(objects).arm(1.0, 127, Silence()),
)


@given(FRAMES, st.sampled_from(ACTIONS))
def test_whatever_frames_arrive_only_instrument_errors_come_out(
    frames: list[bytes], action: Callable[[NodeObjects], object]
) -> None:
    with contextlib.suppress(InstrumentError):
        action(NodeObjects(OddBus(frames).client, "drive"))


@given(st.integers(0, 0xFFFFFFFF), st.integers(1, 4))
def test_expedited_numbers_of_every_size(number: int, size: int) -> None:
    reply = frame(0x43 | (4 - size) << 2, 0x6079, 0, number.to_bytes(4, "little"))
    objects = NodeObjects(OddBus([reply]).client, "drive")
    assert objects.read(0x6079, 0, size) == number % (1 << 8 * size)


# The specifier 3 in a frame's first bits confirms a write whatever follows: canopen looks no further.
@given(st.binary(max_size=3).filter(lambda data: not data or data[0] >> 5 != 3))
def test_a_frame_cut_short_is_no_usable_reply(data: bytes) -> None:
    for action in (lambda objects: objects.read(0x6041, 0, 2), lambda objects: objects.write(0x6040, 0, 6, 2)):
        with pytest.raises(CommunicationError, match="no usable reply"):
            action(NodeObjects(OddBus([data]).client, "drive"))


@given(st.integers(0, 0xFFFFFFFF) | st.sampled_from(ABSENT))
def test_every_abort_is_reported_or_means_absence(code: int) -> None:
    objects = NodeObjects(OddBus([frame(0x80, 0x6007, 0, code.to_bytes(4, "little"))]).client, "drive")
    if code in ABSENT:
        assert objects.read_optional(0x6007, 0, 2) is None
    else:
        with pytest.raises(ReportedError, match="SDO abort"):
            objects.read_optional(0x6007, 0, 2)


@given(
    st.text(string.printable, max_size=40)
    | st.text("can:/[]?&=node bitrate0123456789-_%", max_size=40).map("can://".__add__)
)
def test_whatever_stands_as_an_address(text: str) -> None:
    with contextlib.suppress(CommunicationError):
        bus, node = parse_address(text, "drive")
        assert 1 <= node <= 127
        assert bus.interface
        assert bus.channel
        assert bus.bitrate > 0
