"""A node of a CAN bus that answers frames, of CAN FD too, with frames: what has no CANopen."""

from collections.abc import Callable
from typing import Protocol

import can
import numpy as np

from sim_instruments.faults.line_faults import Fault, FaultKind, Faults, spoil
from sim_instruments.scpi.exchange import InstrumentClock
from sim_instruments.transports.can import in_process as can_direct
from sim_instruments.transports.can.buses import INTERFACE, fresh_channel, open_bus
from sim_instruments.transports.connection import Connection

#: A frame of 64 bytes at 1 and 5 Mbit/s either way, and the device's own cycle.
_TRANSFER_TIME = 4.0e-4
_NOTIFIER_CYCLE = 0.05
#: The sizes that a CAN FD frame of more than 8 bytes can have, and what the rest of one is filled with.
_SIZES = (12, 16, 20, 24, 32, 48, 64)
_PADDING = b"\x50"
#: Identifiers above have 29 bits.
_STANDARD = 0x7FF
_BROADCAST, _RESPOND = 0x7F, 0x80
#: Kinds of fault that let the device do what it is asked.
_CARRIED_OUT = (
    FaultKind.FROZEN,
    FaultKind.NOT_A_NUMBER,
    FaultKind.OVERFLOW,
    FaultKind.STALE,
    FaultKind.LATE,
    FaultKind.HALF,
)
#: Kinds of fault that put other bytes into the answer, of which garbage has as many as a short frame.
_SPOILT = (FaultKind.HALF, FaultKind.GARBAGE, FaultKind.REPLACE)
_SHORT = 8
_LARGEST = 3.4e38


class FrameDevice(Protocol):
    """A device whose frames a node passes on.

    An identifier is prefix (13 bits), source (8 bits, the uppermost of which asks for an answer) and destination (8 bits).
    """

    @property
    def node(self) -> int:
        """Return its identifier on the bus."""

    @property
    def prefix(self) -> int:
        """Return the prefix that it listens to."""

    def told(self, frame: bytes) -> str:
        """Return what a frame asks, in words."""

    def understands(self) -> list[str]:
        """Return what it has, a line each."""

    def serve(self, frame: bytes, *, respond: bool, alter: Callable[[str, float], float] | None = None) -> bytes | None:
        """Do what a frame asks and return the answer, None where there is none; `alter` changes readings by their names."""


class FrameNode:
    """Serves a device's frames. Every exchange takes 0.4 ms of bench time.

    Faults see requests as the device tells them. While its connection is out the node is off the bus: it hears and says nothing, and
    does what it did before. On a `direct` bus it answers on the sender's thread.
    """

    def __init__(
        self,
        device: FrameDevice,
        clock: InstrumentClock,
        generator: np.random.Generator,
        *,
        channel: str | None = None,
        direct: can_direct.DirectBus | None = None,
    ) -> None:
        self.faults = Faults()
        self.connection = Connection()
        self._device = device
        self._clock = clock
        self._random = generator
        self._held: can.Message | None = None
        self._notifier: can.Notifier | None = None
        self._bus: can.BusABC
        if direct is None:
            self._interface, self._channel = INTERFACE, channel or fresh_channel()
            self._bus = open_bus(self._channel)
            self._notifier = can.Notifier(self._bus, [self._hear], timeout=_NOTIFIER_CYCLE)
        else:
            self._interface, self._channel = can_direct.INTERFACE, can_direct.CHANNEL
            end = direct.end()
            end.hand_over(self._hear)
            self._bus = end

    @property
    def address(self) -> dict[str, str | int]:
        """Return interface and channel of python-can, and the node's identifier."""
        return {"interface": self._interface, "channel": self._channel, "node_id": self._device.node}

    def close(self) -> None:
        """Leave the bus and end its thread; again is allowed."""
        if self._notifier is not None:
            self._notifier.stop()
            self._notifier = None
        self._bus.shutdown()

    def _hear(self, message: can.Message) -> None:
        prefix, source, destination = (
            message.arbitration_id >> 16,
            message.arbitration_id >> 8 & 0xFF,
            message.arbitration_id & 0xFF,
        )
        mine = prefix == self._device.prefix and destination in (self._device.node, _BROADCAST)
        if not mine or not self.connection.up or message.is_remote_frame or message.is_error_frame:
            return
        # The client waits for its reply, so sleeping here is sleeping on its behalf.
        self._clock.sleep(_TRANSFER_TIME)
        data = bytes(message.data)
        if not self.faults:
            # Mended: what was held back is lost, and the replies are in step again.
            self._held = None
        fault = self.faults.strike(self._device.told(data)) if self.faults else None
        if fault is not None and fault.kind is FaultKind.LATE:
            self._clock.sleep(fault.delay)
        respond = bool(source & _RESPOND)
        answer: bytes | None = None
        if fault is None or fault.kind in _CARRIED_OUT:
            answer = self._device.serve(data, respond=respond, alter=_altering(fault))
        if fault is not None and fault.kind in _SPOILT:
            answer = spoil(fault, answer or bytes(_SHORT), self._random) if respond else None
        if answer is None:
            return
        reply = self._frame(answer, source & ~_RESPOND, message)
        if fault is not None and fault.kind is FaultKind.STALE and self._held is None:
            self._held = reply
            return
        if self._held is not None:
            reply, self._held = self._held, reply
        self._bus.send(reply)

    def _frame(self, answer: bytes, client: int, request: can.Message) -> can.Message:
        size = next((size for size in _SIZES if len(answer) <= size), _SIZES[-1]) if len(answer) > 8 else len(answer)
        identifier = self._device.prefix << 16 | self._device.node << 8 | client
        return can.Message(
            arbitration_id=identifier,
            is_extended_id=identifier > _STANDARD,
            is_fd=request.is_fd or size > 8,
            bitrate_switch=request.bitrate_switch,
            data=answer.ljust(size, _PADDING),
        )


def _altering(fault: Fault | None) -> Callable[[str, float], float] | None:
    """Return what a fault does to readings, None where it does nothing to them."""
    if fault is None:
        return None
    match fault.kind:
        case FaultKind.FROZEN:
            return lambda name, value: float(fault.remembered(name, repr(value).encode()))
        case FaultKind.NOT_A_NUMBER:
            return lambda _, __: float("nan")
        case FaultKind.OVERFLOW:
            return lambda _, __: _LARGEST
        case _:
            return None
