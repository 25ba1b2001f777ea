"""The registers or objects of a simulated instrument that a driver writes, read without the driver."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, cast

from bench.testing.conformance.stand import OneInstrumentBench

Held = Callable[[], Mapping[str, Any]]
#: How long (s) a node may take on a busy computer.
_PATIENCE = 10.0
#: How often (s) its thread looks whether it shall end.
_LOOK = 0.02


@contextmanager
def held_settings(made: OneInstrumentBench, writes: Sequence[str]) -> Iterator[Held]:
    """Give what returns the present value of each setting, by the message ("write 1 0902H 1") that writes it (Modbus, CAN)."""
    if made.transport == "modbus":
        yield lambda: {message: _registers(made, message) for message in writes}
        return
    import can
    import canopen

    address = made.bench.address(made.subject.role.value)
    assert not isinstance(address, str)  # noqa: S101  of a node it is none
    network: Any = canopen.Network(can.Bus(interface=str(address["interface"]), channel=str(address["channel"])))
    network.NOTIFIER_CYCLE = _LOOK
    network.connect()
    try:
        node = network.add_node(int(address["node_id"]), cast("Any", canopen).ObjectDictionary())
        node.sdo.RESPONSE_TIMEOUT = _PATIENCE
        yield lambda: {message: _object(node, message) for message in writes}
    finally:
        network.disconnect()


def _registers(made: OneInstrumentBench, message: str) -> tuple[int, ...]:
    _, unit, address, count = message.split()
    return tuple(made.simulated.units[int(unit)].read(int(address[:4], 16), int(count)))


def _object(node: Any, message: str) -> bytes:
    _, index, subindex = message.split()
    return bytes(node.sdo.upload(int(index[:4], 16), int(subindex)))
