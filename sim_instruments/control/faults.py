"""Faults as requests: of an instrument's line by its role, and of the motor and its wiring."""

import re
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, field_validator, model_validator

from sim_instruments.bench import VirtualBench
from sim_instruments.control.request import Request
from sim_instruments.faults import Fault, FaultKind
from sim_instruments.settings import Terminal

_LONGEST_DELAY = 3600.0


class LineFault(Request):
    """What becomes of replies: of the `count`-th from now on, or of those whose request `pattern` is found in, `times` times."""

    fault: Literal["silence", "half", "garbage", "replace", "late"]
    role: str
    pattern: str | None = None
    count: Annotated[int, Field(ge=1)] | None = None
    times: Annotated[int, Field(ge=1)] | None = 1
    delay: Annotated[float, Field(ge=0.0, le=_LONGEST_DELAY)] = 0.0
    reply: str = ""

    @field_validator("pattern")
    @classmethod
    def _compiles(cls, pattern: str | None) -> str | None:
        try:
            re.compile(pattern or "")
        except re.error as error:
            raise ValueError(f"{pattern!r} is no regular expression: {error}") from error
        return pattern

    @field_validator("reply")
    @classmethod
    def _is_bytes(cls, reply: str) -> str:
        if any(ord(character) > 0xFF for character in reply):
            raise ValueError("a reply is bytes, one character for each: only U+0000 … U+00FF")
        return reply

    @model_validator(mode="after")
    def _strikes(self) -> "LineFault":
        if (self.pattern is None) == (self.count is None):
            raise ValueError("give either pattern or count, one of the two")
        if "times" in self.model_fields_set and self.count is not None:
            raise ValueError("times belongs to pattern: a count strikes once")
        return self

    def inject(self, bench: VirtualBench) -> None:
        """Add it to the role's line."""
        kind, reply = FaultKind(self.fault), self.reply.encode("latin-1")
        if self.count is not None:
            fault = Fault.at(kind, self.count, delay=self.delay, reply=reply)
        else:
            fault = Fault.on(kind, self.pattern or "", delay=self.delay, reply=reply, times=self.times)
        bench.faults(self.role).add(fault)


class WrongIdentity(Request):
    """Answer every *IDN? as another instrument would."""

    fault: Literal["wrong_identity"]
    role: str
    identity: Annotated[str, Field(pattern=r"^[ -~]+$")] = "ACME,MODEL 1,0,0.0"

    def inject(self, bench: VirtualBench) -> None:
        """Add it to the role's line."""
        bench.faults(self.role).add(Fault.wrong_identity(self.identity))


class OpenPhase(Request):
    """Break the wire at a terminal; null mends it."""

    fault: Literal["open_phase"]
    terminal: Terminal | None

    def inject(self, bench: VirtualBench) -> None:
        """Do it."""
        bench.world.set_open_phase(self.terminal)


class Swapped(Request):
    """Have two wires carry each other's label; null puts them right."""

    fault: Literal["swapped"]
    pair: Annotated[list[Terminal], Field(min_length=2, max_length=2)] | None

    def inject(self, bench: VirtualBench) -> None:
        """Do it."""
        bench.world.set_swapped(None if self.pair is None else (self.pair[0], self.pair[1]))


class StuckRotor(Request):
    """Jam the rotor, or free it."""

    fault: Literal["stuck_rotor"]
    stuck: bool = True

    def inject(self, bench: VirtualBench) -> None:
        """Do it."""
        bench.world.set_stuck_rotor(self.stuck)


FAULT: TypeAdapter[Any] = TypeAdapter(
    Annotated[LineFault | WrongIdentity | OpenPhase | Swapped | StuckRotor, Field(discriminator="fault")]
)


def listed(bench: VirtualBench) -> dict[str, Any]:
    """Return all faults: of the world, and by role those of the lines with how often each may still strike."""
    lines = {role: bench.faults(role) for role in bench.roles}
    return {
        "world": bench.world.truth()["faults"],
        "instruments": {
            role: [{"fault": fault.kind.value, "times": fault.times} for fault in faults]
            for role, faults in lines.items()
            if faults
        },
    }


def clear(bench: VirtualBench) -> None:
    """Take all faults away."""
    for role in bench.roles:
        bench.faults(role).clear()
    bench.world.set_open_phase(None)
    bench.world.set_swapped(None)
    bench.world.set_stuck_rotor(False)
