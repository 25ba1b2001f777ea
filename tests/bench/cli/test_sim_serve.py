"""The virtual bench in a process of its own, measured by another process through the wires."""

import json
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bench.cli.run import run
from bench.cli.sim.serve import serve
from bench.i18n.errors import InputError, UsageError
from bench.station.station_file import load_station
from bench.virtual.served_clock import ServedClock
from bench.virtual.served_world import ServedWorld
from tests.studies.forked import Forked, command, motorbench

SERVE = (sys.executable, "-m", "bench", "sim", "serve", "--motor", "lg-400w")


class Served:
    """`motorbench sim serve` running, and what it has said of itself."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "station.toml"
        words = ("--json", "--speedup", "100", "--seed", "3", "--station-file", str(self.file))
        self.process = Forked(motorbench, "sim", "serve", "--motor", "lg-400w", *words)
        self.told: dict[str, Any] = json.loads(self.process.stdout.readline())

    def end(self, number: signal.Signals) -> tuple[int, str, str]:
        """Status, output and errors after a signal."""
        self.process.send_signal(number)
        output, errors = self.process.communicate(timeout=10.0)
        assert self.process.returncode is not None
        return self.process.returncode, output, errors


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    made = Served(tmp_path_factory.mktemp("served"))
    yield made
    made.process.close()


def test_the_station_file_is_ready(served: Served) -> None:
    station = load_station(served.file)
    assert tomllib.loads(served.file.read_text(encoding="utf-8")) == served.told["station"]
    assert station.control == served.told["control"]
    assert set(served.told["addresses"]) == {role.value for role in station.entries}
    assert served.told["pid"] == served.process.pid
    assert served.told["motor"]["truth"]["pole_pairs"] == 4.0
    assert list(served.told["addresses"]["supply"]) == ["hislip", "socket", "vxi11"]
    assert list(served.told["addresses"]["dynamometer"]) == ["tcp", "rtu"]


def test_every_instrument_is_found(served: Served) -> None:
    done = command("station", "check", str(served.file), "--json")
    told = json.loads(done.stdout)
    assert (done.returncode, told["good"]) == (0, True), done.stdout


def test_a_run_through_the_wires_holds_the_truth(served: Served, tmp_path: Path) -> None:
    words = ("stator-resistance", "pole-pairs-static", "pole-pairs-back-emf", "--station", str(served.file))
    done = command("run", *words, "--motor", "lg-400w", "--operator", "virtual", "--runs", str(tmp_path), "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["parameters"]["pole_pairs"]["value"] == 4
    resistance = result["parameters"]["stator_resistance"]
    assert abs(resistance["value"] - 0.016) < 4.0 * resistance["standard_uncertainty"]
    with ServedWorld(served.told["control"]) as world:
        assert world.truth()["energised"] is False
        assert world.motor_truth() == served.told["motor"]["truth"]


@pytest.mark.slow
def test_a_fault_waits_on_a_served_bench_for_the_step_that_the_run_reports(served: Served, tmp_path: Path) -> None:
    phrase = "supply: disconnect at step 3.1.2.1/3 of pole-pairs-static after 1"
    words = ("pole-pairs-static", "--station", str(served.file), "--motor", "lg-400w", "--runs", str(tmp_path))
    done = command("run", *words, "--json", "--fault", phrase)
    result = json.loads(done.stdout)
    assert (done.returncode, result["status"]) == (1, "failed")
    assert "supply" in result["cause"]
    assert [step["id"] for step in result["procedures"]["pole-pairs-static"]["steps"]][-1] == "3.1.2.1/3"
    with ServedWorld(served.told["control"]) as world:
        truth = world.truth()
        # Nobody reaches a supply whose cable is out, and the run has said so.
        assert truth["output_on"] is True
        assert "supply could not be made safe" in result["cause"]
    refused = command("run", *words, "--fault", "drive: silence at 1")
    assert refused.returncode == 2
    assert "role 'drive' is unknown" in refused.stderr
    with ServedWorld(served.told["control"]) as world:
        assert world.mend()["disconnected"] == []
    again = command("run", *words, "--json")
    assert again.returncode == 0, again.stderr
    with ServedWorld(served.told["control"]) as world:
        assert world.truth()["energised"] is False


def test_whoever_knows_the_control_endpoint_has_hands(served: Served) -> None:
    with ServedWorld(served.told["control"]) as world:
        before = world.clock.now()
        world.clock.sleep(1.0)
        assert world.clock.now() >= before + 1.0
        world.connect({"A": "lcr_high", "B": "lcr_low"})
        world.lock_rotor()
        assert world.truth()["rotor_locked"] is True
        with pytest.raises(RuntimeError, match="the rotor is locked"):
            world.turn_shaft(1.0)
        world.release_rotor()
        world.turn_shaft(2.0)
        world.hold_shaft()
        world.let_go()
        first = world.dial_angle()
        assert world.nudge_to_next_rest() > 0.0
        world.clock.sleep(2.0)
        assert world.dial_angle() > first
        world.short_leads(True)
        world.short_leads(False)
        world.attach_voltage_probe(1, "A", "star")
        world.attach_current_probe(4, "A")
        world.detach_probe(1)
        world.attach_voltmeter("A", "B")
        world.hold_shaft()
        world.couple_dynamometer()
        world.uncouple_dynamometer()
        world.let_go()
        world.connect({})


# The last two: they end the bench that the others use.


def test_sigterm_ends_it_cleanly_and_the_next_run_says_that_it_is_gone(served: Served, tmp_path: Path) -> None:
    assert served.end(signal.SIGTERM) == (0, "", "")
    with pytest.raises(InputError, match=r"does not answer.*start motorbench sim serve again"):
        run("stator-resistance", station=str(served.file), motor="lg-400w", runs=tmp_path)


def test_the_output_is_a_station_file_and_ctrl_c_ends_it(tmp_path: Path) -> None:
    with subprocess.Popen(SERVE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert "served at 1 × real time" in process.stderr.readline()
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=10.0)
    assert (process.returncode, errors) == (0, "")
    file = tmp_path / "station.toml"
    file.write_text(output, encoding="utf-8")
    station = load_station(file)
    assert station.control.startswith("http://127.0.0.1:")
    assert "# inverter     can     can://slcan/socket://127.0.0.1:" in output


@pytest.mark.parametrize("speedup", [0.0, -1.0, 5000.0, float("nan")])
def test_an_impossible_speed_is_refused(speedup: float) -> None:
    with pytest.raises(UsageError, match=r"--speedup .* allowed is 0.1 to 1000"):
        serve(motor="lg-400w", speedup=speedup)


@pytest.mark.parametrize("host", ["::1", "localhost", "nowhere.invalid", ""])
def test_a_host_that_is_no_address_is_refused(host: str) -> None:
    with pytest.raises(UsageError, match="IPv4"):
        serve(motor="lg-400w", host=host)


def test_what_cannot_be_served_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"192\.0\.2\.1 cannot be used: .*--host"):
        serve(motor="lg-400w", host="192.0.2.1")
    with pytest.raises(InputError, match="the file cannot be written"):
        serve(motor="lg-400w", station_file=tmp_path / "missing" / "station.toml")
    (there := tmp_path / "station.toml").write_text("mine", encoding="utf-8")
    with pytest.raises(UsageError, match="already exists; choose another file, or overwrite it with --force"):
        serve(motor="lg-400w", station_file=there)
    assert there.read_text(encoding="utf-8") == "mine"


def test_the_virtual_operator_needs_a_virtual_bench(tmp_path: Path) -> None:
    file = tmp_path / "station.toml"
    file.write_text('[station]\nname = "Bench 1"\n', encoding="utf-8")
    with pytest.raises(UsageError, match=r"\[station\] control"):
        run("stator-resistance", station=str(file), motor="lg-400w", operator="virtual", runs=tmp_path)


@pytest.mark.parametrize("control", ["127.0.0.1:8000", "https://127.0.0.1:8000", "http://127.0.0.1", "http://a b:1"])
def test_a_control_address_that_is_none_is_refused(tmp_path: Path, control: str) -> None:
    file = tmp_path / "station.toml"
    file.write_text(f'[station]\nname = "Bench 1"\ncontrol = "{control}"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"station\.control"):
        load_station(file)


def test_time_goes_as_on_the_bench() -> None:
    clock = ServedClock(100.0, 200.0)
    before = clock.now()
    assert before >= 100.0
    clock.sleep(2.0)
    clock.sleep(-1.0)
    assert before + 2.0 <= clock.now() < before + 200.0


def test_a_fixture_is_served_with_a_station_file_that_loads(tmp_path: Path) -> None:
    file = tmp_path / "station.toml"
    words = ("--motor", "lg-400w", "--fixture", "--json", "--station-file", str(file))
    process = Forked(motorbench, "sim", "serve", *words)
    try:
        told = json.loads(process.stdout.readline())
        roles = {"switch_matrix", "rotor_actuator", "insulation_tester"}
        assert roles <= told["addresses"].keys()
        assert roles <= {role.value for role in load_station(file).entries}
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=10.0)
        process.close()
    assert process.returncode == 0


DUMMY = """
from drivers.catalogue import Driver
from drivers.interfaces import Role
from drivers.keysight.options import Keysight34461AOptions
from sim_instruments.catalogue import SimulatedInstrument

def fail(place):
    raise RuntimeError("no such range")

DRIVER = Driver("acme-dm5", Role.VOLTMETER, Keysight34461AOptions, "nowhere:open", simulated={simulated!r})
SIMULATED = SimulatedInstrument("acme-dm5", {role!r}, {transport!r}, fail, machine={machine})
"""
STATION = """
[station]
name = "own"
[plugins]
files = ["acme.py"]
[instruments.voltmeter]
driver = "acme-dm5"
address = "TCPIP0::192.0.2.11::inst0::INSTR"
"""


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"simulated": ""}, "driver acme-dm5 names no simulated instrument"),
        (
            {"simulated": "acme-dm6"},
            "driver acme-dm5 names the simulated instrument acme-dm6, which does not exist: did you mean acme-dm5",
        ),
        ({"role": "supply"}, "driver acme-dm5 names the simulated instrument acme-dm5, which is one for supply"),
        ({"machine": "fail"}, "RuntimeError: no such range"),
        ({}, "RuntimeError: no such range"),
        ({"transport": "pigeon"}, "transport 'pigeon' is unknown; there are visa, modbus, serial, can"),
    ],
)
def test_an_instrument_that_cannot_be_served_is_named_with_the_reason(
    tmp_path: Path, changed: dict[str, str], why: str
) -> None:
    words = {"simulated": "acme-dm5", "role": "voltmeter", "transport": "visa", "machine": "None", **changed}
    (tmp_path / "acme.py").write_text(DUMMY.format(**words), encoding="utf-8")
    file = tmp_path / "station.toml"
    file.write_text(STATION, encoding="utf-8")
    with pytest.raises(InputError, match=rf"^instruments\.voltmeter cannot be served: {why}"):
        serve(motor="lg-400w", station=file)


def test_a_station_is_served_without_what_belongs_to_its_real_units(tmp_path: Path) -> None:
    given = """
[station]
name = "own"
visa_library = "@ivi"
[instruments.supply]
use = "small"
[instruments.supply.small]
driver = "keysight-e36300"
address = "TCPIP0::192.0.2.10::inst0::INSTR"
channel = 2
serial_number = "MY1"
maximum_voltage = 20.0
[instruments.supply.small.calibration]
date = 2026-01-01
due = 2099-01-01
certificate = "C1"
[instruments.switch_matrix]
driver = "keysight-34970a"
address = "TCPIP0::192.0.2.12::inst0::INSTR"
crosspoints = { "A:supply+" = 201 }
"""
    file, made = tmp_path / "station.toml", tmp_path / "served.toml"
    file.write_text(given, encoding="utf-8")
    with pytest.raises(UsageError, match="this is the file given with --station"):
        serve(motor="lg-400w", station=file, station_file=file)
    with pytest.raises(UsageError, match="whether there is a fixture"):
        serve(motor="lg-400w", station=file, fixture=True)
    words = ("--motor", "lg-400w", "--json", "--station", str(file), "--station-file", str(made))
    process = Forked(motorbench, "sim", "serve", *words)
    try:
        told = json.loads(process.stdout.readline())["station"]
        assert set(told["instruments"]["supply"]) == {"driver", "address", "channel", "maximum_voltage"}
        assert told["instruments"]["switch_matrix"]["crosspoints"]["A:supply+"] != 201
        assert "visa_library" not in told["station"]
        checked = json.loads(command("station", "check", str(made), "--json").stdout)
        assert checked["good"] is True
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=10.0)
        process.close()
