"""A moteus watches nothing while it regulates currents: however a run ends, its guardian or the run itself stops it."""

import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import pyvisa

from bench.station.station_file import load_station
from drivers.catalogue import Surroundings
from drivers.interfaces import Role
from tests.studies.energised.held import Run, Served

#: Whatever the end, everything is off soon (s).
SOON = 5.0
STATION = """
[station]
name = "bench with a moteus"
[instruments.supply]
driver = "keysight-e36300"
address = "TCPIP::192.0.2.1::INSTR"
channel = 1
[instruments.dynamometer]
driver = "delta-dyn200"
address = "tcp://192.0.2.2"
maximum_speed = 500.0
[instruments.inverter]
driver = "mjbots-moteus"
address = "can://socketcan/can0?node=5"
maximum_current = 15.0
# Of a bench whose time runs twenty times as fast as the wall's: a second of it is no time for a process.
settle_timeout = 40.0
transition_timeout = 20.0
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("moteus")
    own = folder / "own.toml"
    own.write_text(STATION, encoding="utf-8")
    made = Served(folder, "--station", str(own))
    yield made
    made.end()


@pytest.fixture
def station(served: Served, request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """The served station, with the moteus at its gateway or behind an fdcanusb, whose port is one process' alone."""
    written = served.station.read_text(encoding="utf-8")
    gateway = served.told["station"]["instruments"]["inverter"]["address"]
    address = gateway if request.param == "gateway" else served.told["addresses"]["inverter"]["fdcanusb"]
    path = tmp_path / "station.toml"
    path.write_text(written.replace(gateway, address), encoding="utf-8")
    return path


@pytest.fixture
def run(served: Served, station: Path, tmp_path: Path) -> Iterator[Run]:
    runs = tmp_path / "runs"
    runs.mkdir()
    made = Run(served, runs, "wait", station=station)
    yield made
    made.drop()


def safe(run: Run) -> list[tuple[Any, Any]]:
    events = run.guardian_left()
    return [(e.data["instrument"], e.data["item"]) for e in events if e.data.get("outcome") == "safe"]


@pytest.mark.parametrize("station", ["gateway", "fdcanusb"], indirect=True)
def test_a_killed_run_leaves_it_stopped(run: Run, served: Served) -> None:
    run.signal(signal.SIGKILL)
    assert served.seconds_until_off() < SOON
    done = safe(run)
    assert ("inverter", "disable") in done
    assert ("supply", "output_off") in done
    assert run.journal[-1].kind == "energised"


@pytest.mark.parametrize("station", ["gateway"], indirect=True)
def test_a_frozen_run_leaves_it_stopped_and_does_not_start_it_again(run: Run, served: Served) -> None:
    run.signal(signal.SIGSTOP)
    assert served.seconds_until_off() < SOON
    run.signal(signal.SIGCONT)
    assert run.ended()["status"] == "aborted"
    assert served.world.truth()["energised"] is False


@pytest.mark.parametrize("station", ["gateway"], indirect=True)
def test_a_run_whose_guardian_dies_stops_it_itself(run: Run, served: Served) -> None:
    os.kill(run.guardian_pid, signal.SIGKILL)
    assert served.seconds_until_off() < SOON
    assert run.ended()["status"] == "aborted"


@pytest.mark.parametrize("station", ["gateway"], indirect=True)
def test_where_both_die_it_goes_on_until_somebody_stops_it(run: Run, served: Served, station: Path) -> None:
    run.signal(signal.SIGSTOP)
    os.kill(run.guardian_pid, signal.SIGKILL)
    run.signal(signal.SIGKILL)
    served.world.clock.sleep(20.0)
    # As station check says of it: without a watchdog it stays on, and so does what has none either.
    assert served.world.truth()["inverter_enabled"] is True
    with ExitStack() as leaving:
        for role in (Role.INVERTER, Role.SUPPLY, Role.DYNAMOMETER):
            entry = load_station(station).entries[role]
            surroundings = Surroundings(served.world.clock, pyvisa.ResourceManager, guarding=True)
            instrument = entry.driver.open(entry.address, entry.options, surroundings, name=role.value)
            leaving.callback(instrument.close)
            instrument.make_safe()
    assert served.world.truth()["energised"] is False


@pytest.mark.parametrize("station", ["gateway", "fdcanusb"], indirect=True)
def test_a_run_that_is_interrupted_stops_it_itself(run: Run, served: Served) -> None:
    run.signal(signal.SIGTERM)
    assert served.seconds_until_off() < SOON
    told = run.ended()
    assert (told["status"], told["cause"].splitlines()[0]) == ("aborted", "interrupted by SIGTERM")
