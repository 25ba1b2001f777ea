"""A CANopen node on a python-can bus in process."""

from collections.abc import Callable
from typing import Any, cast

import can
import canopen
import numpy as np
from canopen import objectdictionary

from sim_instruments.faults.line_faults import Fault, FaultKind, Faults
from sim_instruments.instruments.cia402.power import (
    CONTROL_WORD,
    DEVICE_STATE,
    ObjectEntry,
    ObjectServer,
    SdoError,
    numbered,
)
from sim_instruments.scpi.exchange import InstrumentClock
from sim_instruments.transports.can import in_process as can_direct
from sim_instruments.transports.can.buses import INTERFACE, fresh_channel, open_bus
from sim_instruments.transports.can.process_data import SYNC, TransmitPdos
from sim_instruments.transports.can.watch import ENTRIES, HeartbeatConsumer
from sim_instruments.transports.connection import Connection

# canopen is typed in parts only.
od: Any = objectdictionary

_TYPES = {
    "i8": od.INTEGER8,
    "u8": od.UNSIGNED8,
    "i16": od.INTEGER16,
    "u16": od.UNSIGNED16,
    "i32": od.INTEGER32,
    "u32": od.UNSIGNED32,
    "text": od.VISIBLE_STRING,
}
# Request and reply of 8 bytes each at 250 kbit/s, and the drive's own cycle.
_TRANSFER_TIME = 2.0e-3
_NOTIFIER_CYCLE = 0.05
_GENERAL_ERROR = 0x08000000
_BOOT_UP, _HEARTBEAT = 0, 0x700
#: The command of NMT, and the bits of the controlword that enable operation.
_PRE_OPERATIONAL, _ENABLE = 128, 0b1111
#: Kinds of fault that change what an object reads as, or when its reply comes, not its frame.
_ANSWERED = (FaultKind.FROZEN, FaultKind.NOT_A_NUMBER, FaultKind.OVERFLOW, FaultKind.STALE)


class CanNode:
    """Serves a drive's object dictionary by SDO. Every transfer takes 2 ms of virtual time.

    Faults see requests as "read 6041H 0" and "write 6040H 0"; garbage and half a reply are a frame that no client
    can use, a replaced one is an abort. While its connection is out the node is off the bus: it hears and says nothing,
    and does what it did before. On a `direct` bus it answers on the sender's thread.
    """

    def __init__(
        self,
        device: ObjectServer,
        clock: InstrumentClock,
        generator: np.random.Generator,
        *,
        node_id: int = 5,
        channel: str | None = None,
        direct: can_direct.DirectBus | None = None,
    ) -> None:
        self.faults = Faults()
        self.connection = Connection()
        self._device = device
        self._clock = clock
        self._random = generator
        if direct is None:
            self._interface, self._channel = INTERFACE, channel or fresh_channel()
        else:
            self._interface, self._channel = can_direct.INTERFACE, can_direct.CHANNEL
        self._node_id = node_id
        # In process nobody can die and leave the drive on: it has no watch there.
        mappable = {entry.index for entry in device.entries if entry.mappable}
        self._pdos = TransmitPdos(node_id, mappable, self._bytes, self._send)
        watch = ENTRIES if direct is None else ()
        entries = (*device.entries, *_own_entries(node_id), *self._pdos.entries, *watch)
        self._node = cast("Any", canopen.LocalNode(node_id, _dictionary(entries)))
        self._node.add_read_callback(self._read)
        self._node.add_write_callback(self._write)
        end = None if direct is None else direct.end()
        self._network: Any = canopen.Network(open_bus(self._channel) if end is None else end)
        self._network.NOTIFIER_CYCLE = _NOTIFIER_CYCLE
        self._network.add_node(self._node)
        # Requests pass the faults before they reach the server.
        server = self._node.sdo
        self._network.unsubscribe(server.rx_cobid, server.on_request)
        self._network.subscribe(server.rx_cobid, self._request)
        server.network = _Outlet(self._network, self._passed)
        self._fault: Fault | None = None
        self._held: bytes | None = None
        self._heartbeat = 0
        self._unstarted = False
        self._toggle = 0
        numbers = [entry for entry in device.entries if entry.kind != "text"]
        self._widths = {entry.index: int(entry.kind[1:]) for entry in numbers}
        self._constant = {(entry.index, entry.subindex) for entry in device.entries if entry.access == "const"}
        self._signed = {entry.index for entry in numbers if entry.kind.startswith("i")}
        self._watch = HeartbeatConsumer(
            lambda identifier, heard: self._network.subscribe(identifier, self._while_up(heard)),
            self._network.unsubscribe,
            lambda word: device.write(CONTROL_WORD, word),
        )
        self.connection.listen(self._plugged)
        device.on_emergency(self._emergency)
        self._network.subscribe(SYNC, self._synchronise)
        self._network.listeners.append(_GuardedNode(self._guarded, _HEARTBEAT + node_id))
        if end is None:
            self._network.connect()
        else:
            for listener in self._network.listeners:
                end.hand_over(listener)
        # Where a node is that has booted, until its master starts it.
        self._node.nmt.send_command(_PRE_OPERATIONAL)

    @property
    def address(self) -> dict[str, str | int]:
        """Return interface and channel of python-can, and the node's identifier."""
        return {"interface": self._interface, "channel": self._channel, "node_id": self._node_id}

    def close(self) -> None:
        """Leave the bus and end its threads; again is allowed."""
        self._watch.close()
        if self._network.bus is not None:
            self._node.nmt.stop_heartbeat()
            self._network.disconnect()

    def leave(self, _: np.random.Generator) -> tuple[str, ...]:
        """Be in pre-operational, and not to be enabled until the master has started the node."""
        self._unstarted = True
        self._node.nmt.send_command(_PRE_OPERATIONAL)
        return ("pre-operational",)

    def _emergency(self, code: int, register: int) -> None:
        if self.connection.up and self._network.bus is not None:
            self._node.emcy.send(code, register)

    def _synchronise(self, identifier: int, data: bytearray, timestamp: float) -> None:
        if self.connection.up and self._node.nmt.state == "OPERATIONAL":
            self._clock.sleep(_TRANSFER_TIME)
            self._pdos.synchronise()

    def _bytes(self, index: int, subindex: int) -> bytes:
        data: bytes = self._node.get_data(index, subindex)
        return data

    def _send(self, identifier: int, data: bytes) -> None:
        self._network.send_message(identifier, data)

    def _guarded(self) -> None:
        """Answer node guarding: the state, and a bit that toggles from answer to answer."""
        if self.connection.up:
            self._toggle ^= 0x80
            self._network.send_message(_HEARTBEAT + self._node_id, [self._toggle ^ 0x80 | self._node.nmt._state])

    def _request(self, identifier: int, data: bytearray, timestamp: float) -> None:
        if not self.connection.up:
            return
        # The client is blocked until it has its reply, so sleeping here is sleeping on its behalf.
        self._clock.sleep(_TRANSFER_TIME)
        server = self._node.sdo
        verb = {0x40: "read", 0x20: "write"}.get(data[0] & 0xE0)
        fault = None
        if verb is not None and self.faults:
            index = int.from_bytes(data[1:3], "little")
            fault = self.faults.strike(f"{verb} {index:04X}H {data[3]}")
        self._fault = fault
        if not self.faults:
            # Mended: what was held back is lost, and the replies are in step again.
            self._held = None
        if fault is None or fault.kind in _ANSWERED:
            server.on_request(identifier, data, timestamp)
        elif fault.kind is FaultKind.LATE:
            self._clock.sleep(fault.delay)
            server.on_request(identifier, data, timestamp)
        elif fault.kind is FaultKind.REPLACE:
            abort = bytes([0x80, *data[1:4]]) + _GENERAL_ERROR.to_bytes(4, "little")
            self._network.send_message(server.tx_cobid, fault.reply or abort)
        elif fault.kind is not FaultKind.SILENCE:
            frame = self._random.integers(0, 256, 4 if fault.kind is FaultKind.HALF else 8, dtype=np.uint8)
            self._network.send_message(server.tx_cobid, frame.tobytes())

    def _while_up(self, heard: Callable[[int, bytearray, float], None]) -> Callable[[int, bytearray, float], None]:
        def hear(identifier: int, data: bytearray, timestamp: float) -> None:
            if self.connection.up:
                heard(identifier, data, timestamp)

        return hear

    def _plugged(self, up: bool) -> None:
        nmt = self._node.nmt
        if up:
            self._network.send_message(_HEARTBEAT + self._node_id, [_BOOT_UP])
            nmt.start_heartbeat(self._heartbeat)
        else:
            self._heartbeat = int(self._node.sdo[0x1017].raw)
            nmt.stop_heartbeat()

    def _passed(self, reply: bytes) -> bytes | None:
        """Return the reply that goes out in the place of one, None for none."""
        fault, self._fault = self._fault, None
        if fault is not None and fault.kind is FaultKind.STALE and self._held is None:
            self._held = reply
            return None
        if self._held is not None:
            reply, self._held = self._held, reply
        return reply

    def _read(self, *, index: int, subindex: int, **_: Any) -> int | None:
        if (index, subindex) in self._constant:
            return None
        value, fault = self._device.read(numbered(index, subindex)), self._fault
        if value is None or fault is None:
            return value
        bits = self._widths[index]
        match fault.kind:
            case FaultKind.FROZEN:
                return int(fault.remembered(f"{index:04X}", str(value).encode()))
            case FaultKind.OVERFLOW:
                return (1 << (bits - 1)) - 1
            case FaultKind.NOT_A_NUMBER:
                return -(1 << (bits - 1)) if index in self._signed else 1 << (bits - 1)
        return value

    def _write(self, *, index: int, subindex: int, data: bytes, **others: Any) -> None:
        value = others["od"].decode_raw(data)
        enabling = index == CONTROL_WORD and value & _ENABLE == _ENABLE
        if enabling and self._unstarted and self._node.nmt.state != "OPERATIONAL":
            raise canopen.SdoAbortedError(DEVICE_STATE)
        try:
            if not self._watch.write(index, value) and not self._pdos.write(index, subindex, value):
                self._device.write(numbered(index, subindex), value)
        except SdoError as error:
            raise canopen.SdoAbortedError(error.code) from error


class _GuardedNode(canopen.network.MessageListener):
    """Listens for a master's request for the node's state, a remote frame, which canopen ignores."""

    def __init__(self, answer: Callable[[], None], identifier: int) -> None:
        self._answer = answer
        self._identifier = identifier

    def on_message_received(self, msg: can.Message) -> None:
        """Answer a remote frame with the identifier."""
        if msg.is_remote_frame and msg.arbitration_id == self._identifier:
            self._answer()

    def stop(self) -> None:
        """Hold nothing that would have to be given back."""


def _own_entries(node_id: int) -> tuple[ObjectEntry, ...]:
    """Return what depends on the node's number."""
    return (ObjectEntry(0x1014, "COB-ID EMCY", "u32", "const", value=0x80 + node_id),)


class _Outlet:
    """A network as the SDO server sees it: what it sends passes the node's faults."""

    def __init__(self, network: Any, passed: Callable[[bytes], bytes | None]) -> None:
        self._network = network
        self._passed = passed

    def send_message(self, identifier: int, data: bytes) -> None:
        """Send what comes of a message."""
        left = self._passed(bytes(data))
        if left is not None:
            self._network.send_message(identifier, left)


def _dictionary(entries: tuple[ObjectEntry, ...]) -> Any:
    dictionary = od.ObjectDictionary()
    for index in dict.fromkeys(entry.index for entry in entries):
        members = [entry for entry in entries if entry.index == index]
        if len(members) == 1:
            dictionary.add_object(_variable(members[0]))
            continue
        record = od.ODRecord(members[0].name.split(":")[0], index)
        for member in members:
            record.add_member(_variable(member))
        dictionary.add_object(record)
    return dictionary


def _variable(entry: ObjectEntry) -> Any:
    variable = od.ODVariable(entry.name, entry.index, entry.subindex)
    variable.data_type = _TYPES[entry.kind]
    variable.access_type = entry.access
    variable.default = entry.value
    variable.pdo_mappable = entry.mappable
    return variable
