"""Ports of a served bench by endpoint."""

import os
import socket
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest

from sim_instruments.server.port_plan import PortPlan, UnknownEndpointError
from sim_instruments.server.served_bench import ServedBench
from tests.command_line import Call
from tests.sim_instruments.server import wires

# Below the ports that the system gives away, and others in every process.
BASE = 16_000 + 16 * (os.getpid() % 200)


def test_endpoints_are_where_the_file_says(served_bench: Callable[..., ServedBench]) -> None:
    ports = {
        "supply": {"hislip": BASE, "socket": BASE + 1, "vxi11": BASE + 7},
        "dynamometer": {"tcp": BASE + 2},
        "can": {"tcp": BASE + 3},
        "emergency_stop": {"tcp": BASE + 4},
        "supply_enable": {"tcp": BASE + 5},
        "control": {"http": BASE + 6},
    }
    bench = served_bench(ports=ports, watchdog_relay=True)
    addresses = bench.addresses()
    assert {way: wires.port_of(address) for way, address in addresses["supply"].items()} == ports["supply"]
    assert wires.port_of(addresses["dynamometer"]["tcp"]) == BASE + 2
    assert wires.port_of(addresses["inverter"]["can"]["channel"]) == BASE + 3  # type: ignore[index]
    assert wires.port_of(bench.interlocks()["emergency_stop"]["address"]) == BASE + 4
    assert wires.port_of(bench.watchdog_relays()["supply_enable"]["address"]) == BASE + 5
    assert wires.port_of(bench.control) == BASE + 6
    assert wires.port_of(addresses["voltmeter"]["socket"]) not in range(BASE, BASE + 8)


def test_the_others_follow_the_base_and_leave_out_what_is_named() -> None:
    plan = PortPlan({"supply": {"socket": 5001}}, base=5000)
    assert [plan.take("lcr_meter", "socket"), plan.take("supply", "socket"), plan.take("voltmeter", "socket")] == [
        5000,
        5001,
        5002,
    ]
    plan.check()


def test_a_port_of_nobody_is_refused() -> None:
    plan = PortPlan({"suply": {"socket": 5001}})
    assert plan.take("supply", "socket") == 0
    with pytest.raises(
        UnknownEndpointError, match=r"this bench has no endpoint suply\.socket; its endpoints are supply\.socket"
    ):
        plan.check()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[supply]\nsocket = 70000\n", "supply.socket = 70000; allowed is"),
        ("[supply]\nvxi = 5001\n", "unknown key supply.vxi"),
        ("supply = 5001\n", "supply must be a table, like [supply]"),
        ("[supply]\nsocket = 5001\nhislip = 5001\n", "supply.socket = 5001 is supply.hislip's, too"),
        ("[suply]\nsocket = 5001\n", "this bench has no endpoint suply.socket; its endpoints are"),
    ],
)
def test_a_file_that_cannot_be_is_refused(call: Call, tmp_path: Path, content: str, said: str) -> None:
    file = tmp_path / "ports.toml"
    file.write_text(content)
    code, out, err = call("sim", "serve", "--motor", "lg-400w", "--ports", str(file))
    assert (code, out) == (2, "")
    assert str(file) in err
    assert said in err.replace("\n", " ")


def test_a_port_that_is_taken_is_named_with_its_endpoint(call: Call, tmp_path: Path) -> None:
    (file := tmp_path / "ports.toml").write_text(f"[supply]\nsocket = {BASE + 9}\n")
    with socket.create_server(("127.0.0.1", BASE + 9)):
        code, out, err = call("sim", "serve", "--motor", "lg-400w", "--ports", str(file))
    assert (code, out) == (1, "")
    said = f"127.0.0.1:{BASE + 9}, for supply.socket, cannot be used: the address is in use already; end the program that uses the port, or"
    assert said in err.replace("\n", " ")


def test_a_client_too_many_is_told_of_once(served_bench: Callable[..., ServedBench]) -> None:
    bench = served_bench()
    port = wires.port_of(bench.addresses()["voltmeter"]["socket"])
    with ExitStack() as leaving:
        clients = [leaving.enter_context(socket.create_connection(("127.0.0.1", port))) for _ in range(66)]
        told = bench.refused_clients.get(timeout=5.0)
        assert (told.endpoint, told.most) == (("voltmeter", "socket"), 64)
        # The first ones go on being served.
        clients[0].sendall(b"*IDN?\n")
        assert b"34461A" in clients[0].recv(100)
    assert bench.refused_clients.empty()


def test_no_patience_at_all_is_refused(call: Call) -> None:
    code, out, err = call("sim", "serve", "--motor", "lg-400w", "--idle", "0")
    assert (code, out) == (2, "")
    assert "allowed is 1 to" in err
