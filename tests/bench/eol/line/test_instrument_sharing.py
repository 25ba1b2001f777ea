"""Leases of shared instruments: fair, in the order of the sockets' times, without deadlock, whatever arrives first."""

import itertools
import random
from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.eol.line.workers.instrument_sharing import Arbiter, LeaseDecision

INSTRUMENTS = ("bridge", "tester", "supply")


def arbiter(*sockets: int) -> Arbiter:
    return Arbiter({number: f"s{number}" for number in sockets})


def test_free_is_given_at_once_to_who_comes_first_by_time() -> None:
    line = arbiter(0, 1)
    line.request(1, 5.0, {"bridge"}, "later")
    assert line.decide() == [], "socket 0 may still ask earlier"
    line.request(0, 3.0, {"bridge"}, "earlier")
    assert [(decision.socket, decision.at) for decision in line.decide()] == [(0, 3.0)]
    line.release(0, 9.0)
    line.advance(0, 9.5)
    assert line.decide() == [LeaseDecision(1, 9.0)]


def test_a_socket_that_is_ahead_keeps_nobody_waiting() -> None:
    line = arbiter(0, 1)
    line.advance(0, 100.0)
    line.request(1, 5.0, {"bridge"}, "now")
    assert line.decide() == [LeaseDecision(1, 5.0)]


def test_nobody_overtakes_an_earlier_request_for_the_same_thing() -> None:
    line = arbiter(0, 1, 2)
    line.advance(1, 50.0)
    line.advance(2, 50.0)
    line.request(0, 1.0, {"bridge"}, "long")
    assert [decision.socket for decision in line.decide()] == [0]
    line.request(1, 50.0, {"bridge", "tester"}, "both")
    line.request(2, 51.0, {"tester"}, "one")
    line.advance(0, 60.0)
    assert line.decide() == [], "the tester is free, and spoken for"
    line.release(0, 70.0)
    line.advance(0, 80.0)
    assert line.decide() == [LeaseDecision(1, 70.0)]
    line.release(1, 75.0)
    assert line.decide() == [LeaseDecision(2, 75.0)]


def test_a_timeout_names_the_holder_and_since_when() -> None:
    line = arbiter(0, 1)
    line.advance(1, 10.0)
    line.request(0, 2.0, {"bridge"}, "stator-resistance")
    line.decide()
    line.request(1, 10.0, {"bridge"}, "aligned", timeout=30.0)
    line.advance(0, 40.0)
    assert line.decide() == []
    line.advance(0, 41.0)
    (decision,) = line.decide()
    assert not decision.granted
    assert decision.at == 40.0
    holder = decision.held["bridge"]
    assert (holder.name, holder.purpose, holder.since) == ("s0", "stator-resistance", 2.0)


def test_a_release_after_the_timeout_comes_too_late() -> None:
    line = arbiter(0, 1)
    line.advance(1, 10.0)
    line.request(0, 2.0, {"bridge"}, "long")
    line.decide()
    line.request(1, 10.0, {"bridge"}, "short of time", timeout=30.0)
    line.release(0, 90.0)
    (decision,) = line.decide()
    assert not decision.granted
    assert decision.at == 40.0
    assert decision.held["bridge"].name == "s0"


def test_a_socket_that_dies_is_waited_for_no_more() -> None:
    line = arbiter(0, 1)
    line.advance(1, 3.0)
    line.request(0, 2.0, {"bridge"}, "until it died")
    line.decide()
    line.request(1, 3.0, {"bridge"}, "next")
    assert line.decide() == []
    line.leave(0, 4.0)
    assert line.decide() == [LeaseDecision(1, 4.0)]


def test_a_socket_may_hold_or_want_only_once() -> None:
    line = arbiter(0)
    line.request(0, 0.0, {"bridge"}, "first")
    with pytest.raises(ValueError, match="already"):
        line.request(0, 1.0, {"tester"}, "second")


@dataclass
class Socket:
    """A made-up socket: pieces of work (how long before, what it wants, how long it holds it)."""

    work: list[tuple[float, frozenset[str], float]]
    time: float = 0.0
    log: list[tuple[float, float]] = field(default_factory=list)
    waiting: bool = False
    holding: float | None = None


def simulated(
    work: list[list[tuple[float, frozenset[str], float]]], order: random.Random
) -> list[list[tuple[float, float]]]:
    """Return when each socket had its leases, where the sockets get on in an arbitrary order."""
    line = arbiter(*range(len(work)))
    sockets = [Socket(list(pieces)) for pieces in work]

    def steps() -> Iterator[int]:
        for _ in range(10_000):
            free = [n for n, s in enumerate(sockets) if not s.waiting and (s.work or s.holding is not None)]
            if not free:
                return
            yield order.choice(free)

    for number in steps():
        socket = sockets[number]
        if socket.holding is not None:
            socket.time += socket.holding
            socket.holding = None
            line.release(number, socket.time)
            if not socket.work:
                line.leave(number, socket.time)
        else:
            before, wanted, _ = socket.work[0]
            socket.time += before
            socket.waiting = True
            line.request(number, socket.time, wanted, "work")
        for decision in line.decide():
            other = sockets[decision.socket]
            _, _, held = other.work.pop(0)
            other.log.append((other.time, decision.at))
            other.time, other.waiting, other.holding = decision.at, False, held
    assert not any(socket.work for socket in sockets), "a deadlock"
    return [socket.log for socket in sockets]


_TIMES = st.integers(0, 5).map(float)
_PIECE = st.tuples(_TIMES, st.frozensets(st.sampled_from(INSTRUMENTS), max_size=3), _TIMES)


@given(
    st.lists(st.lists(_PIECE, min_size=1, max_size=5), min_size=1, max_size=4), st.integers(0, 9), st.integers(10, 19)
)
@settings(max_examples=60)
def test_who_gets_what_when_does_not_depend_on_who_computes_first(
    work: list[list[tuple[float, frozenset[str], float]]], one: int, other: int
) -> None:
    first = simulated(work, random.Random(one))  # noqa: S311
    assert first == simulated(work, random.Random(other))  # noqa: S311
    # Never two at once, and no earlier request comes after a later one for the same thing.
    for instrument in INSTRUMENTS:
        leases = sorted(
            (asked, socket, at, at + held)
            for socket, log in enumerate(first)
            for (asked, at), (_, wanted, held) in zip(log, work[socket], strict=True)
            if instrument in wanted
        )
        for before, after in itertools.pairwise(leases):
            assert after[2] >= before[3]
