"""Faults of an instrument's line: what happens to its messages and replies, and when."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np


class FaultKind(StrEnum):
    """The effect of a fault on a message or its reply."""

    #: It never comes.
    SILENCE = "silence"
    #: Its first half comes, and no end.
    HALF = "half"
    #: As many random bytes come.
    GARBAGE = "garbage"
    #: Other bytes come.
    REPLACE = "replace"
    #: It comes some time later.
    LATE = "late"
    #: It comes in the place of the next one, and so on: every reply is one behind.
    STALE = "stale"
    #: It is the one that the same message got first: the sensor is frozen.
    FROZEN = "frozen"
    #: Its readings are not a number, or what the instrument sends for one.
    NOT_A_NUMBER = "not_a_number"
    #: Its readings are the largest that the format holds, 9.9E37 in SCPI.
    OVERFLOW = "overflow"
    #: It belongs to another output or channel.
    WRONG_CHANNEL = "wrong_channel"
    #: It is a Modbus exception, and the request is not carried out.
    EXCEPTION = "exception"
    #: It bears the identifier of another Modbus unit.
    WRONG_UNIT = "wrong_unit"


@dataclass
class Fault:
    """A fault and when it strikes.

    `strikes(count, message)` gets the number of the message since the fault was added, from 1, and the message; for
    Modbus the message is a text like "read 1 2103H 2", for CAN like "read 6041H 0", for the tachometer "frame".
    `delay` (s) belongs to LATE, `reply` to REPLACE, `code` to EXCEPTION. `times` is how often it may still strike, None
    for always. `memory` holds the replies that FROZEN repeats, by message.
    """

    kind: FaultKind
    strikes: Callable[[int, str], bool]
    delay: float = 0.0
    reply: bytes = b""
    times: int | None = 1
    code: int = 4
    memory: dict[str, bytes] = field(default_factory=dict)
    seen: int = 0
    struck: bool = False

    @classmethod
    def at(cls, kind: FaultKind | str, count: int, *, delay: float = 0.0, reply: bytes = b"", code: int = 4) -> "Fault":
        """Return a fault that strikes the n-th message, counted from 1."""
        return cls(FaultKind(kind), lambda number, _: number == count, delay, reply, code=code)

    @classmethod
    def on(
        cls,
        kind: FaultKind | str,
        pattern: str,
        *,
        delay: float = 0.0,
        reply: bytes = b"",
        times: int | None = 1,
        code: int = 4,
    ) -> "Fault":
        """Return a fault that strikes messages in which the regular expression is found, whatever their case."""
        return cls(FaultKind(kind), _found(pattern), delay, reply, times, code)

    @classmethod
    def wrong_identity(cls, identity: str = "ACME,MODEL 1,0,0.0") -> "Fault":
        """Return a fault that answers every `*IDN?` as another instrument would."""
        return cls.on(FaultKind.REPLACE, r"\*IDN\?", reply=identity.encode("latin-1") + b"\n", times=None)

    def remembered(self, message: str, reply: bytes) -> bytes:
        """Return the reply that this message got first."""
        return self.memory.setdefault(message, reply)


@dataclass
class MessageWatch:
    """Calls `seen` once, at the n-th message since it was added, or at the first in which the pattern is found."""

    strikes: Callable[[int, str], bool]
    seen: Callable[[], None]
    count: int = 0

    @classmethod
    def at(cls, count: int, seen: Callable[[], None]) -> "MessageWatch":
        """Return a watch for the n-th message, counted from 1."""
        return cls(lambda number, _: number == count, seen)

    @classmethod
    def on(cls, pattern: str, seen: Callable[[], None]) -> "MessageWatch":
        """Return a watch for a message in which the regular expression is found, whatever its case."""
        return cls(_found(pattern), seen)


class Faults:
    """The faults of one face, struck in the order in which they were added; empty is false."""

    def __init__(self) -> None:
        self._faults: list[Fault] = []
        self._watches: list[MessageWatch] = []

    def __len__(self) -> int:
        return len(self._faults) + len(self._watches)

    def __iter__(self) -> Iterator[Fault]:
        return iter(tuple(self._faults))

    def add(self, fault: Fault) -> Fault:
        """Add a fault, which counts messages from now on."""
        self._faults.append(fault)
        return fault

    def remove(self, fault: Fault) -> None:
        """Take a fault away; one that is not there is no matter."""
        self._faults = [other for other in self._faults if other is not fault]

    def watch(self, watch: MessageWatch) -> None:
        """Add a watch for a message."""
        self._watches.append(watch)

    def unwatch(self, watch: MessageWatch) -> None:
        """Look out for it no longer; one that is not there is no matter."""
        self._watches = [other for other in self._watches if other is not watch]

    def clear(self) -> None:
        """Take all faults and watches away."""
        self._faults.clear()
        self._watches.clear()

    def strike(self, message: str) -> Fault | None:
        """Count a message, tell those who watch for it, and return the fault that strikes it."""
        for watch in tuple(self._watches):
            watch.count += 1
            if watch.strikes(watch.count, message):
                self.unwatch(watch)
                watch.seen()
        struck = None
        for fault in tuple(self._faults):
            fault.seen += 1
            if struck is None and fault.times != 0 and fault.strikes(fault.seen, message):
                if fault.times is not None:
                    fault.times -= 1
                struck = fault
                fault.struck = True
        return struck


def spoil(fault: Fault, reply: bytes, generator: np.random.Generator) -> bytes:
    """Return what comes of a reply on the wire: nothing, its first half, as many random bytes, another one, or all of it."""
    match fault.kind:
        case FaultKind.SILENCE:
            return b""
        case FaultKind.HALF:
            return reply[: len(reply) // 2]
        case FaultKind.GARBAGE:
            return generator.integers(0x80, 0x100, len(reply), dtype=np.uint8).tobytes()
        case FaultKind.REPLACE:
            return fault.reply
        case _:
            return reply


def _found(pattern: str) -> Callable[[int, str], bool]:
    compiled = re.compile(pattern, re.IGNORECASE)
    return lambda _, message: compiled.search(message) is not None
