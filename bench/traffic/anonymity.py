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


def anonymous(recording: SessionRecording) -> SessionRecording:
    """Return a recording whose hosts are called by their roles, and whose serial numbers are crossed out, byte for byte."""
    tables = {
        role: {**_bare(table), **({"address": address_of(role, table["address"])} if "address" in table else {})}
        for role, table in recording.tables.items()
    }
    crossed = {role: _numbers(recording, role) for role in recording.carriers}
    lines = [_crossed_out(line, crossed.get(line.role, set())) for line in recording.lines]
    return replace(recording, tables=tables, lines=lines)


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


def _numbers(recording: SessionRecording, role: Role) -> set[bytes]:
    found, asked = set(), False
    for line in recording.of(role):
        if line.kind == ">":
            asked = _ASKED.match(line.content) is not None
        elif line.kind == "<" and asked and (match := _THIRD_FIELD.match(line.content)):
            found.add(match[1])
    return found


def _crossed_out(line: TrafficLine, numbers: set[bytes]) -> TrafficLine:
    content = _SERIAL_OBJECT.sub(rb"\g<1>00000000", line.content)
    for number in numbers:
        content = content.replace(number, b"X" * len(number))
    return replace(line, content=content)
