"""Checks of a CANopen node's network management (CiA 301): a node that another master has left, or takes, out of operation."""

from contextlib import suppress
from typing import Any

import can

from bench.testing.conformance.manual import ProtectionTrip
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import Stand

_COMMAND, _HEARTBEAT = 0x000, 0x700
#: States by the command specifier that leads to them and the byte by which a node reports them.
_STATES = {"pre-operational": (0x80, 0x7F), "stopped": (0x02, 0x04), "operational": (0x01, 0x05)}
_WORDS = {state: name for name, (_, state) in _STATES.items()}


class OtherMaster:
    """Another master on the bus of the instrument under test; to be used in a `with` statement."""

    def __init__(self, stand: Stand) -> None:
        address: Any = stand.bench.address(stand.subject.role.value)
        self._node = int(address["node_id"])
        self._end = stand.bench.can_bus(address["channel"])
        self._heard = ""
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

    def _send(self, identifier: int, data: bytes) -> None:
        self._end.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def _hear(self, message: can.Message) -> None:
        if message.arbitration_id == _HEARTBEAT + self._node and message.data:
            self._heard = _WORDS.get(message.data[0] & 0x7F, "")


def check_network_management(trial: Trial) -> None:
    """Check that a CANopen node is started when it is opened, and afterwards is in the state in which it was found."""
    with trial.stand() as made:
        if made.transport != "can":
            return
    for name in _STATES:
        _as_left(trial, name)


def taken_out(stand: Stand) -> ProtectionTrip:
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
