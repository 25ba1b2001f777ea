"""The station's file: which instruments stand on the bench, by role, each with its driver, address and options."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from datetime import date
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import Field

from bench.files.photo import Photo, photo_beside
from bench.files.toml_file import Section, near, nearest, read, validate
from bench.i18n.errors import FileError, at
from bench.plugins.catalogue import OURS
from bench.plugins.catalogues import Catalogues, installed
from bench.plugins.files import PluginsSection, catalogues_of
from bench.station import calibration
from bench.station.calibration import Calibration
from bench.station.driver_options import read_options
from bench.station.interlock_entries import InterlockEntry, interlocks_of
from bench.station.shutdown_sequence import ShutdownSection, ShutdownSequence, shutdown_sequence_of
from bench.station.station_limits import take_limits
from bench.station.watchdog_relay_entries import RelayEntry, relays_of
from drivers.catalogue import MANUAL, REPLY_TIME, Driver
from drivers.interfaces.text import Text, lines, text
from procedures.core.bench import Role
from procedures.core.result import Notice

#: What stands in place of a file for the virtual bench in this process.
VIRTUAL = "virtual"
#: What to do where there is no station file.
NO_STATION = text("motorbench station new writes one, and the virtual bench needs none: --station virtual")
#: Keys of an instrument's table that are not its driver's.
_COMMON = ("driver", "address", "name", "reply_time")
#: Key of a role with several instruments.
USE = "use"


class _Station(Section):
    name: str = Field(min_length=1, description="the station's name, text in quotes")
    visa_library: str = "@py"
    overdue: Literal["warn", "refuse"] = "warn"
    signatures: int = Field(default=0, ge=0, le=5, description="how many people must sign a run at the panel")
    photo: str = Field(default="", max_length=255, description="the name of a JPEG or PNG file beside this one")
    control: str = Field(
        default="",
        pattern=r"^(http://[^\s/:]+:[0-9]{1,5})?$",
        description='the address of a served virtual bench\'s control endpoint, like "http://127.0.0.1:8000"',
    )


class _Instrument(Section):
    driver: str = Field(description="the driver's name, text in quotes")
    address: str = ""
    name: str = ""
    reply_time: float | None = Field(default=None, ge=0.1, le=10.0, json_schema_extra={"unit": "s"})


class GuardianSection(Section):
    """`[guardian]`: how long (s) a run may be silent, or not get on, before its guardian carries out the shutdown."""

    heartbeat: float = Field(default=0.6, ge=0.2, le=10.0, json_schema_extra={"unit": "s"})
    stalled: float = Field(default=60.0, ge=1.0, le=3600.0, json_schema_extra={"unit": "s"})


class FixtureSection(Section):
    """`[fixture]`: what a fixture knows that a person would read; `winding_temperature` (°C) is that of the room it tests in."""

    winding_temperature: float | None = Field(default=None, ge=-60.0, le=250.0, json_schema_extra={"unit": "°C"})


class _Tables(Section):
    """Tables that a station's file and a line's have in common."""

    plugins: PluginsSection = Field(default_factory=PluginsSection)
    fixture: FixtureSection = Field(default_factory=FixtureSection)
    guardian: GuardianSection = Field(default_factory=GuardianSection)
    instruments: dict[Role, dict[str, Any]] = Field(default_factory=dict)
    way_down: list[ShutdownSection] = Field(default_factory=list)
    interlocks: dict[str, dict[str, Any]] = Field(default_factory=dict)
    watchdog_relays: dict[str, dict[str, Any]] = Field(default_factory=dict)


class _File(_Tables):
    station: _Station


class _Listed(_Tables):
    """A file, of a station or a line, of which only the plug-ins are wanted."""

    station: _Station | None = None
    line: dict[str, Any] = Field(default_factory=dict)
    sockets: dict[str, dict[str, Any]] = Field(default_factory=dict)


_Kind = TypeVar("_Kind", _File, _Listed)


@dataclass(frozen=True)
class Entry:
    """One instrument of a station: `name` stands for it in messages, `limits` are the station's, by key (SI units).

    While it is energised it has `reply_time` (s) for an answer. `table` is what the file says of it.
    """

    role: Role
    driver: Driver
    address: str
    options: object
    name: str
    calibration: Calibration | None = None
    limits: Mapping[str, float] = field(default_factory=dict)
    reply_time: float = REPLY_TIME
    table: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Station:
    """A station that was read: its instruments by role, the VISA library they are reached by, and what identifies it.

    `overdue` says what becomes of a run with an instrument whose calibration is overdue; `control` is where the hands
    of a virtual bench in another process are to be had; `way_down` is how it becomes harmless, `interlocks` are the
    contacts that must be closed while anything is energised, `fixture` is what a fixture in place of hands knows, `watchdog_relays`
    are fed while what is behind them is energised. `catalogues` are what can be had here, the file's plug-ins included;
    `outputs` name those that finished records are handed to; `photo` shows the bench or its fixture.
    """

    source: str
    name: str
    content: str
    sha256: str
    visa_library: str
    entries: Mapping[Role, Entry]
    overdue: Literal["warn", "refuse"] = "warn"
    control: str = ""
    way_down: ShutdownSequence = field(default_factory=ShutdownSequence)
    guardian: GuardianSection = field(default_factory=GuardianSection)
    interlocks: tuple[InterlockEntry, ...] = ()
    fixture: FixtureSection = field(default_factory=FixtureSection)
    watchdog_relays: tuple[RelayEntry, ...] = ()
    catalogues: Catalogues = field(default_factory=installed)
    outputs: tuple[str, ...] = ()
    photo: Photo | None = None

    def check_calibrations(self, today: date, roles: Iterable[Role]) -> tuple[Notice, ...]:
        """Return a warning for every calibration among these roles that is overdue.

        Raises InputError where the station refuses that, and for a calibration of the future in any role.
        """
        entered = [(e.role.value, e.calibration) for e in self.entries.values() if e.calibration is not None]
        used = {role.value for role in roles}
        return calibration.check(entered, today, self.source, used=used, refuse=self.overdue == "refuse")


def catalogues_at(station: str) -> Catalogues:
    """Return what is available at a station or line, a file's path or `virtual`; the file's drivers are not loaded.

    Raises InputError for a file with a key that none has.
    """
    if station == VIRTUAL:
        return installed()
    _, data = read(Path(station), text("station file"), NO_STATION)
    return catalogues_of(_validated(_Listed, data, station).plugins, station)


def load_station(path: Path) -> Station:
    """Read a station file. Raises InputError naming file, key, what was given and what is allowed."""
    content, data = read(path, text("station file"), NO_STATION)
    station = make_station(data, str(path), content)
    return replace(station, photo=photo_beside(str(path), "station.photo", data["station"].get("photo", "")))


def _validated(kind: type[_Kind], data: Mapping[str, Any], source: str) -> _Kind:
    for role in data.get("instruments", {}) if isinstance(data.get("instruments"), dict) else ():
        if role not in [known.value for known in Role]:
            raise FileError(
                text(
                    "{source}: unknown key instruments.{role}; {hint}",
                    source=source,
                    role=role,
                    hint=nearest(role, [known.value for known in Role]),
                )
            )
    return validate(kind, data, source)


def make_station(data: Mapping[str, Any], source: str, content: bytes) -> Station:
    """Return the station that a file's content describes; raises InputError as `load_station` does."""
    file = _validated(_File, data, source)
    catalogues = catalogues_of(file.plugins, source)
    entries = {role: _chosen(role, table, source, catalogues) for role, table in file.instruments.items()}
    digest = hashlib.sha256(content).hexdigest()
    return Station(
        source,
        file.station.name,
        content.decode("utf-8"),
        digest,
        file.station.visa_library,
        entries,
        file.station.overdue,
        file.station.control,
        shutdown_sequence_of(
            file.way_down, {role: entry.driver.name == MANUAL for role, entry in entries.items()}, source
        ),
        file.guardian,
        interlocks_of(file.interlocks, source, catalogues.interlocks),
        file.fixture,
        relays_of(file.watchdog_relays, entries, source, catalogues.watchdog_relays),
        catalogues,
        tuple(file.plugins.records),
    )


def _chosen(role: Role, table: Mapping[str, Any], source: str, catalogues: Catalogues) -> Entry:
    """Return a role's instrument; of several by name, each is read, and `use` says which one runs take."""
    if USE not in table:
        return _entry(role, table, source, catalogues, f"instruments.{role.value}")
    prefix = f"instruments.{role.value}"
    tables = {name: own for name, own in table.items() if name != USE}
    for name, own in tables.items():
        if not isinstance(own, dict):
            raise FileError(
                text(
                    "{source}: {prefix}.{name}: with {prefix}.use each instrument has a table of its own: [{prefix}.NAME]",
                    source=source,
                    prefix=prefix,
                    name=name,
                )
            )
    entries = {name: _entry(role, own, source, catalogues, f"{prefix}.{name}") for name, own in tables.items()}
    if table[USE] not in entries:
        hint = nearest(str(table[USE]), list(entries))
        raise FileError(
            text("{source}: {prefix}.use = {name!r}: {hint}", source=source, prefix=prefix, name=table[USE], hint=hint)
        )
    return entries[table[USE]]


def _entry(role: Role, table: Mapping[str, Any], source: str, catalogues: Catalogues, prefix: str) -> Entry:
    common = validate(_Instrument, {key: table[key] for key in _COMMON if key in table}, source, prefix)
    driver = catalogues.driver(common.driver, role)
    if driver is None:
        raise FileError(at(source, _no_driver(common.driver, role, prefix, catalogues)))
    # Ours are tested; to look at one its module would be imported.
    unfit = driver.unfit() if catalogues.drivers.origin(driver.name).name != OURS else None
    if unfit is not None:
        raise FileError(at(source, text("{prefix}.driver: {unfit}", prefix=prefix, unfit=unfit)))
    if driver.needs_address and not common.address:
        raise FileError(
            text(
                "{source}: {prefix}.address is missing; {name} needs the address it answers at",
                source=source,
                prefix=prefix,
                name=driver.name,
            )
        )
    limits, own = take_limits(role, {key: table[key] for key in table if key not in _COMMON}, source, prefix)
    calibrated, given = calibration.take_entry(own, source, prefix)
    if calibration.KEY in given and calibration.KEY not in [option.name for option in fields(driver.options)]:
        raise FileError(
            text(
                "{source}: {prefix}.{key}: {name} takes date, due and certificate here and no accuracies; "
                "they have options of their own",
                source=source,
                prefix=prefix,
                key=calibration.KEY,
                name=driver.name,
            )
        )
    options = read_options(driver.options, given, source, prefix)
    name, reply_time = common.name or role.value, common.reply_time or driver.reply_time
    return Entry(role, driver, common.address, options, name, calibrated, limits, reply_time, table)


def _no_driver(name: str, role: Role, prefix: str, catalogues: Catalogues) -> Text:
    """Say why a driver cannot be had: its plug-in is broken, it fills another role, or nobody brings it."""
    drivers, names = catalogues.drivers, catalogues.drivers_for(role)
    faults = [] if name in drivers else drivers.faults(name)
    messages = [
        text("{prefix}.driver = {driver!r} is no driver for this role", prefix=prefix, driver=name),
        *(text("did you mean {name}?", name=meant) for meant in near(name, names)),
        *faults,
        text("for {role} there are {names}", role=role.value, names=drivers.known(names)),
        text("other drivers come with an installed package or a file named in [plugins] files"),
    ]
    return lines(messages, between="; ")
