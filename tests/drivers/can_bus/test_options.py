"""What a station file says of a drive is judged when it is read."""

from pathlib import Path
from typing import Any

import pytest

from bench.i18n.errors import InputError
from bench.station.station_file import make_station
from drivers.interfaces import Role

SHEET = Path(__file__).parents[3] / "docs/examples/virtual-inverter.eds"
OBJECT = {"object": "0x2000:00", "type": "u32", "scale": 1e-3}


def station(**given: Any) -> Any:
    table = {
        "driver": "cia402-inverter", "address": "can://virtual/x?node=5", "maximum_current": 1.0, "maximum_frequency": 1.0
    }  # fmt: skip
    data = {"station": {"name": "bench"}, "instruments": {"inverter": {**table, **given}}}
    return make_station(data, "bench.toml", b"")


def test_what_the_manual_says_is_taken() -> None:
    options: Any = station(field_current=OBJECT, velocity_unit="0.1 rpm", eds=str(SHEET)).entries[Role.INVERTER].options
    assert (options.field_current.index, options.field_current.scale) == (0x2000, 1e-3)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"velocity_unit": "furlongs"}, "velocity_unit: 'furlongs' is no unit of velocity; allowed are rpm"),
        ({"pole_pairs": 0}, "pole_pairs = 0 must be 1 or more"),
        ({"increments_per_turn": -1}, "increments_per_turn = -1 must be 1 or more"),
        ({"current_scale": 0.0}, "current_scale = 0.0 must be above 0"),
        ({"rated_current": -1.0}, "rated_current = -1.0 must be above 0"),
        (
            {"field_current": {**OBJECT, "object": "2000"}},
            "field_current.object = '2000' is no object; write 0x2010:00",
        ),
        ({"field_current": {**OBJECT, "scale": 0.0}}, "field_current.scale = 0.0 must be above 0"),
        ({"field_current": {**OBJECT, "type": "f32"}}, "field_current.type"),
        ({"eds": "/no/such.eds"}, "eds = '/no/such.eds' cannot be read"),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as caught:
        station(**given)
    assert "bench.toml" in str(caught.value)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "no section of an object"),
        (b"\xff\xfe\0\1", "is no electronic data sheet"),
        (b"[6040\n", "is no electronic data sheet"),
        (b"[1000]\n[1018]\n[6040]\n[6041]\n[6060]\n[2000]\n", "the drive has no 0x6061,"),
        (b"[1000]\n[1018]\n[6040]\n[6041]\n[6060]\n[6061]\n", "the drive has no 0x2000,"),
    ],
)
def test_a_data_sheet_without_what_is_needed(tmp_path: Path, content: bytes, said: str) -> None:
    sheet = tmp_path / "drive.eds"
    sheet.write_bytes(content)
    with pytest.raises(InputError, match=r"instruments\.inverter\.eds = ") as caught:
        station(field_current=OBJECT, eds=str(sheet))
    assert said in str(caught.value)
