"""The page of the drivers: complete, with the code's defaults, and examples that a station file may hold."""

import re
import tomllib
from dataclasses import MISSING, fields
from pathlib import Path

import pytest

from bench.plugins.catalogues import installed
from bench.station.station_file import make_station
from drivers.catalogue import MANUAL, Driver
from drivers.interfaces import Accuracy, Role

DRIVERS = [driver for drivers in installed().drivers.values() for driver in drivers]

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "drivers.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)


def rows(section: str) -> list[list[str]]:
    """The cells of the table in a section."""
    text = PAGE.split(f"### `{section}`\n", 1)[1].split("\n#", 1)[0]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line[:1] == "|"]


def documented(driver: Driver) -> dict[str, str]:
    """Options of a driver on the page, each with what stands as its default."""
    found: dict[str, str] = {}
    role = ""
    for cells in rows(driver.name)[2:]:
        if driver.name == MANUAL:
            role = cells[0].strip("`") or role
            if role != driver.role.value:
                continue
            cells = cells[1:]
        names = re.findall(r"`(\w+)`", cells[0])
        defaults = [part.strip() for part in cells[1].split(",")]
        found |= dict(zip(names, defaults if len(defaults) == len(names) else defaults * len(names), strict=True))
    return found


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: f"{driver.name}-{driver.role.value}")
def test_every_option_is_on_the_page_with_its_default(driver: Driver) -> None:
    page = documented(driver)
    assert sorted(page) == sorted(field.name for field in fields(driver.options))
    for field in fields(driver.options):
        required = field.default is MISSING and field.default_factory is MISSING
        assert (page[field.name] == "–") is required, field.name
        if not page[field.name].startswith("`"):
            continue
        written = tomllib.loads(f"value = {page[field.name].strip('`')}")["value"]
        assert written == (pytest.approx(field.default, rel=1e-6) if isinstance(written, float) else field.default)


def test_every_number_among_the_defaults_is_written_out() -> None:
    for driver in DRIVERS:
        for field in fields(driver.options):
            if isinstance(field.default, bool | int | float):
                assert documented(driver)[field.name].startswith("`"), f"{driver.name}: {field.name}"


def test_every_driver_is_in_the_table_of_roles() -> None:
    for role in Role:
        line = next(line for line in PAGE.splitlines() if line.startswith(f"| `{role.value}` |"))
        assert all(f"`{driver.name}`" in line for driver in DRIVERS if driver.role is role)


def test_every_driver_of_an_instrument_that_is_spoken_to_says_what_it_was_written_from() -> None:
    assert [driver.name for driver in DRIVERS if driver.needs_address and not driver.sources] == []
    assert [name for name, relay in installed().watchdog_relays.items() if not relay.sources] == []


@pytest.mark.parametrize("example", EXAMPLES)
def test_the_examples_are_station_files(example: str) -> None:
    data = tomllib.loads(example)
    station = make_station({"station": {"name": "bench"}, **data}, "page", example.encode())
    assert len(station.entries) == len(data["instruments"])


def test_the_voltmeters_calibration_is_by_range() -> None:
    data = tomllib.loads(next(one for one in EXAMPLES if "[instruments.voltmeter]" in one))
    station = make_station({"station": {"name": "bench"}, **data}, "page", b"")
    options = station.entries[Role.VOLTMETER].options
    assert options.calibration == {0.1: Accuracy(2e-5, 2e-6, 1e-7, source="certificate 4712")}  # type: ignore[attr-defined]
