"""Tables of a six-step drive's load points as others write them: supply, shaft and winding temperature of each."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.analysis.map_table import SPEED, TORQUE, read_table
from bench.analysis.table_headings import KnownColumn
from bench.captures.written_digits import FloatArray
from bench.i18n.errors import InputError, UsageError, at
from drivers.interfaces.text import Text, text

_LOADS = {
    "voltage": KnownColumn("V", ("voltage", "busvoltage", "supplyvoltage", "dcvoltage", "dclinkvoltage", "spannung", "v", "u", "vs",
                                 "us", "vbus", "ubus", "vdc", "udc", "vin", "uin")),
    "current": KnownColumn("A", ("current", "buscurrent", "supplycurrent", "dccurrent", "dclinkcurrent", "strom", "i", "is", "ibus",
                                 "idc", "iin")),
    "speed": KnownColumn("rad/s", (*SPEED, "drehzahl", "mechanicalspeed", "speedmechanical")),
    "electrical_speed": KnownColumn("rad/s", ("welectrical", "electricalspeed", "speedelectrical", "we", "erpm")),
    "frequency": KnownColumn("Hz", ("frequency", "electricalfrequency", "f", "fe")),
    "torque": KnownColumn("N·m", (*TORQUE, "load", "loadtorque", "shafttorque", "drehmoment")),
    "temperature": KnownColumn("°C", ("temperature", "temp", "windingtemperature", "windingtemp", "temperatur", "tw", "tcu", "twinding",
                                      "theta", "ϑ")),
}  # fmt: skip
_NEEDED = ("voltage", "current", "speed", "torque")
#: Hz of an electrical period do for a speed as well.
_INSTEAD = {"speed": "electrical_speed"}
_RPM = 30.0 / math.pi


@dataclass(frozen=True)
class LoadTable:
    """Load points in the order of their currents: V, A, rad/s of the shaft, N·m braking, °C; all (n,).

    `between` (K) is by how much a temperature that no row states may be off together with the others' of its kind, `before` (°C) that of
    the winding before the first load; `frequency` (Hz, electrical) is None where no column has it. `rows` are the table's rows from 1.
    """

    path: Path
    voltage: FloatArray
    current: FloatArray
    speed: FloatArray
    torque: FloatArray
    temperature: FloatArray
    between: FloatArray
    before: float
    after: float
    frequency: FloatArray | None
    rows: tuple[int, ...]
    assumptions: tuple[Text, ...]


def load_table(
    path: Path,
    mapped: Sequence[str],
    *,
    electrical: bool,
    pole_pairs: int | None,
    before: float | None,
    after: float | None,
) -> LoadTable:
    """Return the load points of a table. Raises InputError for one that is not usable, UsageError for what it leaves open."""
    columns = read_table(path, _LOADS, _NEEDED, mapped, instead=_INSTEAD)
    said: list[Text] = []
    speed = _speed(path, columns, electrical, pole_pairs, said)
    read = {name: columns[name] for name in ("voltage", "current", "torque")} | {"speed": speed}
    _refuse_empty(path, read)
    torque = read["torque"]
    if np.all(torque <= 0.0) and np.any(torque < 0.0):
        torque = -torque
        said.append(text("torques are all negative, and taken as loads that brake the motor"))
    backwards = bool(np.all(speed < 0.0))
    if backwards:
        said.append(
            text("speeds are all negative: the motor turned backwards, which is taken as its forward direction")
        )
    speed = -speed if backwards else speed
    _refuse_not_above_zero(path, {"voltage": read["voltage"], "current": read["current"], "speed": speed})
    temperature, between, said_of_it = _temperatures(path, columns.get("temperature"), speed.size, before, after)
    said += said_of_it
    order = np.argsort(read["current"], kind="stable")
    frequency = columns.get("frequency")
    if frequency is not None and not np.all(np.isfinite(frequency) & (frequency > 0.0)):
        raise InputError(
            at(
                str(path),
                text("column frequency has cells that are empty or not above 0; complete it, or leave it out"),
            )
        )
    return LoadTable(
        path,
        read["voltage"][order],
        read["current"][order],
        speed[order],
        torque[order],
        temperature[order],
        between[order],
        float(np.min(temperature)) if before is None else before,
        float(temperature[-1]) if after is None else after,
        None if frequency is None else frequency[order],
        tuple(int(k) + 1 for k in order),
        tuple(said),
    )  # fmt: skip


def _speed(
    path: Path, columns: Mapping[str, FloatArray], electrical: bool, pole_pairs: int | None, said: list[Text]
) -> FloatArray:
    """Return the shaft's speed (rad/s). Raises UsageError for an electrical one without pole pairs."""
    own = columns.get("speed")
    if own is not None and not electrical:
        return own
    if pole_pairs is None:
        raise UsageError(
            text("{path} has an electrical speed: type --pole-pairs as well, by which it is divided", path=str(path))
        )
    said.append(text("speeds are electrical, divided by {pairs} pole pairs", pairs=pole_pairs))
    return (columns["electrical_speed"] if own is None else own) / pole_pairs


def _refuse_empty(path: Path, columns: Mapping[str, FloatArray]) -> None:
    for name, values in columns.items():
        if not values.size:
            raise InputError(at(str(path), text("has a heading and no row of numbers")))
        if not np.all(np.isfinite(values)):
            raise InputError(
                at(
                    str(path),
                    text(
                        "row {row} has no {name}; complete the row or remove it",
                        row=int(np.argmin(np.isfinite(values))) + 1,
                        name=name,
                    ),
                )
            )


def _refuse_not_above_zero(path: Path, columns: Mapping[str, FloatArray]) -> None:
    for name, values in columns.items():
        wrong = np.flatnonzero(values <= 0.0)
        if wrong.size:
            raise InputError(
                at(
                    str(path),
                    text(
                        "row {row} has a {name} of {value:g}, but a motor that drives a load takes voltage and current and turns one way, "
                        "with values above 0; correct or remove the row",
                        row=int(wrong[0]) + 1,
                        name=name,
                        value=float(values[wrong[0]]),
                    ),
                )
            )


def _temperatures(
    path: Path, column: FloatArray | None, count: int, before: float | None, after: float | None
) -> tuple[FloatArray, FloatArray, list[Text]]:
    """Return the winding's temperature (°C) at each load, and how far one that is not stated may be off (K)."""
    stated = np.full(count, np.nan) if column is None else column
    missing = ~np.isfinite(stated)
    if np.any(stated[~missing] < -60.0) or np.any(stated[~missing] > 250.0):
        raise InputError(
            at(str(path), text("winding temperatures must lie from −60 to 250 °C; check the column's unit"))
        )
    if not missing.any():
        return stated, np.zeros(count), []
    if before is None or after is None:
        raise UsageError(
            text(
                "{path}: {count} rows have no winding temperature. Type --temperature, that before the first load, and "
                "--temperature-after, as soon as the motor stands again (°C)",
                path=str(path),
                count=int(missing.sum()),
            )
        )
    middle, reach = 0.5 * (before + after), 0.5 * abs(after - before)
    said = text(
        "{count} rows have no winding temperature: taken between {before:g} and {after:g} °C, as typed",
        count=int(missing.sum()),
        before=before,
        after=after,
    )
    return np.where(missing, middle, stated), np.where(missing, reach, 0.0), [said]
