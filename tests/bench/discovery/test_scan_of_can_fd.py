"""Nodes of CAN FD are found where a person said that a bus has it, and nothing is asked elsewhere."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tomli_w import dumps

from bench.motor.motor_file import load_motor
from drivers.mjbots.identity import RECOGNITION
from sim_instruments.catalogue import SimulatedUnit, find
from sim_instruments.server.served_bench import ServedBench
from tests.command_line import Call


@pytest.fixture(scope="module")
def served() -> Iterator[ServedBench]:
    motor = load_motor("lg-400w").virtual_motor()
    unit = SimulatedUnit(find("mjbots-moteus"), "inverter", {"maximum_current": 20.0})
    with ServedBench(motor, speedup=20.0, seed=4, units=(unit,)) as made:
        yield made


def bus_of(served: ServedBench) -> str:
    where: Any = served.addresses()["inverter"]["can"]
    return f"{where['interface']}/{where['channel']}"


def scanned(call: Call, *words: str) -> dict[str, Any]:
    status, out, _ = call("station", "scan", *words, "--named-only", "--json")
    assert status == 0
    told: dict[str, Any] = json.loads(out)
    return told


def test_a_moteus_is_found_on_a_bus_that_has_can_fd(served: ServedBench, call: Call, tmp_path: Path) -> None:
    file = tmp_path / "found.toml"
    told = scanned(call, "--can", f"{bus_of(served)}?fd=true", "--output", str(file))
    (found,) = told["found"]
    assert (found["manufacturer"], found["model"]) == ("mjbots", "moteus")
    assert found["address"] == f"can://{bus_of(served)}?fd=true&node=5"
    assert [one["driver"] for one in found["drivers"]] == ["mjbots-moteus"]
    content = file.read_text(encoding="utf-8")
    assert f'# serial_number = "{found["serial_number"]}"' in content
    assert "# maximum_current =    # A" in content


def test_nothing_is_asked_of_a_bus_that_nobody_said_has_it(served: ServedBench, call: Call) -> None:
    told = scanned(call, "--can", bus_of(served))
    assert told["found"] == []
    assert all("CAN FD" not in one["what"] for one in told["asked"])


def test_a_moteus_is_found_behind_an_fdcanusb(served: ServedBench, call: Call) -> None:
    address = str(served.addresses()["inverter"]["fdcanusb"])
    bus = address.partition("?")[0]
    (found,) = scanned(call, "--can", bus)["found"]
    assert found["address"] == address


def test_a_station_s_moteus_answers(served: ServedBench, call: Call, tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    table = {"driver": "mjbots-moteus", "address": f"can://{bus_of(served)}?node=5", "maximum_current": 5.0}
    station.write_text(dumps({"station": {"name": "x"}, "instruments": {"inverter": table}}), encoding="utf-8")
    told = scanned(call, "--station", str(station))
    assert told["station"]["inverter"]["fits"] is True
    assert [one["station"] for one in told["found"]] == [["inverter"]]


@pytest.mark.parametrize("data", ["", "2a8102 04030100 03000000 2ba002 11111111 22222222 33333333", "210000", "7f"])
def test_what_is_none_is_not_recognised(data: str) -> None:
    assert RECOGNITION.identity_of(bytes.fromhex(data)) is None
