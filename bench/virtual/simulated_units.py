"""The simulated instruments that stand for a station's own, as its drivers name them."""

from dataclasses import fields
from typing import Any

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


def unit_of(entry: Entry, catalogues: Catalogues) -> SimulatedUnit | None:
    """Return the simulated instrument that a station's driver names; None where it names none that can stand for it."""
    kind = catalogues.simulated_instruments.get(entry.driver.simulated)
    if kind is None or kind.role != entry.role.value:
        return None
    return SimulatedUnit(kind, entry.role.value, stated_options(entry))


def why_no_unit(entry: Entry, catalogues: Catalogues) -> Text | None:
    """Return why the simulated instrument that a driver names cannot stand for its instrument; None where it names none."""
    name = entry.driver.simulated
    if not name:
        return None
    kind = catalogues.simulated_instruments.get(name)
    why = text("it stands for {other}", other=kind.role) if kind else catalogues.simulated_instruments.why_not(name)
    return text("simulated instrument {name}: {why}", name=name, why=why)


def stated_options(entry: Entry) -> dict[str, Any]:
    """Return what the station file says of an instrument, and no more than its driver's ratings."""
    stated = {option.name: getattr(entry.options, option.name) for option in fields(entry.options)}  # type: ignore[arg-type]
    for name, rating in entry.driver.ratings.items():
        given = stated.get(name)
        stated[name] = rating if given is None else min(rating, given)
    return {name: value for name, value in stated.items() if value is not None}
