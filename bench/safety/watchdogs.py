"""The watchdog that removes the energy from each role if all processes of the bench end at once, and the roles that have none."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from bench.station.shutdown_sequence import OFF_BY
from bench.station.station_file import Entry, Station
from bench.station.watchdog_relay_entries import RelayEntry
from drivers.catalogue import MANUAL
from drivers.interfaces import Instrument, Watchdog, Watching, WhenSilent
from drivers.interfaces.text import Text, text
from procedures.core.bench import Role

_ACTIONS: Mapping[WhenSilent, Text] = {
    WhenSilent.VOLTAGE_OFF: text("it switches its voltage off"),
    WhenSilent.COAST: text("it coasts to a stop"),
    WhenSilent.CONTACT_OPENS: text("its contact opens"),
    WhenSilent.AS_SET_UP: text("it acts as it is configured for a missing heartbeat"),
}


@dataclass(frozen=True)
class RoleWatchdog:
    """The watchdog of a role that feeds energy; `relay` names the relay whose watchdog it is.

    `armed` is false for one that is only asked for. Without a watchdog `by_hand` says that a person switches it, `error` why
    nobody knows.
    """

    role: Role
    watchdog: Watchdog | None = None
    relay: str = ""
    armed: bool = False
    by_hand: bool = False
    error: str = ""

    @property
    def missing(self) -> bool:
        """True if nothing removes the energy."""
        return self.watchdog is None and not self.by_hand

    @property
    def words(self) -> Text:
        """It, for a person."""
        role = self.role.value
        if self.by_hand:
            return text("{role}: set and switched off by hand", role=role)
        if self.error:
            return text("{role}: could not be opened, so it is not known whether it has a watchdog", role=role)
        if self.watchdog is None:
            return text("{role}: no watchdog; it stays on if run and guardian end at the same time", role=role)
        told = {"role": role, "time": self.watchdog.time, "setting": self.watchdog.setting}
        action = _ACTIONS[self.watchdog.action]
        if self.relay:
            return text(
                "{role}: watchdog relay {relay}, {time:g} s, then {action} ({setting})",
                **told,
                relay=self.relay,
                action=action,
            )
        if self.armed:
            return text("{role}: watchdog armed, {time:g} s, then {action} ({setting})", **told, action=action)
        return text(
            "{role}: watchdog of {time:g} s, then {action} ({setting}), where the instrument has one",
            **told,
            action=action,
        )

    def as_dict(self) -> dict[str, Any]:
        """Return it for a record."""
        watchdog = self.watchdog
        return {
            "role": self.role.value,
            "watchdog": None
            if watchdog is None
            else {"time": watchdog.time, "action": watchdog.action.value, "setting": watchdog.setting},
            "relay": self.relay or None,
            "armed": self.armed,
            "by_hand": self.by_hand,
            "error": self.error or None,
        }


def planned_watchdogs(station: Station, roles: Collection[Role]) -> list[RoleWatchdog]:
    """Return what the station file asks for, by role, of those that feed energy; nothing is opened."""
    return [one for entry in _feeding(station, roles) for one in _planned(station, entry)]


def armed_watchdogs(
    station: Station, opened: Mapping[Role, Instrument], errors: Mapping[Role, str]
) -> list[RoleWatchdog]:
    """Return what is armed on the instruments that are open, by role, of those that feed energy; `errors` kept the others from it."""
    result = []
    for entry in _feeding(station, station.entries):
        relays = list(_behind(station, entry.role))
        if entry.driver.name == MANUAL or (entry.role not in opened and relays):
            result += _planned(station, entry)
            continue
        if entry.role in opened:
            if (own := watchdog_of(opened[entry.role])) is not None:
                result.append(RoleWatchdog(entry.role, own, armed=True))
            elif not relays:
                result.append(RoleWatchdog(entry.role))
        else:
            result.append(RoleWatchdog(entry.role, error=errors.get(entry.role, "")))
        result += relays
    return result


def watchdog_of(owner: object) -> Watchdog | None:
    """Return the watchdog of an instrument, or the one that its options ask for."""
    return owner.watchdog if isinstance(owner, Watching) else None


def _feeding(station: Station, roles: Collection[Role]) -> list[Entry]:
    return [station.entries[role] for role in OFF_BY if role in station.entries and role in roles]


def _planned(station: Station, entry: Entry) -> list[RoleWatchdog]:
    if entry.driver.name == MANUAL:
        return [RoleWatchdog(entry.role, by_hand=True)]
    own = watchdog_of(entry.options)
    found = [RoleWatchdog(entry.role, own)] if own else []
    return [*found, *_behind(station, entry.role)] or [RoleWatchdog(entry.role)]


def _behind(station: Station, role: Role) -> Iterator[RoleWatchdog]:
    for relay in station.watchdog_relays:
        if role in relay.roles and (watchdog := _of_relay(relay)) is not None:
            yield RoleWatchdog(role, watchdog, relay=relay.name)


def _of_relay(relay: RelayEntry) -> Watchdog | None:
    return watchdog_of(relay.options)
