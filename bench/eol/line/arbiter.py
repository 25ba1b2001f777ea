"""Who gets a shared instrument, and when: first come, first served, all that a procedure needs at once."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Holder:
    """Who holds an instrument: its socket and that one's name, for which procedure, since when (s)."""

    socket: int
    name: str
    purpose: str
    since: float


@dataclass(frozen=True)
class Answer:
    """What becomes of a socket's request: at time `at` (s) it has everything, or `held` names what it did not get."""

    socket: int
    at: float
    held: Mapping[str, Holder] = field(default_factory=dict)

    @property
    def granted(self) -> bool:
        """Whether it has what it asked for."""
        return not self.held


@dataclass
class _Request:
    key: tuple[float, int]
    wanted: frozenset[str]
    purpose: str
    timeout: float


@dataclass(frozen=True)
class _Lease:
    wanted: frozenset[str]
    holder: Holder


class Arbiter:
    """Leases of shared things to sockets, decided in the order of the requests' times and not of their arrival.

    Every socket has a time (s) of its own, of which the arbiter knows that it is at least so much. A request is decided
    when no earlier one can come any more; it gets all it wants at the latest of its own time and the others' releases. Nobody holds
    while waiting, so nobody waits for ever; nobody overtakes an earlier request for the same thing.
    With sockets that share a wall clock, all times are the wall's, and `advance` tells every socket's.
    """

    def __init__(self, sockets: Mapping[int, str]) -> None:
        self._names = dict(sockets)
        #: A socket's time is at least this.
        self._reached: dict[int, float] = dict.fromkeys(sockets, 0.0)
        self._requests: dict[int, _Request] = {}
        self._leases: dict[int, _Lease] = {}
        #: When each thing was last given back, and who had it.
        self._free: dict[str, float] = {}
        self._past: dict[str, Holder] = {}

    def advance(self, socket: int, time: float) -> None:
        """Know that a socket has come to this time."""
        if socket in self._reached:
            self._reached[socket] = max(self._reached[socket], time)

    def reached(self, socket: int) -> float:
        """Return the time (s) that a socket is known to have come to; infinite for one that nobody waits for."""
        return self._reached.get(socket, math.inf)

    def request(self, socket: int, time: float, wanted: Iterable[str], purpose: str, timeout: float = math.inf) -> None:
        """Ask for everything in `wanted` at once. Raises ValueError where the socket holds or wants something already."""
        if socket in self._requests or socket in self._leases:
            raise ValueError(f"socket {socket} holds or wants something already")
        self.advance(socket, time)
        self._requests[socket] = _Request((time, socket), frozenset(wanted), purpose, timeout)

    def release(self, socket: int, time: float) -> None:
        """Give back what a socket holds, or withdraw what it wants; nothing of either is no fault."""
        self.advance(socket, time)
        self._requests.pop(socket, None)
        lease = self._leases.pop(socket, None)
        for thing in lease.wanted if lease else ():
            self._free[thing] = max(time, self._free.get(thing, 0.0))

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

    def decide(self) -> list[Answer]:
        """Return the answers that can be given now, in the order of their requests."""
        answers: list[Answer] = []
        while (answer := self._next()) is not None:
            answers.append(answer)
        return answers

    def _next(self) -> Answer | None:
        bounds = self._bounds()
        # What an earlier request wants, and could not be told yet, is not to be had by a later one.
        spoken_for: set[str] = set()
        for socket, request in sorted(self._requests.items(), key=lambda item: item[1].key):
            if any(bound <= request.key for other, bound in bounds.items() if other != socket):
                return None
            if not spoken_for & request.wanted:
                answer = self._answer(socket, request)
                if answer is not None:
                    del self._requests[socket]
                    self._settle(answer, request)
                    return answer
            spoken_for |= request.wanted
        return None

    def _answer(self, socket: int, request: _Request) -> Answer | None:
        time = request.key[0]
        latest = time + request.timeout
        held = self._held(request.wanted)
        if not held:
            at = max([time, *(self._free.get(thing, 0.0) for thing in request.wanted)])
            if at <= latest:
                return Answer(socket, at)
            late = {thing: self._past[thing] for thing in request.wanted if self._free.get(thing, 0.0) > latest}
            return Answer(socket, latest, late)
        if any(self._reached[holder.socket] > latest for holder in held.values()):
            return Answer(socket, latest, held)
        return None

    def _settle(self, answer: Answer, request: _Request) -> None:
        self.advance(answer.socket, answer.at)
        if answer.granted:
            holder = Holder(answer.socket, self._names[answer.socket], request.purpose, answer.at)
            self._leases[answer.socket] = _Lease(request.wanted, holder)
            self._past |= dict.fromkeys(request.wanted, holder)
            return
        for thing in request.wanted:
            # Who came later had to wait for this one's end.
            self._free[thing] = max(answer.at, self._free.get(thing, 0.0))

    def _held(self, wanted: frozenset[str]) -> dict[str, Holder]:
        return {thing: lease.holder for lease in self._leases.values() for thing in sorted(lease.wanted & wanted)}

    def _bounds(self) -> dict[int, tuple[float, int]]:
        """Return before which time and socket each can ask for nothing more."""
        bounds = {}
        for socket, reached in self._reached.items():
            request = self._requests.get(socket)
            # A socket that waits goes on, at the earliest, when the holders that it waits for have got so far.
            held = self._held(request.wanted) if request else {}
            waits = [self._reached[h.socket] for h in held.values() if h.socket in self._reached]
            limit = request.key[0] + request.timeout if request else math.inf
            bounds[socket] = (max(reached, min(max(waits, default=0.0), limit)), socket)
        return bounds
