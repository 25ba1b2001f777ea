"""Checks of a CANopen node's network management (CiA 301): a node that another master has left, or takes, out of operation."""

from contextlib import suppress
from typing import Any

import can

from bench.testing.conformance.manual import ProtectionTrip
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import OneInstrumentBench

_COMMAND, _HEARTBEAT = 0x000, 0x700
_SDO_REQUEST, _SDO_REPLY, _ABORT = 0x600, 0x580, b"\x80"
#: Bits of an SDO's command (CiA 301): a write; the answer holds the object; it says how long the object is.
_DOWNLOAD, _EXPEDITED, _SIZE_SAID = 0x20, 2, 1
#: The mappings of the transmit PDOs that are looked at (CiA 301).
PDO_MAPPINGS, PDOS = 0x1A00, range(4)
#: States by the command specifier that leads to them and the byte by which a node reports them.
_STATES = {"pre-operational": (0x80, 0x7F), "stopped": (0x02, 0x04), "operational": (0x01, 0x05)}
_WORDS = {state: name for name, (_, state) in _STATES.items()}


class OtherMaster:
    """Another master on the bus of the instrument under test; to be used in a `with` statement."""

    def __init__(self, stand: OneInstrumentBench) -> None:
        address: Any = stand.bench.address(stand.subject.role.value)
        self._node = int(address["node_id"])
        self._end = stand.bench.can_bus(address["channel"])
        self._heard, self._answer = "", b""
        #: What was written into the mappings of transmit PDOs since: index, subindex and length in bits.
        self.mapped: list[tuple[int, int, int]] = []
        self._end.hand_over(self._hear)

    def __enter__(self) -> "OtherMaster":
        return self

    def __exit__(self, *_: object) -> None:
        self._end.shutdown()

    def command(self, state: str) -> None:
        """Command the node into a state."""
        self._send(_COMMAND, bytes([_STATES[state][0], self._node]))

    def take_out(self) -> None:
        """Command the node into pre-operational, which it reports by its heartbeat."""
        self.command("pre-operational")
        self._send(_HEARTBEAT + self._node, bytes([_STATES["pre-operational"][1]]))

    def state(self) -> str:
        """Return the node's state, which it is asked for; empty where it does not answer."""
        self._heard = ""
        self._end.send(
            can.Message(arbitration_id=_HEARTBEAT + self._node, is_remote_frame=True, is_extended_id=False, dlc=1)
        )
        return self._heard

    def read(self, index: int, subindex: int) -> bytes | None:
        """Return the bytes of an object, by SDO; None for one that the node has not, or does not let be read."""
        return self._asked(0x40, index, subindex)

    def length(self, index: int, subindex: int) -> int | None:
        """Return how many bits an object has, as the node says by SDO; None where it says nothing of it."""
        if self.read(index, subindex) is None or not self._answer[0] & _SIZE_SAID:
            return None
        if self._answer[0] & _EXPEDITED:
            return 8 * (4 - (self._answer[0] >> 2 & 3))
        return 8 * int.from_bytes(self._answer[4:], "little")

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write an object of at most four bytes by SDO, whatever the node says of it."""
        self._asked(0x23 | (4 - len(data)) << 2, index, subindex, data)

    def _asked(self, command: int, index: int, subindex: int, data: bytes = b"") -> bytes | None:
        self._answer = b""
        place = index.to_bytes(2, "little") + bytes([subindex])
        self._send(_SDO_REQUEST + self._node, bytes([command]) + place + data.ljust(4, b"\0"))
        right = self._answer[:1] != _ABORT and self._answer[1:4] == place
        return self._answer[4:] if right else None

    def _send(self, identifier: int, data: bytes) -> None:
        self._end.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def _hear(self, message: can.Message) -> None:
        if message.arbitration_id == _HEARTBEAT + self._node and message.data:
            self._heard = _WORDS.get(message.data[0] & 0x7F, "")
        elif message.arbitration_id == _SDO_REPLY + self._node:
            self._answer = bytes(message.data)
        elif message.arbitration_id == _SDO_REQUEST + self._node and message.data[0] & 0xE0 == _DOWNLOAD:
            index, subindex = int.from_bytes(message.data[1:3], "little"), message.data[3]
            entry = int.from_bytes(message.data[4:], "little")
            if index - PDO_MAPPINGS in PDOS and subindex and entry:
                self.mapped.append((entry >> 16, entry >> 8 & 0xFF, entry & 0xFF))


def state_of(stand: OneInstrumentBench) -> str:
    """Return the state of a CANopen node; empty for any other instrument, and for a node that does not tell its own."""
    if stand.transport != "can":
        return ""
    with OtherMaster(stand) as other:
        return other.state()


def check_network_management(trial: Trial) -> None:
    """Check that a CANopen node is started when it is opened, and afterwards is in the state in which it was found."""
    with trial.stand() as made:
        if made.transport != "can":
            return
    for name in _STATES:
        _as_left(trial, name)


def taken_out(stand: OneInstrumentBench) -> ProtectionTrip:
    """Return what another master may do to any CANopen node that feeds energy."""

    def make(_: object) -> None:
        with suppress(can.CanError), OtherMaster(stand) as other:
            other.take_out()

    return ProtectionTrip(make)


def _as_left(trial: Trial, name: str) -> None:
    checks, what = trial.checks, f"a node left {name}"
    with trial.stand() as made:
        trial.session.prepare(made)
        with OtherMaster(made) as other:
            other.command(name)
            before = other.state()
            made.open(guarding=True, elsewhere=True).close()
            checks.that(f"{what}: guarding changes nothing", other.state() == before, other.state(), "Leave it alone")
            instrument = made.open()
            started = other.state()
            remedy = "Command NMT operational when opening"
            checks.that(f"{what}: is started", started in ("", "operational"), f"it is {started}", remedy)
            wrong = trial.wrong(made, instrument)
            checks.that(f"{what}: it works", not wrong, wrong, remedy)
            instrument.close()
            remedy = "Ask for the state when opening (node guarding), and command it again when closing"
            checks.that(f"{what}: put back", other.state() == before, f"{other.state()} instead of {before}", remedy)
