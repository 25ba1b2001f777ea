"""A scan of the virtual bench on real sockets, terminals and a CAN gateway: everything is found, and nothing of it changes."""

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tomli_w import dumps

from bench.motor.motor_file import load_motor
from bench.station.station_file import load_station
from bench.virtual.virtual_station import describe
from procedures.core.bench import Role
from sim_instruments.server.served_bench import ServedBench
from tests.command_line import Call

ONE_FRAMING = "?baudrate=9600&parity=N&stopbits=2"


@pytest.fixture(scope="module")
def served() -> Iterator[ServedBench]:
    motor = load_motor("lg-400w").virtual_motor()
    with ServedBench(motor, speedup=50.0, seed=4, fixture=True) as bench:
        yield bench


def plain(thing: object, depth: int = 0) -> object:
    """What an instrument holds in numbers and words, clocks, locks and connections left out."""
    if isinstance(thing, bool | int | float | str | bytes | None):
        return thing
    if isinstance(thing, np.ndarray):
        return thing.tolist()
    if isinstance(thing, dict):
        return {str(key): plain(value, depth + 1) for key, value in thing.items()}
    if isinstance(thing, list | tuple | set | frozenset):
        return [plain(value, depth + 1) for value in thing]
    if depth < 3 and type(thing).__module__.startswith("sim_instruments.instruments"):
        return {name: plain(value, depth + 1) for name, value in vars(thing).items()}
    return type(thing).__name__


def state_of(served: ServedBench) -> dict[str, Any]:
    """Settings and error queues of every instrument, and what feeds energy."""
    world = served.bench.world
    found: dict[str, Any] = {"inverter": world.inverter.enabled, "dynamometer": world.dynamometer.enabled}
    found["roles"] = list(served.bench.roles)
    # A tachometer takes nothing, and counts the readings that it sends.
    for role in set(served.bench.roles) - {"tachometer"}:
        instrument = served.bench.instrument(role)
        units = getattr(instrument, "units", None)
        parts = list(units.values()) if isinstance(units, dict) else [instrument]
        found[f"{role} settings"] = [plain(part) for part in parts]
        if hasattr(instrument, "errors") and hasattr(instrument.errors, "__len__"):
            found[f"{role} errors"] = len(instrument.errors)
    return found


def port(address: object) -> str:
    fields = str(address).split("::")
    return f"{fields[1]}:{fields[2].partition(',')[2] or fields[2]}"


def test_a_station_file_s_addresses_answer_and_nothing_changes(call: Call, tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    motor = load_motor("lg-400w").virtual_motor()
    with ServedBench(motor, speedup=50.0, seed=4, fixture=True, hostile=7) as served:
        station.write_text(dumps(describe(served.preferred(), served.control)), encoding="utf-8")
        before = state_of(served)
        status, out, err = call("station", "scan", "--station", str(station), "--named-only", "--json")
        after = state_of(served)
        served.bench.instrument("supply").write(b"VOLT 1.5,(@2)\n")
        set_otherwise = state_of(served)
    told = json.loads(out)
    assert (status, err) == (0, "")
    assert {role for role, one in told["station"].items() if one["fits"]} == set(before["roles"])
    assert all(one["answered"] for one in told["asked"])
    assert after == before
    # The comparison does see a setting.
    assert set_otherwise != before


def test_what_is_found_makes_a_station_file_that_holds(served: ServedBench, call: Call, tmp_path: Path) -> None:
    ways = served.addresses()
    hosts = [
        port(ways["supply"]["socket"]),
        port(ways["voltmeter"]["socket"]),
        port(ways["insulation_tester"]["socket"]),
    ]
    inverter: Any = ways["inverter"]["can"]
    file = tmp_path / "found.toml"
    words = ("--host", *hosts, "--modbus", str(ways["dynamometer"]["rtu"]) + ONE_FRAMING, "--units", "1-2")
    more = ("--serial", str(ways["tachometer"]["serial"]), "--can", f"{inverter['interface']}/{inverter['channel']}")
    status, out, err = call("station", "scan", *words, *more, "--named-only", "--output", str(file), "--json")
    told = json.loads(out)
    assert status == 0
    assert "units 1 to 2 in 1 framings, at most" in err
    drivers = {one["drivers"][0]["driver"] for one in told["found"]}
    assert drivers == {
        "keysight-e36300", "keysight-34461a", "gwinstek-gpt9800", "delta-dyn200", "lutron-tachometer", "cia402-inverter",
    }  # fmt: skip
    made = load_station(file)
    assert set(made.entries) == {Role.SUPPLY, Role.VOLTMETER, Role.INSULATION_TESTER, Role.TACHOMETER}
    content = file.read_text(encoding="utf-8")
    assert "# maximum_speed =    # rad/s" in content
    assert "# drive_unit = 1\n# transducer_unit = 2" in content
    # A node fits three roles: a person says which.
    assert content.count("can have several roles") == 6
    status, out, _ = call("station", "check", str(file), "--json")
    assert (status, json.loads(out)["good"]) == (0, True)
    assert call("station", "scan", "--named-only", "--output", str(file))[0] == 2
    assert file.read_text(encoding="utf-8") == content


def test_a_framed_line_is_swept_until_somebody_answers(served: ServedBench, call: Call) -> None:
    line = str(served.addresses()["dynamometer"]["rtu"]).removeprefix("rtu://")
    status, out, _ = call("station", "scan", "--modbus", line, "--units", "1-2", "--named-only", "--json")
    (found,) = json.loads(out)["found"]
    assert status == 0
    assert found["drivers"] == [
        {"driver": "delta-dyn200", "role": "dynamometer", "options": {"drive_unit": 1, "transducer_unit": 2}}
    ]
    assert "baudrate=" in found["address"]


def test_a_line_with_a_part_of_a_dynamometer_names_the_driver_near(served: ServedBench, call: Call) -> None:
    line = str(served.addresses()["dynamometer"]["tcp"])
    status, out, _ = call("station", "scan", "--modbus", line, "--units", "2", "--named-only", "--language", "en")
    assert status == 0
    assert "unit 2: DYN-200, torque with" in out
    assert "no driver recognises it; near: delta-dyn200" in out


def test_an_instrument_is_one_whatever_the_ways_to_it(
    served: ServedBench, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bench.discovery.scpi.ANSWER_TIME", 0.6)
    ways = served.addresses()["supply"]
    hosts = (port(ways["hislip"]), str(ways["socket"]))
    _, out, _ = call("station", "scan", "--host", *hosts, "--named-only", "--json")
    (found,) = json.loads(out)["found"]
    assert (found["address"], found["other_addresses"]) == (ways["hislip"], [ways["socket"]])


def test_new_asks_for_the_rest_and_ends_with_the_check(
    served: ServedBench, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "new.toml"
    ways = served.addresses()
    answers = iter(
        [
            "bench 3", "7", "1", "",  # the name; no seventh supply, the first; the dynamometer
            "lots", "", "12.5", "",  # limits of the supply: a wrong one is asked again
            "", "630", "", "", "", "",  # what has no default needs a value
            "voltmeter reversed", "voltmeter",
        ]
    )  # fmt: skip
    monkeypatch.setattr("sys.stdin.readline", lambda: next(answers, "") + "\n", raising=False)
    modbus = f"{ways['dynamometer']['tcp']}"
    words = ("--host", port(ways["supply"]["socket"]), "--modbus", modbus, "--units", "1-2", "--named-only")
    status, out, err = call("station", "new", str(file), *words, "--language", "en")
    assert status == 0, out + err
    data = tomllib.loads(file.read_text(encoding="utf-8"))
    assert data["station"] == {"name": "bench 3"}
    assert data["instruments"]["supply"]["limits"] == {"maximum_voltage": 12.5}
    assert data["instruments"]["dynamometer"]["maximum_speed"] == 630
    assert data["instruments"]["voltmeter"] == {"driver": "manual"}
    assert "allowed is 0 to 1" in out
    assert "this question has no default; enter a value" in out
    assert "is text, not a number" in out
    # The check's own lines.
    assert "✓ dynamometer" in out


def test_new_writes_nothing_where_the_answers_end(
    served: ServedBench, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin.readline", lambda: "", raising=False)
    file = tmp_path / "new.toml"
    status, _, err = call(
        "station", "new", str(file), "--host", port(served.addresses()["supply"]["socket"]), "--named-only"
    )
    assert status == 1
    assert "nothing was written" in err or "没有写" in err
    assert not file.exists()
