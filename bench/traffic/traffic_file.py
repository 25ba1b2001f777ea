r"""The file of a recording: a station's instruments as TOML, then a line for each call, message and outcome.

    # motorbench traffic 1
    [instruments.lcr_meter]
    driver = "keysight-e4980a"
    …
    --- traffic
         0.000 lcr_meter = open()
         0.001 lcr_meter > *IDN?\n
         0.004 lcr_meter < Keysight Technologies,E4980AL,XXXXXXXXXX,B.07.01\n
    --- end of 3 lines

After time (s) and role stands what the line is. Bytes that are no text are escaped as in Python, or stand as hexadecimal numbers.
While it is recorded the file grows: its head says `unfinished = true`, lines marked `@` tell what carries an instrument's messages,
and there is no end.
"""

import codecs
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, cast, get_args

from tomli_w import dumps

from bench.files.toml_file import decoded, parse, read
from bench.i18n.errors import FileError, InputError
from bench.plugins.files import KEY as PLUGINS
from bench.station.station_file import Station, make_station
from drivers.interfaces import Role
from drivers.interfaces.text import Text, reason_of, text
from drivers.transport.wire import Carrier

VERSION = 1
_FIRST = "# motorbench traffic "
_UNFINISHED = "unfinished"
_TRAFFIC, _END = "--- traffic", "--- end of {} lines"
#: A call of the driver, a message to and from the instrument, one sent beside the calls (by what feeds a watchdog), why none went
#: or came, what came of the call, and what carries an instrument's messages, in a file that grows.
Kind = Literal["=", ">", "<", "~", "!", "#", "@"]
_LINE = re.compile(
    r" *(?P<time>[0-9]{1,12}\.[0-9]{1,9}) (?P<role>[a-z_]+) (?P<kind>[=><~!#@])(?P<hexadecimal>x?)(?: (?P<content>.*))?"
)
#: What stands as words, not as bytes.
_WORDS = "=#@"
#: So many bytes stand on a line of hexadecimal numbers; those that continue it begin with a mark.
_WIDTH, _CONTINUED = 64, "| "
#: A recording is held in memory (bytes).
_LONGEST = 256 * 1024 * 1024


@dataclass(frozen=True)
class TrafficLine:
    """One line: bench `time` (s), `role`, what it is, and its bytes, UTF-8 for what are words; `number` in the file from 1."""

    time: float
    role: Role
    kind: Kind
    content: bytes
    number: int = 0

    @property
    def words(self) -> str:
        """Its content as the file has it, on one line."""
        return self.content.decode("utf-8", "replace") if self.kind in _WORDS else escaped(self.content)

    def row(self) -> str:
        """Return it as the file has it, without the end of line."""
        return f"{self.time:10.3f} {self.role.value} {self.kind}{_shown(self)}".rstrip()


@dataclass(frozen=True)
class SessionRecording:
    """A session: its instruments as a station file has them, by role, what carries their messages, and the lines.

    `plugins_of` is a station file whose plug-ins its drivers may be; `unfinished` is one whose recording was cut short.
    """

    tables: Mapping[str, Mapping[str, Any]]
    carriers: Mapping[Role, Carrier]
    lines: Sequence[TrafficLine]
    about: Mapping[str, Any] = field(default_factory=dict)
    source: str = "recording"
    plugins_of: str = ""
    unfinished: bool = False

    def of(self, role: Role) -> Sequence[TrafficLine]:
        """Return the lines of one instrument."""
        return [line for line in self.lines if line.role is role]

    def station(self) -> Station:
        """Return the station of the recording's instruments. Raises InputError as for a station file."""
        result = {"station": {"name": "recording"}, "instruments": self.tables}
        if not self.plugins_of:
            return make_station(result, self.source, dumps(result).encode())
        plugins = read(Path(self.plugins_of), text("station file"))[1].get(PLUGINS, {})
        return make_station({**result, PLUGINS: plugins}, self.plugins_of, dumps(result).encode())

    def text(self) -> str:
        """Return the file's content."""
        rows = [line.row() for line in self.lines]
        return self.head() + "\n".join([*rows, _END.format(len(rows)), ""])

    def head(self, *, unfinished: bool = False) -> str:
        """Return what stands before the lines, in a file that grows with its mark."""
        carriers = {role.value: carrier for role, carrier in self.carriers.items()}
        about = {**self.about, **({_UNFINISHED: True} if unfinished else {}), "carriers": carriers}
        tables = dumps({"recording": about, "instruments": self.tables})
        return f"{_FIRST}{VERSION}\n{tables}\n{_TRAFFIC}\n"


def read_recording(path: Path, plugins_of: str = "") -> SessionRecording:
    """Read a file; `plugins_of` is a station file whose plug-ins its drivers may be. Raises FileError naming file, line and cause."""
    try:
        if path.stat().st_size > _LONGEST:
            raise FileError(text("{path}: more than {most} MiB are no recording", path=path, most=_LONGEST // 2**20))
        raw = path.read_bytes().removeprefix(codecs.BOM_UTF8)
        if f"\n{_UNFINISHED} = true\n".encode() in raw[: raw.find(_TRAFFIC.encode())]:
            # The last line may have been cut in the middle of a character.
            raw = raw[: raw.rfind(b"\n") + 1]
    except OSError as error:
        raise FileError(
            text("{path}: the recording cannot be read: {error}", path=path, error=reason_of(error))
        ) from None
    return parse_recording(decoded(raw, str(path)), str(path), plugins_of)


def parse_recording(content: str, source: str, plugins_of: str = "") -> SessionRecording:
    """Return the recording in a file's content; raises FileError as `read_recording` does."""
    rows = content.split("\n")
    _check_version(rows[0], source)
    if _TRAFFIC not in rows or not rows[-1] == "":
        raise broken(source, len(rows), text("the file ends early, or lines are missing; have it sent again"))
    start = rows.index(_TRAFFIC)
    try:
        head = parse("\n".join(rows[:start]).encode(), source)
        about = dict(head.pop("recording"))
        unfinished = about.pop(_UNFINISHED, False) is True
        lines = _lines(rows[start + 1 : -1 if unfinished else -2], source, start + 2, torn=unfinished)
        if not unfinished and rows[-2] != _END.format(len(lines)):
            raise broken(source, len(rows) - 1, text("the file ends early, or lines are missing; have it sent again"))
        told = {line.role.value: line.words for line in lines if line.kind == "@"}
        lines = [line for line in lines if line.kind != "@"]
        carriers = {Role(role): cast("Carrier", one) for role, one in {**about.pop("carriers"), **told}.items()}
        if unknown := set(carriers.values()) - set(get_args(Carrier)):
            raise broken(source, 1, text("unknown carrier {carrier}", carrier=sorted(map(str, unknown))[0]))
        tables = head.get("instruments", {})
        # A station file's others, to which nothing was said, are in a file that grows.
        tables = {role: table for role, table in tables.items() if not unfinished or Role(role) in carriers}
        lines = [line for line in lines if not unfinished or line.role in carriers]
        result = SessionRecording(tables, carriers, lines, about, source, plugins_of, unfinished)
        if missing := {line.role.value for line in lines} - {
            role.value for role in result.station().entries.keys() & carriers
        }:
            raise broken(source, 1, text("[instruments.{role}] or its carrier is missing", role=min(missing)))
    except FileError:
        raise
    except InputError as error:
        raise FileError(error.text) from None
    except (KeyError, ValueError, TypeError, AttributeError):
        raise broken(source, 1, text("[recording] or [recording.carriers] is missing or wrong")) from None
    return result


def escaped(data: bytes) -> str:
    """Return bytes as text on one line: what is not printable ASCII is escaped as in Python, and a blank at the end."""
    said = data.decode("latin-1").encode("unicode_escape").decode("ascii")
    return said[:-1] + "\\x20" if said.endswith(" ") else said


def _check_version(first: str, source: str) -> None:
    version = first.removeprefix(_FIRST)
    if version == first or not version.isdecimal():
        raise FileError(
            text("{path}: no recording of motorbench: its first line is not '{first}1'", path=source, first=_FIRST)
        )
    if int(version) != VERSION:
        raise FileError(
            text(
                "{path}: a recording of version {version}; this motorbench reads {known}: update it",
                path=source,
                version=version,
                known=VERSION,
            )
        )


def _shown(line: TrafficLine) -> str:
    if line.kind in _WORDS:
        return f" {line.words}"
    said = escaped(line.content)
    if len(said) <= 2 * len(line.content) + 8:
        return f" {said}"
    rows = [line.content[place : place + _WIDTH].hex(" ") for place in range(0, len(line.content), _WIDTH)]
    return "x " + f"\n{_CONTINUED}".join(rows)


def _lines(rows: Sequence[str], source: str, first: int, *, torn: bool = False) -> list[TrafficLine]:
    """Return the lines; where the file was `torn`, without a last one that may go on."""
    found: list[tuple[int, str, list[str]]] = []
    for number, row in enumerate(rows, first):
        if found and row.startswith(_CONTINUED):
            found[-1][2].append(row.removeprefix(_CONTINUED))
        else:
            found.append((number, row, []))
    if torn and found and _may_go_on(found[-1][1], found[-1][2]):
        found.pop()
    lines = []
    for number, row, more in found:
        try:
            lines.append(_line(number, row, more))
        except ValueError:
            raise broken(source, number, text("no line of a recording: {row}", row=repr(row[:60]))) from None
    return lines


def _may_go_on(row: str, more: Sequence[str]) -> bool:
    """Tell whether a line of hexadecimal numbers is full to its end, so that the next part of it may be missing."""
    match = _LINE.fullmatch(row)
    last = more[-1] if more else (match["content"] or "" if match else "")
    return match is not None and bool(match["hexadecimal"]) and len(last) == 3 * _WIDTH - 1


def _line(number: int, row: str, more: Sequence[str]) -> TrafficLine:
    match = _LINE.fullmatch(row)
    if match is None:
        raise ValueError(row)
    kind = cast("Kind", match["kind"])
    content = _bytes(kind, " ".join([match["content"] or "", *more]), bool(match["hexadecimal"]))
    return TrafficLine(float(match["time"]), Role(match["role"]), kind, content, number)


def _bytes(kind: Kind, said: str, hexadecimal: bool) -> bytes:
    if kind in _WORDS:
        return said.encode()
    return bytes.fromhex(said) if hexadecimal else said.encode("ascii").decode("unicode_escape").encode("latin-1")


def broken(source: str, number: int, said: Text) -> FileError:
    """Return the error of a line that cannot be used."""
    return FileError(text("{path}: line {number}: {said}", path=source, number=number, said=said))
