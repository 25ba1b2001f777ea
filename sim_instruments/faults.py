"""Faults of an instrument's line: silence, half a reply, garbage, a wrong reply, a late one."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np


class FaultKind(StrEnum):
    """What becomes of a reply."""

    SILENCE = "silence"
    HALF = "half"
    GARBAGE = "garbage"
    REPLACE = "replace"
    LATE = "late"


@dataclass
class Fault:
    """A fault and when it strikes.

    `strikes(count, message)` gets the number of the message since the fault list began, from 1, and the message; for
    Modbus the message is a text like "read 1 2103H 2", for CAN like "read 6041H". `delay` (s) belongs to LATE, `reply`
    to REPLACE. `times` is how often it may still strike, None for always.
    """

    kind: FaultKind
    strikes: Callable[[int, str], bool]
    delay: float = 0.0
    reply: bytes = b""
    times: int | None = 1

    @classmethod
    def at(cls, kind: FaultKind | str, count: int, *, delay: float = 0.0, reply: bytes = b"") -> "Fault":
        """Return a fault that strikes the n-th message, counted from 1."""
        return cls(FaultKind(kind), lambda number, _: number == count, delay, reply)

    @classmethod
    def on(
        cls, kind: FaultKind | str, pattern: str, *, delay: float = 0.0, reply: bytes = b"", times: int | None = 1
    ) -> "Fault":
        """Return a fault that strikes messages in which the regular expression is found, whatever their case."""
        compiled = re.compile(pattern, re.IGNORECASE)
        return cls(FaultKind(kind), lambda _, message: compiled.search(message) is not None, delay, reply, times)

    @classmethod
    def wrong_identity(cls, identity: str = "ACME,MODEL 1,0,0.0") -> "Fault":
        """Return a fault that answers every `*IDN?` as another instrument would."""
        return cls.on(FaultKind.REPLACE, r"\*IDN\?", reply=identity.encode("latin-1") + b"\n", times=None)


class Faults:
    """The faults of one face, struck in the order in which they were added; empty is false."""

    def __init__(self) -> None:
        self._faults: list[Fault] = []
        self._count = 0

    def __len__(self) -> int:
        return len(self._faults)

    def __iter__(self) -> Iterator[Fault]:
        return iter(self._faults)

    def add(self, fault: Fault) -> Fault:
        """Add a fault; messages are counted from the moment the list is no longer empty."""
        if not self._faults:
            self._count = 0
        self._faults.append(fault)
        return fault

    def clear(self) -> None:
        """Take all faults away."""
        self._faults.clear()

    def strike(self, message: str) -> Fault | None:
        """Count a message and return the fault that strikes it."""
        self._count += 1
        for fault in self._faults:
            if fault.times != 0 and fault.strikes(self._count, message):
                if fault.times is not None:
                    fault.times -= 1
                return fault
        return None


def spoil(fault: Fault, reply: bytes, generator: np.random.Generator) -> bytes:
    """Return what is left of a reply: nothing, its first half, as many random bytes, another one, or all of it."""
    match fault.kind:
        case FaultKind.SILENCE:
            return b""
        case FaultKind.HALF:
            return reply[: len(reply) // 2]
        case FaultKind.GARBAGE:
            return generator.integers(0x80, 0x100, len(reply), dtype=np.uint8).tobytes()
        case FaultKind.REPLACE:
            return fault.reply
        case FaultKind.LATE:
            return reply
