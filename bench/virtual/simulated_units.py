"""The simulated instruments that stand for a station's own, as its drivers name them."""

from dataclasses import dataclass, fields
from typing import Any

from bench.files.toml_file import near
from bench.plugins.catalogues import Catalogues
from bench.station.station_file import Entry
from drivers.interfaces.text import Text, text
from sim_instruments.catalogue import SimulatedUnit

#: What a driver's options say of the real unit and its wires, which the virtual one has otherwise.
OF_THE_UNIT = frozenset(
    {
        "serial_number", "drive_unit", "transducer_unit", "direction_from", "eds", "heartbeat_time",
        "torque_inverted", "speed_decimals", "power_step", "drive_code",
        "heartbeat_node", "watchdog_time", "poll_interval", "settle_interval", "calibration",
    }
)  # fmt: skip


@dataclass(frozen=True)
class MissingCounterpart:
    """The reason why the simulated instrument that a driver names cannot stand for its instrument.

    It is a `slip` of the declaration where it names one of another role, or nearly one that there is; else it may not be installed.
    """

    why: Text
    slip: bool


def unit_of(entry: Entry, catalogues: Catalogues) -> SimulatedUnit | None:
    """Return the simulated instrument that a station's driver names; None where it names none that can stand for it."""
    kind = catalogues.simulated_instruments.get(entry.driver.simulated)
    if kind is None or kind.role != entry.role.value:
        return None
    return SimulatedUnit(kind, entry.role.value, stated_options(entry))


def missing_counterpart(entry: Entry, catalogues: Catalogues) -> MissingCounterpart | None:
    """Return why the simulated instrument that a driver names cannot stand for its instrument; None where it can, or none is named."""
    known, name = catalogues.simulated_instruments, entry.driver.simulated
    if not name:
        return None
    about = {"driver": entry.driver.name, "name": name}
    if (kind := known.get(name)) is not None:
        if kind.role == entry.role.value:
            return None
        why = text(
            "driver {driver} names the simulated instrument {name}, which is one for {other}", **about, other=kind.role
        )
        return MissingCounterpart(why, slip=True)
    of_role = [other for other, each in known.items() if each.role == entry.role.value]
    why = text(
        "driver {driver} names the simulated instrument {name}, which does not exist: {why}",
        **about,
        why=known.why_not(name, of_role),
    )
    return MissingCounterpart(why, slip=name not in known.names and bool(near(name, of_role)))


def stated_options(entry: Entry) -> dict[str, Any]:
    """Return what the station file says of an instrument, and no more than its driver's ratings."""
    stated = {option.name: getattr(entry.options, option.name) for option in fields(entry.options)}  # type: ignore[arg-type]
    for name, rating in entry.driver.ratings.items():
        given = stated.get(name)
        stated[name] = rating if given is None else min(rating, given)
    return {name: value for name, value in stated.items() if value is not None}
