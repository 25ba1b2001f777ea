"""A line's station file: one socket or several, the instruments of each, and those that all use in turn."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field
from tomli_w import dumps as toml_text

from bench.files.toml_file import Section, read, validate
from bench.i18n.errors import FileError, UsageError
from bench.operators.fixture import ROLES as FIXTURE_ROLES
from bench.plugins.catalogues import Catalogues, installed
from bench.station.shutdown_sequence import OFF_BY
from bench.station.station_file import NO_STATION, VIRTUAL, Station, make_station
from bench.station.watchdog_relay_entries import check_addresses
from drivers.interfaces.text import text
from procedures.core.bench import Role

#: No line has more sockets.
MOST_SOCKETS = 64
#: Tables of a station file that a socket may have of its own.
_OWN = ("instruments", "way_down", "interlocks", "guardian", "watchdog_relays")


class _Line(Section):
    """`[line]`: what holds for all sockets; `bench`, `sockets` and `shared` only for a line of virtual benches."""

    timeout: float = Field(
        default=600.0, gt=0.0, le=86400.0, strict=True, json_schema_extra={"unit": "s"},
        description="longest wait for an instrument that another socket has",
    )  # fmt: skip
    warm_up: float = Field(
        default=0.0, ge=0.0, le=86400.0, strict=True, json_schema_extra={"unit": "s"},
        description="how long a line that was idle waits before its first motor",
    )  # fmt: skip
    cold_after: float = Field(
        default=4.0, gt=0.0, le=8760.0, strict=True, json_schema_extra={"unit": "h"},
        description="how long after its last motor a line has to warm up again",
    )  # fmt: skip
    bench: Literal["virtual"] | None = None
    name: str = Field(default="virtual line", min_length=1)
    sockets: int = Field(default=1, ge=1, le=MOST_SOCKETS, strict=True, description="how many virtual benches")
    shared: frozenset[Role] = Field(default=frozenset(), description="roles with one unit for all sockets")


class _Socket(Section):
    """`[sockets.NAME]`: a socket's own instruments, and what else of a station file is its own."""

    control: str = ""
    instruments: dict[str, dict[str, Any]] = Field(default_factory=dict)
    way_down: list[dict[str, Any]] = Field(default_factory=list)
    interlocks: dict[str, dict[str, Any]] = Field(default_factory=dict)
    watchdog_relays: dict[str, dict[str, Any]] = Field(default_factory=dict)
    guardian: dict[str, Any] = Field(default_factory=dict)


@dataclass(frozen=True)
class LineSocket:
    """One place for a motor: its name, and its station, None on a virtual bench; that may be the twin of a station."""

    name: str
    station: Station | None
    twin_of: Station | None = None


@dataclass(frozen=True)
class ProductionLine:
    """A line that was read; `shared` are the roles that sockets use in turn, `timeout` (s) the longest wait for one.

    One that was idle for `cold_after` (h) waits for `warm_up` (s) before its first motor.
    """

    source: str
    name: str
    sockets: tuple[LineSocket, ...]
    shared: frozenset[Role]
    timeout: float
    warm_up: float = 0.0
    cold_after: float = 4.0

    @property
    def catalogues(self) -> Catalogues:
        """The catalogues of its sockets, the file's plug-ins included."""
        return self.sockets[0].station.catalogues if self.sockets[0].station else installed()

    @property
    def outputs(self) -> tuple[str, ...]:
        """The names of the outputs that finished records are handed to."""
        return self.sockets[0].station.outputs if self.sockets[0].station else ()

    @property
    def is_virtual(self) -> bool:
        """True if its sockets are virtual benches in the workers' processes."""
        return self.sockets[0].station is None


def load_line(reference: str, sockets: int | None) -> ProductionLine:
    """Return the line of a station file, or of `sockets` virtual benches for `virtual`.

    Raises InputError for a bad file, UsageError where the file says how many sockets there are and `sockets` says otherwise.
    """
    if sockets is not None and not 1 <= sockets <= MOST_SOCKETS:
        raise UsageError(
            text("--sockets {sockets}: allowed are 1 to {most_sockets}", sockets=sockets, most_sockets=MOST_SOCKETS)
        )
    if reference == VIRTUAL:
        return _virtual(_Line(bench="virtual", sockets=sockets or 1), VIRTUAL)
    content, data = read(Path(reference), text("station file"), NO_STATION)
    line = validate(_Line, data.get("line", {}), reference, "line")
    if line.bench == VIRTUAL:
        if set(data) != {"line"}:
            raise FileError(
                text("{reference}: a line of virtual benches has a table [line] and nothing else", reference=reference)
            )
        return _virtual(line if sockets is None else line.model_copy(update={"sockets": sockets}), reference)
    for key in ("name", "sockets", "shared"):
        if key in line.model_fields_set:
            raise FileError(
                text('{reference}: line.{key} goes with line.bench = "virtual"', reference=reference, key=key)
            )
    station_line = _real(data, reference, content, line)
    if sockets is not None and sockets != len(station_line.sockets):
        raise UsageError(
            text(
                "--sockets {sockets}: {reference} has {count}; leave it out",
                sockets=sockets,
                reference=reference,
                count=len(station_line.sockets),
            )
        )
    return station_line


def _virtual(line: _Line, source: str) -> ProductionLine:
    virtual_sockets = tuple(LineSocket(str(number + 1), None) for number in range(line.sockets))
    return ProductionLine(
        source,
        line.name,
        virtual_sockets,
        line.shared if line.sockets > 1 else frozenset(),
        line.timeout,
        line.warm_up,
        line.cold_after,
    )


def _real(data: Mapping[str, Any], source: str, content: bytes, line: _Line) -> ProductionLine:
    tables = data.get("sockets")
    if tables is None:
        own = {key: value for key, value in data.items() if key != "line"}
        # Its worker and its runs read the text again, which is to be a station's.
        station = make_station(own, source, toml_text(own).encode() if "line" in data else content)
        one = (LineSocket("1", station),)
        return ProductionLine(source, station.name, one, frozenset(), line.timeout, line.warm_up, line.cold_after)
    if not isinstance(tables, dict) or not 1 <= len(tables) <= MOST_SOCKETS:
        raise FileError(
            text(
                "{source}: sockets: give 1 to {most_sockets} tables [sockets.NAME]",
                source=source,
                most_sockets=MOST_SOCKETS,
            )
        )
    shared: set[Role] = set()
    sockets = []
    for name, table in tables.items():
        station = _socket_station(data, name, table, source)
        sockets.append(LineSocket(name, station))
        shared |= {role for role in station.entries if role.value in data.get("instruments", {})}
    feeding = sorted(role.value for role in shared & set(OFF_BY))
    if feeding and len(sockets) > 1:
        raise FileError(
            text(
                "{source}: instruments.{feeding} feeds energy and cannot be shared: the guardian of one socket would switch it off "
                "under another. Give each socket its own: [sockets.NAME.instruments.{feeding}]",
                source=source,
                feeding=feeding[0],
            )
        )
    fixture = sorted(role.value for role in shared & FIXTURE_ROLES)
    if fixture and len(sockets) > 1:
        raise FileError(
            text(
                "{source}: instruments.{fixture} works in place of hands and belongs to one socket: "
                "[sockets.NAME.instruments.{fixture}]",
                source=source,
                fixture=fixture[0],
            )
        )
    check_addresses((relay for socket in sockets if socket.station for relay in socket.station.watchdog_relays), source)
    first = sockets[0].station
    name = first.name if first else ""
    return ProductionLine(
        source,
        name,
        tuple(sockets),
        frozenset(shared) if len(sockets) > 1 else frozenset(),
        line.timeout,
        line.warm_up,
        line.cold_after,
    )


def _socket_station(data: Mapping[str, Any], name: str, table: Any, source: str) -> Station:
    """Return a socket's station as a station file of its own would give it, the shared instruments included."""
    own = validate(_Socket, table, source, f"sockets.{name}") if isinstance(table, dict) else None
    if own is None:
        raise FileError(
            text(
                "{source}: sockets.{name} is no table; give [sockets.{name}.instruments.ROLE]", source=source, name=name
            )
        )
    twice = sorted(set(own.instruments) & set(data.get("instruments", {})))
    if twice:
        raise FileError(
            text(
                "{source}: sockets.{name}.instruments.{twice} and instruments.{twice}: it is either the socket's own or shared",
                source=source,
                name=name,
                twice=twice[0],
            )
        )
    merged = {key: value for key, value in data.items() if key not in ("line", "sockets")}
    merged["instruments"] = {**data.get("instruments", {}), **own.instruments}
    for key in _OWN[1:]:
        if getattr(own, key):
            merged[key] = getattr(own, key)
    if own.control and isinstance(merged.get("station"), dict):
        merged["station"] = {**merged["station"], "control": own.control}
    # Where the file itself is wrong, its own place is named; the text is what a guardian reads.
    return make_station(merged, source, toml_text(merged).encode())


def station_of(content: str, source: str) -> Station:
    """Return a socket's station from the text that its `content` is."""
    from bench.files.toml_file import parse

    raw = content.encode()
    return make_station(parse(raw, source), source, raw)


def digest(line: ProductionLine) -> str:
    """Return what identifies the line: a hash of its sockets' stations."""
    parts = [
        line.name,
        *(s.station.sha256 if s.station else s.name for s in line.sockets),
        *sorted(r.value for r in line.shared),
    ]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()
