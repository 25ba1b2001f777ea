"""Objects of a node: numbers of a stated size, and errors that name the object."""

import struct
from collections.abc import Iterator

import canopen
import pytest
from canopen.sdo import SdoClient
from canopen.sdo.exceptions import SdoCommunicationError
from hypothesis import given
from hypothesis import strategies as st

from drivers.interfaces import CommunicationError, ReportedError
from drivers.transport.can.objects import NodeObjects


class OddNode:
    """A node that answers with arbitrary bytes."""

    def __init__(self, data: bytes) -> None:
        self.data = data

    def upload(self, index: int, subindex: int) -> bytes:
        return self.data

    def download(self, index: int, subindex: int, data: bytes, force_segment: bool = False) -> None:
        raise SdoCommunicationError("No SDO response received")


@given(st.binary(max_size=8))
def test_objects_of_another_size_are_refused(data: bytes) -> None:
    objects = NodeObjects(OddNode(data), "inverter")
    if len(data) == 2:
        assert objects.read(0x6041, 0, 2) == int.from_bytes(data, "little")
    else:
        with pytest.raises(CommunicationError, match=r"read 0x6041:00': \d bytes instead of 2"):
            objects.read(0x6041, 0, 2)
    assert isinstance(objects.read_text(0x1008, 0), str)
    with pytest.raises(CommunicationError, match="No SDO response"):
        objects.write(0x6040, 0, 6, 2)
    with pytest.raises(ValueError, match="does not fit 2 bytes of 0x6071:00"):
        objects.write(0x6071, 0, 40_000, 2, signed=True)


class LateNode:
    """A node whose replies come when the script says: for each request, the replies that come before the next."""

    def __init__(self, script: Iterator[tuple[bytes, ...]]) -> None:
        self.requests: list[bytes] = []
        self._script = script
        self.client = SdoClient(0x585, 0x605, canopen.ObjectDictionary())
        self.client.network = self  # type: ignore[assignment]
        self.client.RESPONSE_TIMEOUT = 0.001

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        if data[0] == 0x80:
            # Our own abort of what had no reply.
            return
        self.requests.append(bytes(data))
        for reply in next(self._script):
            self.client.on_response(0x585, bytearray(reply), 0.0)


def _status(value: int) -> bytes:
    return struct.pack("<BHBHxx", 0x4B, 0x6041, 0, value)


_DONE = struct.pack("<BHBxxxx", 0x60, 0x6040, 0)
_OFF = struct.pack("<BHBHxx", 0x2B, 0x6040, 0, 0)


def test_a_reply_that_comes_late_does_not_cost_the_next_command() -> None:
    # The status is asked and not told in time; its reply comes as torque is switched off.
    node = LateNode(iter([(), (_status(0x27),), (_DONE, _DONE), (_status(0x40),)]))
    objects = NodeObjects(node.client, "drive")
    with pytest.raises(CommunicationError, match="No SDO response"):
        objects.read(0x6041, 0, 2)
    objects.write(0x6040, 0, 0, 2)
    assert node.requests[1:] == [_OFF, _OFF]
    assert objects.read(0x6041, 0, 2) == 0x40


def test_a_reply_to_a_run_that_was_killed_does_not_cost_its_guardian_the_first_command() -> None:
    # The status was asked by the run, and is told as the guardian switches off; its own reply comes twice.
    node = LateNode(iter([(_status(0x27), _DONE), (_DONE,), (_status(0x40),)]))
    objects = NodeObjects(node.client, "drive", asked_before=True)
    objects.write(0x6040, 0, 0, 2)
    assert node.requests == [_OFF, _OFF]
    assert objects.read(0x6041, 0, 2) == 0x40


@pytest.mark.parametrize("late", [_status(0x27), struct.pack("<BHBI", 0x80, 0x6041, 0, 0x06020000)])
def test_what_answers_for_another_where_nothing_is_late_is_an_error(late: bytes) -> None:
    node = LateNode(iter([(late,)]))
    with pytest.raises((CommunicationError, ReportedError), match=r"Unexpected response|SDO abort"):
        NodeObjects(node.client, "drive").write(0x6040, 0, 0, 2)
    assert node.requests == [_OFF]
