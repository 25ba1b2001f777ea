"""Sharing instruments between sockets: a run requests leases, and the arbiter decides who gets which, and when.

First come, first served, and all that a procedure needs at once.
"""

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field

from drivers.interfaces import Clock, InstrumentError
from drivers.interfaces.text import text
from procedures.core.bench import Role


@dataclass(frozen=True)
class LeaseRequest:
    """A worker's run waits for these instruments; `time` is its bench's (s). The reply names the ticket."""

    ticket: int
    time: float
    instruments: tuple[str, ...]
    purpose: str


@dataclass(frozen=True)
class LeaseRelease:
    """A worker's run has given back what it had, or withdraws its request."""

    time: float


@dataclass(frozen=True)
class LeaseHolder:
    """Holder of an instrument: its socket and that one's name, for which procedure, since when (s)."""

    socket: int
    name: str
    purpose: str
    since: float


@dataclass(frozen=True)
class LeaseDecision:
    """Outcome of a socket's request: at time `at` (s) it has everything, or `held` names what it did not get."""

    socket: int
    at: float
    held: Mapping[str, LeaseHolder] = field(default_factory=dict)

    @property
    def granted(self) -> bool:
        """Return whether it has what it asked for."""
        return not self.held


@dataclass(frozen=True)
class LeaseReply:
    """The decision on the request with this ticket."""

    ticket: int
    decision: LeaseDecision


@dataclass
class _Request:
    key: tuple[float, int]
    instruments: frozenset[str]
    purpose: str
    timeout: float


@dataclass(frozen=True)
class _Lease:
    instruments: frozenset[str]
    holder: LeaseHolder


class Arbiter:
    """Leases of shared instruments to sockets, decided in the order of the requests' times and not of their arrival.

    Every socket has a time (s) of its own, of which the arbiter knows that it is at least so much. A request is decided
    when no earlier one can come any more; it gets all it wants at the latest of its own time and the others' releases. Nobody holds
    while waiting, so nobody waits for ever; nobody overtakes an earlier request for the same instrument.
    With sockets that share a wall clock, all times are the wall's, and `advance` tells every socket's.
    """

    def __init__(self, sockets: Mapping[int, str]) -> None:
        self._names = dict(sockets)
        #: A socket's time is at least this.
        self._reached: dict[int, float] = dict.fromkeys(sockets, 0.0)
        self._requests: dict[int, _Request] = {}
        self._leases: dict[int, _Lease] = {}
        #: When each instrument was last given back, and who had it.
        self._free: dict[str, float] = {}
        self._past: dict[str, LeaseHolder] = {}

    def advance(self, socket: int, time: float) -> None:
        """Note that a socket has reached this time (s)."""
        if socket in self._reached:
            self._reached[socket] = max(self._reached[socket], time)

    def reached(self, socket: int) -> float:
        """Return the time (s) that a socket is known to have reached; infinite for one that nobody waits for."""
        return self._reached.get(socket, math.inf)

    def request(
        self, socket: int, time: float, instruments: Iterable[str], purpose: str, timeout: float = math.inf
    ) -> None:
        """Ask for all these instruments at once. Raises ValueError where the socket holds or wants something already."""
        if socket in self._requests or socket in self._leases:
            raise ValueError(f"socket {socket} holds or wants something already")
        self.advance(socket, time)
        self._requests[socket] = _Request((time, socket), frozenset(instruments), purpose, timeout)

    def release(self, socket: int, time: float) -> None:
        """Give back what a socket holds, or withdraw what it wants; nothing of either is no fault."""
        self.advance(socket, time)
        self._requests.pop(socket, None)
        lease = self._leases.pop(socket, None)
        for instrument in lease.instruments if lease else ():
            self._free[instrument] = max(time, self._free.get(instrument, 0.0))

    def leave(self, socket: int, time: float) -> None:
        """Take a socket out: nobody waits for it any more."""
        self.release(socket, time)
        self._reached.pop(socket, None)

    def join(self, socket: int, time: float) -> None:
        """Take a socket in, or in again."""
        self._reached[socket] = time

    def waited_for(self) -> float:
        """Return the earliest time (s) that the sockets at work must pass before something more is decided; infinite for none."""
        return min((request.key[0] for request in self._requests.values()), default=math.inf)

    def decide(self) -> list[LeaseDecision]:
        """Return the decisions that can be made now, in the order of their requests."""
        return list(iter(self._next, None))

    def _next(self) -> LeaseDecision | None:
        bounds = self._bounds()
        # What an earlier, undecided request wants, no later one can have.
        reserved: set[str] = set()
        for socket, request in sorted(self._requests.items(), key=lambda item: item[1].key):
            if any(bound <= request.key for other, bound in bounds.items() if other != socket):
                return None
            if not reserved & request.instruments:
                decision = self._decision(socket, request)
                if decision is not None:
                    del self._requests[socket]
                    self._settle(decision, request)
                    return decision
            reserved |= request.instruments
        return None

    def _decision(self, socket: int, request: _Request) -> LeaseDecision | None:
        time = request.key[0]
        latest = time + request.timeout
        held = self._held(request.instruments)
        if not held:
            at = max([time, *(self._free.get(instrument, 0.0) for instrument in request.instruments)])
            if at <= latest:
                return LeaseDecision(socket, at)
            late = {
                instrument: self._past[instrument]
                for instrument in request.instruments
                if self._free.get(instrument, 0.0) > latest
            }
            return LeaseDecision(socket, latest, late)
        if any(self._reached[holder.socket] > latest for holder in held.values()):
            return LeaseDecision(socket, latest, held)
        return None

    def _settle(self, decision: LeaseDecision, request: _Request) -> None:
        self.advance(decision.socket, decision.at)
        if decision.granted:
            holder = LeaseHolder(decision.socket, self._names[decision.socket], request.purpose, decision.at)
            self._leases[decision.socket] = _Lease(request.instruments, holder)
            self._past |= dict.fromkeys(request.instruments, holder)
            return
        for instrument in request.instruments:
            # Who came later had to wait for this one's end.
            self._free[instrument] = max(decision.at, self._free.get(instrument, 0.0))

    def _held(self, instruments: frozenset[str]) -> dict[str, LeaseHolder]:
        return {
            instrument: lease.holder
            for lease in self._leases.values()
            for instrument in sorted(lease.instruments & instruments)
        }

    def _bounds(self) -> dict[int, tuple[float, int]]:
        """Return before which time and socket each can ask for nothing more."""
        bounds = {}
        for socket, reached in self._reached.items():
            request = self._requests.get(socket)
            # A socket that waits goes on, at the earliest, when the holders that it waits for have got so far.
            held = self._held(request.instruments) if request else {}
            waits = [self._reached[h.socket] for h in held.values() if h.socket in self._reached]
            limit = request.key[0] + request.timeout if request else math.inf
            bounds[socket] = (max(reached, min(max(waits, default=0.0), limit)), socket)
        return bounds


@dataclass
class SocketLeases:
    """A run's leases of shared instruments, at a socket whose clock began at `offset` (s) of the line's time.

    `send` sends a message to the coordinator, `decision` waits for the one on a ticket. On a virtual bench the
    waiting itself takes no wall time, and the bench's time is brought forward.
    """

    roles: frozenset[Role]
    clock: Clock
    offset: float
    send: Callable[[LeaseRequest | LeaseRelease], None]
    decision: Callable[[int], LeaseDecision]
    virtual: bool
    _ticket: int = 0
    _open: bool = False

    def acquire(self, roles: Collection[Role], purpose: str) -> float:
        """Acquire instruments and return the time (s) waited. Raises InstrumentError naming who has one too long."""
        requested = self.clock.now()
        self._ticket += 1
        self._open = True
        self.send(
            LeaseRequest(self._ticket, self.offset + requested, tuple(sorted(role.value for role in roles)), purpose)
        )
        decision = self.decision(self._ticket)
        if self.virtual:
            self.clock.sleep(max(0.0, decision.at - self.offset - requested))
        waited = self.clock.now() - requested
        if not decision.granted:
            self._open = False
            instrument, holder = next(iter(sorted(decision.held.items())))
            raise InstrumentError(
                instrument,
                text(
                    "was not free within {waited:.0f} s: socket {socket} has used it for {purpose} for {time:.0f} s",
                    waited=waited,
                    socket=holder.name,
                    purpose=holder.purpose,
                    time=decision.at - holder.since,
                ),
                remedy=text("See whether that socket is stuck, or give line.timeout in the station file more time"),
            )
        return waited

    def release(self) -> None:
        """Give back what the run has, or withdraw its request."""
        if self._open:
            self._open = False
            self.send(LeaseRelease(self.offset + self.clock.now()))
