"""The station's file: which instruments stand on the bench, by role, each with its driver, address and options."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from datetime import date
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from bench.files.toml_file import Section, nearest, read, validate
from bench.i18n.errors import InputError
from bench.station import calibration
from bench.station.calibration import Calibration
from bench.station.driver_options import read_options
from bench.station.interlock_entries import InterlockEntry, interlocks_of
from bench.station.shutdown_sequence import ShutdownSection, ShutdownSequence, shutdown_sequence_of
from bench.station.station_limits import take_limits
from bench.station.watchdog_relay_entries import RelayEntry, relays_of
from drivers import catalogue as registry
from drivers.interfaces.text import text
from procedures.core.bench import Role
from procedures.core.result import Notice

#: What stands in place of a file for the virtual bench in this process.
VIRTUAL = "virtual"
#: Keys of an instrument's table that are not its driver's.
_COMMON = ("driver", "address", "name", "reply_time")


class _Station(Section):
    name: str = Field(min_length=1, description="the station's name, text in quotes")
    visa_library: str = "@py"
    overdue: Literal["warn", "refuse"] = "warn"
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
    """`[guardian]`: how long (s) a run may be silent, or not get on, before its guardian takes the way down."""

    heartbeat: float = Field(default=0.6, ge=0.2, le=10.0, json_schema_extra={"unit": "s"})
    stalled: float = Field(default=60.0, ge=1.0, le=3600.0, json_schema_extra={"unit": "s"})


class FixtureSection(Section):
    """`[fixture]`: what a fixture knows that a person would read; `winding_temperature` (°C) is that of the room it tests in."""

    winding_temperature: float | None = Field(default=None, ge=-60.0, le=250.0, json_schema_extra={"unit": "°C"})


class _File(Section):
    station: _Station
    fixture: FixtureSection = Field(default_factory=FixtureSection)
    guardian: GuardianSection = Field(default_factory=GuardianSection)
    instruments: dict[Role, dict[str, Any]] = Field(default_factory=dict)
    way_down: list[ShutdownSection] = Field(default_factory=list)
    interlocks: dict[str, dict[str, Any]] = Field(default_factory=dict)
    watchdog_relays: dict[str, dict[str, Any]] = Field(default_factory=dict)


@dataclass(frozen=True)
class Entry:
    """One instrument of a station: `name` stands for it in messages, `limits` are the station's, by key (SI units).

    While it is energised it has `reply_time` (s) for an answer.
    """

    role: Role
    driver: registry.Driver
    address: str
    options: object
    name: str
    calibration: Calibration | None = None
    limits: Mapping[str, float] = field(default_factory=dict)
    reply_time: float = registry.REPLY_TIME


@dataclass(frozen=True)
class Station:
    """A station that was read: its instruments by role, the VISA library they are reached by, and what identifies it.

    `overdue` says what becomes of a run with an instrument whose calibration is overdue; `control` is where the hands
    of a virtual bench in another process are to be had; `way_down` is how it becomes harmless, `interlocks` are the
    contacts that must be closed while anything is energised, `fixture` is what a fixture in place of hands knows, `watchdog_relays`
    are fed while what is behind them is energised.
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

    def check_calibrations(self, today: date, roles: Iterable[Role]) -> tuple[Notice, ...]:
        """Return a warning for every calibration among these roles that is overdue.

        Raises InputError where the station refuses that, and for a calibration of the future in any role.
        """
        entered = [(e.role.value, e.calibration) for e in self.entries.values() if e.calibration is not None]
        used = {role.value for role in roles}
        return calibration.check(entered, today, self.source, used=used, refuse=self.overdue == "refuse")


def load_station(path: Path) -> Station:
    """Read a station file. Raises InputError naming file, key, what was given and what is allowed."""
    content, data = read(path, text("station file"))
    return make_station(data, str(path), content)


def make_station(data: Mapping[str, Any], source: str, content: bytes) -> Station:
    """Return the station that a file's content describes; raises InputError as `load_station` does."""
    for role in data.get("instruments", {}) if isinstance(data.get("instruments"), dict) else ():
        if role not in [known.value for known in Role]:
            raise InputError(
                text(
                    "{source}: unknown key instruments.{role}; {hint}",
                    source=source,
                    role=role,
                    hint=nearest(role, [known.value for known in Role]),
                )
            )
    file = validate(_File, data, source)
    entries = {role: _entry(role, table, source) for role, table in file.instruments.items()}
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
            file.way_down, {role: entry.driver.name == registry.MANUAL for role, entry in entries.items()}, source
        ),
        file.guardian,
        interlocks_of(file.interlocks, source),
        file.fixture,
        relays_of(file.watchdog_relays, entries, source),
    )


def _entry(role: Role, table: Mapping[str, Any], source: str) -> Entry:
    prefix = f"instruments.{role.value}"
    common = validate(_Instrument, {key: table[key] for key in _COMMON if key in table}, source, prefix)
    names = registry.drivers_for(role)
    if not names:
        raise InputError(
            text(
                "{source}: {prefix}: there is no driver for this role; take the table out of the file",
                source=source,
                prefix=prefix,
            )
        )
    if common.driver not in names:
        raise InputError(
            text(
                "{source}: {prefix}.driver = {driver!r} is no driver for this role; {hint}",
                source=source,
                prefix=prefix,
                driver=common.driver,
                hint=nearest(common.driver, names),
            )
        )
    driver = registry.find(common.driver, role)
    if driver.needs_address and not common.address:
        raise InputError(
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
        raise InputError(
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
    return Entry(role, driver, common.address, options, name, calibrated, limits, reply_time)
