"""Largest values in a station file: numbers above zero, in a unit that is named."""

from pathlib import Path

import pytest

from bench.i18n.errors import InputError
from bench.station.station_file import load_station

STATION = """
[station]
name = "s"
[instruments.{role}]
driver = "{driver}"
address = "TCPIP0::192.0.2.1::INSTR"
{options}
"""


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ('"15 A"', "'15 A' is text, not a number; give a number in A, such as 15, allowed is a number above 0 A"),
        ('"15"', "'15' is text, not a number; give a number in A, such as 15, allowed is a number above 0 A"),
        ('"15000 mA"', "'15000 mA' is text, not a number; give a number in A, allowed is a number above 0 A"),
        ("-3.0", "-3.0; allowed is a number above 0 A"),
        ("0", "0; allowed is a number above 0 A"),
        ("nan", "nan; allowed is a number above 0 A"),
        ("inf", "inf; allowed is a number above 0 A"),
    ],
)
def test_what_is_no_largest_value_is_refused(tmp_path: Path, given: str, said: str) -> None:
    path = tmp_path / "station.toml"
    path.write_text(STATION.format(role="supply", driver="keysight-e36300", options=f"maximum_current = {given}"))
    with pytest.raises(InputError) as refused:
        load_station(path)
    assert str(refused.value) == f"{path}: instruments.supply.maximum_current = {said}"


@pytest.mark.parametrize(
    ("role", "driver", "key", "unit"),
    [
        ("inverter", "cia402-inverter", "maximum_frequency", "Hz"),
        ("dynamometer", "delta-dyn200", "rated_torque", "N·m"),
        ("lcr_meter", "keysight-e4980a", "maximum_level", "V rms"),
    ],
)
def test_each_has_its_unit(tmp_path: Path, role: str, driver: str, key: str, unit: str) -> None:
    path = tmp_path / "station.toml"
    path.write_text(STATION.format(role=role, driver=driver, options=f"{key} = 'x'"))
    with pytest.raises(InputError, match=f"{key} = 'x' is text, not a number; give a number in {unit}, allowed is"):
        load_station(path)


def test_another_number_that_is_text_is_refused_as_well(tmp_path: Path) -> None:
    path = tmp_path / "station.toml"
    path.write_text(STATION.format(role="supply", driver="keysight-e36300", options="over_voltage_margin = '10 %'"))
    with pytest.raises(InputError, match="over_voltage_margin = '10 %'; allowed is a finite number"):
        load_station(path)
