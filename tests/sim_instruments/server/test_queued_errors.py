"""A served bench for other people's programs: fixed ports, and the errors that their messages queue."""

import json
import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from sim_instruments.server.served_bench import ServedBench
from tests.command_line import Call


def test_what_an_instrument_refuses_is_told_with_its_message(served_bench: Callable[..., ServedBench]) -> None:
    bench = served_bench(seed=1)
    _, host, port, _ = str(bench.addresses()["supply"]["socket"]).split("::")
    with socket.create_connection((host, int(port))) as supply:
        supply.sendall(b"VOLT 3;:VOLT?\n")
        assert float(supply.recv(100)) == 3.0
        assert bench.queued_errors.empty()
        supply.sendall(b"VOLT:FOO 3\n")
        refusal = bench.queued_errors.get(timeout=10.0)
    assert (refusal.role, refusal.message.strip()) == ("supply", "VOLT:FOO 3")
    assert refusal.error == "-113,Undefined header"


def test_ports_follow_each_other(served_bench: Callable[..., ServedBench]) -> None:
    # Below the ports that the system gives away, and another in every process.
    base = 12_000 + 16 * (os.getpid() % 200)
    bench = served_bench(base_port=base)
    assert int(bench.control.rpartition(":")[2]) in range(base, base + 100)
    assert f"::{base + 1}::SOCKET" in str(bench.addresses()["supply"]["socket"])


@pytest.mark.parametrize("role", ["supply", "voltmeter"])
def test_what_an_instrument_understands(call: Call, role: str) -> None:
    code, out, _ = call("sim", "serve", "--motor", "lg-400w", "--commands", role)
    assert code == 0
    assert {"*IDN?", "*RST", ":SYSTEM:ERROR:NEXT?"} <= set(out.upper().split())


@pytest.mark.parametrize(
    ("role", "understood"),
    [
        ("dynamometer", {"unit 1: 2000H … 2002H", "unit 2: 0000H … 0023H", "unit 2: coils (function 05)"}),
        ("inverter", {"6040h:00 u16 rw Controlword", "6041h:00 u16 ro Statusword"}),
        ("switch_matrix", {":ROUTE:CLOSE", ":ROUTE:CLOSE?"}),
    ],
)
def test_what_other_lines_understand_needs_no_motor(call: Call, role: str, understood: set[str]) -> None:
    code, out, _ = call("sim", "serve", "--commands", role, "--json")
    told = json.loads(out)
    assert (code, told["role"]) == (0, role)
    assert understood <= set(told["understands"])


def test_what_a_stations_own_inverter_understands(call: Call, tmp_path: Path) -> None:
    station = tmp_path / "bench.toml"
    station.write_text(
        '[station]\nname = "bench"\n[instruments.inverter]\ndriver = "mjbots-moteus"\n'
        'address = "can://socketcan/can0?node=1"\nmaximum_current = 20.0\n',
        encoding="utf-8",
    )
    code, out, _ = call("sim", "serve", "--station", str(station), "--motor", "lg-400w", "--commands", "inverter")
    assert code == 0
    understood = {"000H rw Mode", "01CH rw Commanded Q current", "00FH ro Fault code", "conf get servo.max_current_A"}
    assert understood | {"tel get servo_control", "d stop"} <= set(out.splitlines())


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        (("--motor", "lg-400w", "--commands", "tachometer"), "allowed are dynamometer, insulation_tester"),
        (("--motor", "lg-400w", "--base-port", "80"), "allowed is 1024 to"),
        ((), "--motor is missing:"),
    ],
)
def test_what_cannot_be_served_is_refused(call: Call, typed: tuple[str, ...], said: str) -> None:
    code, out, err = call("sim", "serve", *typed)
    assert (code, out) == (2, "")
    assert said in err
