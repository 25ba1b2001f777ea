"""Objects of a node: numbers of a stated size, and errors that name the object."""

import pytest
from canopen.sdo.exceptions import SdoCommunicationError
from hypothesis import given
from hypothesis import strategies as st

from drivers.interfaces import CommunicationError
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
