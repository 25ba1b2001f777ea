"""Faults of what instruments say, and of the cables they say it through."""

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, field_validator, model_validator

from sim_instruments.faults.description import ActiveFault, Count, Description, MaybeCount, pattern_checked
from sim_instruments.faults.line_faults import Fault, FaultKind

if TYPE_CHECKING:
    from sim_instruments.faults.target import FaultTarget

#: The messages that ask for a reading, by role.
READINGS = {
    "supply": r"^:?MEAS",
    "lcr_meter": r"FETC|^\*TRG",
    "voltmeter": r"^:?(READ|FETC|MEAS)",
    "oscilloscope": r"WAV\w*:DATA|^:?MEAS\w*:(?!SOUR)",
    "dynamometer": r"^read 2 000[0-5]H|^read 1 21\w\wH",
    "tachometer": "frame",
    "inverter": r"^read (606C|6077|6078)H|\bread\b.* 00[1-7DE]H|tel get servo_",
    "drive": r"^read (606C|6079|2010|2011)H",
    "switch_matrix": r"ROUT\w*:(CLOS|OPEN)\w*\?",
    "rotor_actuator": r"^read (6064|606C)H",
    "insulation_tester": r"^:?MEAS",
}
#: The messages whose channel a confused instrument mistakes, by role: nobody else has channels.
CHANNELLED = {"supply": r"\?", "oscilloscope": r"WAV\w*:SOUR|\?"}
_READING_KINDS = ("frozen", "not_a_number", "overflow")
_MODBUS_KINDS = ("exception", "wrong_unit")


class LineFault(Description):
    """A fault of messages and replies.

    Of the `count`-th from its beginning, of those in which `pattern` is found (`times` times, "always" or None for ever), or,
    with neither, of all; for a kind that concerns readings or channels, of all such.
    """

    fault: Literal[
        "silence",
        "half",
        "garbage",
        "replace",
        "late",
        "stale",
        "frozen",
        "not_a_number",
        "overflow",
        "wrong_channel",
        "exception",
        "wrong_unit",
    ]
    role: str
    pattern: str | None = None
    count: MaybeCount = None
    times: Annotated[
        Count | Literal["always"] | None, Field(description="a whole number of at least 1, or 'always'")
    ] = None
    delay: Annotated[
        float, Field(ge=0.0, le=3600.0, description="of a late reply", json_schema_extra={"unit": "s"})
    ] = 0.0
    reply: str = ""
    code: Annotated[int, Field(ge=1, le=255, description="of a Modbus exception")] = 4

    @field_validator("pattern")
    @classmethod
    def _compiles(cls, pattern: str | None) -> str | None:
        return pattern_checked(pattern)

    @field_validator("reply")
    @classmethod
    def _is_bytes(cls, reply: str) -> str:
        if any(ord(character) > 0xFF for character in reply):
            raise ValueError("a reply is bytes, one character for each: only U+0000 … U+00FF")
        return reply

    @model_validator(mode="after")
    def _strikes(self) -> "LineFault":
        given = self.model_fields_set
        if self.pattern is not None and self.count is not None:
            raise ValueError("give either pattern or count, one of the two")
        if self.pattern is None and self.count is None and not self.timed and self.fault not in _OWN_MESSAGES:
            raise ValueError("give pattern or count, or when it begins: at, step, message, after, duration")
        if "times" in given and self.count is not None:
            raise ValueError("times belongs to pattern: a count strikes once")
        for name, kind in (("delay", "late"), ("reply", "replace"), ("code", "exception")):
            if name in given and self.fault != kind:
                raise ValueError(f"{name} belongs to {kind}, not to {self.fault}")
        return self

    def check(self, bench: "FaultTarget") -> None:
        """Raise ValueError for a role that is unknown or cannot have such a fault."""
        super().check(bench)
        bench.faults(self.role)
        if self.fault in _MODBUS_KINDS:
            _only(self.role, _reached_by(bench, "modbus"), self.fault)
        elif self.fault == "wrong_channel":
            _only(self.role, tuple(CHANNELLED), self.fault)

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Add it to the role's line."""
        faults, kind = bench.faults(self.role), FaultKind(self.fault)
        reply = self.reply.encode("latin-1")
        times = None if self.times == "always" else self.times
        if self.count is not None:
            fault = Fault.at(kind, self.count, delay=self.delay, reply=reply, code=self.code)
        else:
            if self.pattern is not None and "times" not in self.model_fields_set and self.fault not in _OWN_MESSAGES:
                times = 1
            fault = Fault.on(kind, self._messages(), delay=self.delay, reply=reply, times=times, code=self.code)
        faults.add(fault)
        return ActiveFault(lambda: faults.remove(fault), lambda: fault.struck)

    def _messages(self) -> str:
        if self.pattern is not None:
            return self.pattern
        if self.fault in _READING_KINDS:
            return READINGS[self.role]
        return CHANNELLED[self.role] if self.fault == "wrong_channel" else ""


class WrongIdentity(Description):
    """Answer every *IDN? as another instrument would."""

    fault: Literal["wrong_identity"]
    role: str
    identity: Annotated[str, Field(pattern=r"^[ -~]+$")] = "ACME,MODEL 1,0,0.0"

    def check(self, bench: "FaultTarget") -> None:
        """Raise ValueError for an unknown role."""
        super().check(bench)
        bench.faults(self.role)

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Add it to the role's line."""
        faults = bench.faults(self.role)
        fault = faults.add(Fault.wrong_identity(self.identity))
        return ActiveFault(lambda: faults.remove(fault), lambda: fault.struck)


class Unplugged(Description):
    """Pull out an instrument's cable, or have a drive go off its bus; what mends plugs it in again."""

    fault: Literal["disconnect", "bus_off"]
    role: str

    def check(self, bench: "FaultTarget") -> None:
        """Raise ValueError for a role that is unknown or has the other kind of cable."""
        super().check(bench)
        bench.faults(self.role)
        on_bus = ("can", "can-fd") if self.fault == "bus_off" else ("visa", "modbus", "serial")
        _only(self.role, _reached_by(bench, *on_bus), self.fault)

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Pull it out."""
        connection = bench.connection(self.role)
        connection.pull()
        return ActiveFault(connection.plug)


def _reached_by(bench: "FaultTarget", *transports: str) -> tuple[str, ...]:
    return tuple(role for role in bench.roles if bench.transport(role) in transports)


def _only(role: str, allowed: tuple[str, ...], fault: str) -> None:
    if role not in allowed:
        raise ValueError(f"{fault} is nothing that role {role!r} can have; allowed: {', '.join(allowed)}")


#: Kinds that find their messages themselves.
_OWN_MESSAGES = (*_READING_KINDS, "wrong_channel")
