from pathlib import Path
from typing import Any

import pytest

from bench.i18n.errors import InputError
from bench.station.station_file import Station, load_station
from procedures.core.bench import Role

STATION = """
[station]
name = "Bench 1"

[instruments.supply]
driver = "keysight-e36300"
address = "TCPIP0::192.0.2.7::inst0::INSTR"
maximum_current = 5.0

[instruments.oscilloscope]
driver = "keysight-infiniivision"
address = "TCPIP0::192.0.2.8::inst0::INSTR"

[instruments.tachometer]
driver = "manual"
"""
LIMITED = STATION + "\n[instruments.supply.limits]\nmaximum_voltage = 4.0\nmaximum_current = 2.5\n"


def read(path: Path, content: str) -> Station:
    path.write_text(content, encoding="utf-8")
    return load_station(path)


def test_a_stations_limits_are_read_beside_the_drivers_options(tmp_path: Path) -> None:
    station = read(tmp_path / "station.toml", LIMITED)
    assert station.entries[Role.SUPPLY].limits == {"maximum_voltage": 4.0, "maximum_current": 2.5}
    supply: Any = station.entries[Role.SUPPLY].options
    assert supply.maximum_current == 5.0
    assert station.entries[Role.OSCILLOSCOPE].limits == {}


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("maximum_voltage = 4.0", "maximum_voltge = 4.0", ["instruments.supply.limits.maximum_voltge", "did you mean"]),
        ("maximum_voltage = 4.0", "maximum_voltage = -4.0", ["maximum_voltage = -4.0", "above 0 and up to 10000 V"]),
        ("maximum_voltage = 4.0", "maximum_voltage = nan", ["instruments.supply.limits.maximum_voltage = nan"]),
        ("maximum_voltage = 4.0", 'maximum_voltage = "4 V"', ["'4 V' is text", "give a number in V"]),
        (
            "maximum_voltage = 4.0",
            "maximum_torque = 4.0",
            ["unknown key instruments.supply.limits.maximum_torque", "did you mean maximum_voltage"],
        ),
        ("supply.limits", "tachometer.limits", ["instruments.tachometer.limits", "has no output to limit"]),
        (
            "[instruments.supply.limits]\nmaximum_voltage = 4.0\nmaximum_current = 2.5",
            "[instruments.inverter]\nlimits = 3.0\ndriver = 'manual'",
            ["instruments.inverter.limits = 3.0", "allowed is a table with maximum_current, maximum_frequency"],
        ),
    ],
)
def test_each_fault_of_the_limits_is_named(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    assert old in LIMITED
    with pytest.raises(InputError) as error:
        read(tmp_path / "station.toml", LIMITED.replace(old, new, 1))
    for part in parts:
        assert part in str(error.value)
