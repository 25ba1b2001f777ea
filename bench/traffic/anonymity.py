"""A recording without what tells whose instruments they are: network addresses and serial numbers."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from bench.traffic.traffic_file import SessionRecording, TrafficLine
from drivers.interfaces import Role

#: Options that say which piece it is.
_OWN = ("serial_number", "certificate")
#: The replies that have a serial number as their third field.
_ASKED = re.compile(rb"\*IDN\?|SYST\w*:CTYP\w*\?")
_THIRD_FIELD = re.compile(rb"[^,]*,[^,]*,\s*([^,\s]{4,})\s*,")
#: Subindex 4 of the identity object (CiA 301) in a reply to its upload.
_SERIAL_OBJECT = re.compile(rb"(#43181004)[0-9A-F]{8}")
#: The three registers of a moteus' serial number (0x120) in a frame of CAN FD, on a bus or as an fdcanusb tells it.
_SERIAL_REGISTERS = re.compile(rb"((?:##[0-9A-F]|rcv [0-9A-F]+ )(?:[0-9A-F]{2})*?2BA002)[0-9A-F]{24}", re.IGNORECASE)


def anonymous(recording: SessionRecording) -> SessionRecording:
    """Return a recording whose hosts are called by their roles, and whose serial numbers are crossed out, byte for byte."""
    numbers = InstrumentSerials()
    for line in recording.lines:
        numbers.learn(line)
    return replace(
        recording,
        tables=anonymous_tables(recording.tables),
        lines=[numbers.crossed_out(line) for line in recording.lines],
    )


def anonymous_tables(tables: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return instruments' tables of a station file, by role, whose hosts are called by their roles, without serial numbers."""
    return {
        role: {**_bare(table), **({"address": address_of(role, table["address"])} if "address" in table else {})}
        for role, table in tables.items()
    }


class InstrumentSerials:
    """The serial numbers that the instruments have told."""

    def __init__(self) -> None:
        self._numbers: dict[Role, set[bytes]] = {}
        self._asked: set[Role] = set()

    def learn(self, line: TrafficLine) -> None:
        """Look whether a line tells one; lines come in their order."""
        if line.kind == ">":
            (self._asked.add if _ASKED.match(line.content) else self._asked.discard)(line.role)
        elif line.kind == "<" and line.role in self._asked and (match := _THIRD_FIELD.match(line.content)):
            self._numbers.setdefault(line.role, set()).add(match[1])

    def crossed_out(self, line: TrafficLine) -> TrafficLine:
        """Return a line without those of its instrument that are known by now."""
        content = _SERIAL_OBJECT.sub(rb"\g<1>00000000", line.content)
        content = _SERIAL_REGISTERS.sub(rb"\g<1>" + b"0" * 24, content)
        for number in self._numbers.get(line.role, ()):
            content = content.replace(number, b"X" * len(number))
        return replace(line, content=content)


def address_of(role: str, address: str) -> str:
    """Return an address with its role in place of a host, and without a USB instrument's serial number."""
    host = role.replace("_", "-")
    address = re.sub(r"(?i)^(TCPIP[0-9]*|VICP[0-9]*)::[^:]+(?=::|$)", rf"\1::{host}", address.strip())
    address = re.sub(r"(?i)^(USB[0-9]*::[^:]+::[^:]+)::[^:]+", r"\1::XXXX", address)
    return re.sub(r"(?i)((?:tcp|socket)://)[^:/?]+", rf"\1{host}", address)


def _bare(table: Mapping[str, Any]) -> dict[str, Any]:
    return {
        key: _bare(value) if isinstance(value, Mapping) else value for key, value in table.items() if key not in _OWN
    }
