"""A station whose instruments a served virtual bench plays: which simulated ones, and the station file that reaches them."""

from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, fields
from pathlib import Path
from typing import Any

from bench.files.toml_file import read
from bench.i18n.errors import FileError, InputError
from bench.motor.motor_file import MotorFile
from bench.plugins.catalogue import reason
from bench.station.calibration import KEY as CALIBRATION
from bench.station.station_file import USE, Entry, Station, make_station
from bench.virtual.simulated_units import OF_THE_UNIT, missing_counterpart, unit_of
from drivers.interfaces.text import Text, text
from procedures.core.bench import Role
from sim_instruments.catalogue import FIXTURE, SimulatedUnit


@dataclass(frozen=True)
class StationToServe:
    """A station and the simulated instruments that its drivers name; `data` is its file's content."""

    station: Station
    data: Mapping[str, Any]
    units: tuple[SimulatedUnit, ...]

    @property
    def fixture(self) -> bool:
        """True if it has instruments in place of hands."""
        return any(unit.kind.role in FIXTURE for unit in self.units)

    def file(self, described: Mapping[str, Any]) -> dict[str, Any]:
        """Return the station file of the served bench; `described` is what a virtual bench at its addresses would hold.

        What the file says of the real units, their wires and contacts gives way to what the virtual ones have.
        """
        folder = Path(self.station.source).resolve().parent
        given = self.data["station"]
        result = {**described, "station": {**given, "control": described["station"]["control"]}}
        result["station"].pop("visa_library", None)
        if files := self.data.get("plugins", {}).get("files"):
            result["plugins"] = {"files": [str(folder / file) for file in files]}
        for table in ("fixture", "guardian", "way_down"):
            if table in self.data:
                result[table] = self.data[table]
        result["instruments"] = {
            role.value: self._instrument(entry, described["instruments"][role.value])
            for role, entry in self.station.entries.items()
        }
        return result

    def _instrument(self, entry: Entry, virtual: Mapping[str, Any]) -> dict[str, Any]:
        table = self.data["instruments"][entry.role.value]
        table = table[table[USE]] if USE in table else table
        if entry.driver.name != virtual["driver"]:
            virtual = {"address": virtual["address"]}
        elif entry.role.value not in FIXTURE:
            virtual = {key: value for key, value in virtual.items() if key in {"address"} | OF_THE_UNIT}
        # A fixture's wires and speeds are the virtual bench's, whatever the station has.
        replaced = {CALIBRATION, *(one.name for one in fields(entry.options) if _of_the_unit(one))}  # type: ignore[arg-type]
        return {**{key: value for key, value in table.items() if key not in replaced}, **virtual}


def _of_the_unit(option: "Field[Any]") -> bool:
    has_default = option.default is not MISSING or option.default_factory is not MISSING
    return option.name in OF_THE_UNIT and has_default


def station_to_serve(path: Path, motor: MotorFile) -> StationToServe:
    """Read a station and find the simulated instrument of each of its own.

    Raises InputError for a file that is no station, and naming the first instrument that cannot be served and why.
    """
    content, data = read(path, text("station file"))
    station = make_station(data, str(path), content)
    units = []
    for entry in station.entries.values():
        unit = unit_of(entry, station.catalogues)
        if unit is None:
            raise unserved(entry.role.value, _why(entry, station))
        if entry.role is Role.DRIVE and motor.six_step is None:
            raise unserved(entry.role.value, text("{motor} contains no six-step drive", motor=motor.source))
        try:
            unit.kind.stage(unit.options)
        except Exception as error:
            raise unserved(entry.role.value, reason(error)) from error
        units.append(unit)
    return StationToServe(station, data, tuple(units))


def unserved(role: str, why: Text) -> InputError:
    """Return the error of an instrument that the virtual bench cannot serve."""
    return FileError(text("instruments.{role} cannot be served: {why}", role=role, why=why))


def _why(entry: Entry, station: Station) -> Text:
    missing = missing_counterpart(entry, station.catalogues)
    return missing.why if missing else text("driver {driver} names no simulated instrument", driver=entry.driver.name)
