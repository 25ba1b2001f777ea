"""Transmit PDOs: the bytes by which they are mapped, what a SYNC brings, and everything as it was at the end."""

from collections.abc import Callable
from typing import Any

import pytest
from canopen.sdo.exceptions import SdoAbortedError
from hypothesis import given
from hypothesis import strategies as st

from drivers.interfaces import CommunicationError
from drivers.transport.can.objects import NodeObjects
from drivers.transport.can.process_data import MappedObject, ProcessData

GROUPS = (MappedObject(0x6041, 2), MappedObject(0x606C, 4, True)), (MappedObject(0x6079, 4),)
FOUND = {
    (0x1800, 1): "85 01 00 40", (0x1800, 2): "ff", (0x1A00, 0): "01", (0x1A00, 1): "10 00 41 60", (0x1A00, 2): "00 00 00 00",
    (0x1801, 1): "85 02 00 80", (0x1801, 2): "fe", (0x1A01, 0): "00", (0x1A01, 1): "00 00 00 00",
}  # fmt: skip


class PdoNode:
    """The PDO objects of a node, and the bus on which it answers a SYNC with `frames`; some write may be aborted."""

    def __init__(self) -> None:
        self.values = {place: bytes.fromhex(data) for place, data in FOUND.items()}
        self.written: list[str] = []
        self.refused = -1
        self.frames: dict[int, bytes] = {}
        self.heard: dict[int, Callable[[bytes], None]] = {}

    def upload(self, index: int, subindex: int) -> bytes:
        if (index, subindex) not in self.values:
            raise SdoAbortedError(0x06020000)
        return self.values[index, subindex]

    def download(self, index: int, subindex: int, data: bytes, force_segment: bool = False) -> None:
        self.written.append(f"{index:04X}:{subindex} {data.hex(' ')}")
        if len(self.written) == self.refused:
            raise SdoAbortedError(0x06040041)
        self.values[index, subindex] = data

    def hear(self, identifier: int, take: Callable[[bytes], None]) -> Callable[[], None]:
        self.heard[identifier] = take
        return lambda: self.heard.pop(identifier) and None

    def synchronise(self) -> None:
        for identifier, data in self.frames.items():
            if identifier in self.heard:
                self.heard[identifier](data)


def mapped(node: PdoNode, *groups: Any) -> ProcessData:
    data = ProcessData(NodeObjects(node, "drive"), node)
    data.map(*(groups or GROUPS))
    return data


def test_the_bytes_of_a_mapping_and_of_its_end() -> None:
    node = PdoNode()
    data = mapped(node, GROUPS[0])
    assert node.written == [
        "1800:1 85 01 00 c0",
        "1800:2 01",
        "1A00:0 00",
        "1A00:1 10 00 41 60",
        "1A00:2 20 00 6c 60",
        "1A00:0 02",
        "1800:1 85 01 00 40",
    ]
    node.written.clear()
    data.give_back()
    assert node.written == [
        "1800:1 85 01 00 c0",
        "1800:2 ff",
        "1A00:0 00",
        "1A00:1 10 00 41 60",
        "1A00:0 01",
        "1800:1 85 01 00 40",
    ]
    assert (node.heard, data.mapped) == ({}, ())


@given(st.integers(0, 0xFFFF), st.integers(-(1 << 31), (1 << 31) - 1), st.integers(0, (1 << 32) - 1))
def test_what_a_sync_brings(status: int, velocity: int, voltage: int) -> None:
    node = PdoNode()
    data = mapped(node)
    node.frames = {
        0x185: status.to_bytes(2, "little") + velocity.to_bytes(4, "little", signed=True),
        0x285: voltage.to_bytes(4, "little"),
    }
    assert data.read() == {0x6041: status, 0x606C: velocity, 0x6079: voltage}


@pytest.mark.parametrize("step", range(1, 14))
def test_a_pdo_that_is_refused_at_any_step_is_left_as_it_was(step: int) -> None:
    node = PdoNode()
    node.refused = step
    data = mapped(node)
    expected = (0x6079,) if step <= 7 else (0x6041, 0x606C)
    assert data.mapped == expected
    data.give_back()
    assert {place: value for place, value in node.values.items() if place not in ((0x1A00, 2), (0x1A01, 1))} == {
        place: bytes.fromhex(value) for place, value in FOUND.items() if place not in ((0x1A00, 2), (0x1A01, 1))
    }


def test_frames_that_do_not_come_or_are_cut_short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.transport.can.process_data._TIME", 0.01)
    node = PdoNode()
    data = mapped(node)
    node.frames = {0x185: bytes(6)}
    with pytest.raises(CommunicationError, match="no process data came"):
        data.read()
    node.frames = {0x185: bytes(5), 0x285: bytes(4)}
    with pytest.raises(CommunicationError, match="5 bytes of process data"):
        data.read()


def test_a_node_without_pdos_is_left_alone() -> None:
    node = PdoNode()
    node.values.clear()
    assert mapped(node).mapped == ()
    assert node.written == []
