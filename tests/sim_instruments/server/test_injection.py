"""Described faults through the control endpoint, and cables that are pulled out of real sockets."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from sim_instruments.server.control.faults import clear
from sim_instruments.server.served_bench import ServedBench
from tests.sim_instruments.server import wires


@pytest.fixture(autouse=True)
def at_rest(bench: ServedBench) -> Iterator[None]:
    yield
    clear(bench.bench)


def injected(bench: ServedBench, **described: Any) -> dict[str, Any]:
    status, answer = wires.ask(bench, "POST", "/faults", described)
    assert status == 200, answer
    return dict(answer)


def until(true: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 10.0
    while not true():
        assert time.monotonic() < deadline


def test_a_fault_at_a_step_that_another_process_reports(bench: ServedBench) -> None:
    answer = injected(bench, fault="stuck_rotor", step="3.2.2/3", procedure="stator-resistance")
    assert answer["injected"] == [
        {"fault": "stuck_rotor", "step": "3.2.2/3", "procedure": "stator-resistance", "state": "waiting", "felt": False}
    ]
    begun = {"step": "3.2.2/3", "procedure": "stator-resistance"}
    status, told = wires.ask(bench, "POST", "/steps", begun)
    assert (status, list(told)) == (200, ["time"])
    assert wires.ask(bench, "GET", "/truth")[1]["faults"]["stuck_rotor"] is True
    assert wires.ask(bench, "GET", "/faults")[1]["injected"][0]["state"] == "present"
    assert wires.ask(bench, "DELETE", "/faults")[1]["injected"] == []


@pytest.mark.parametrize(
    ("given", "named"), [({}, "step"), ({"step": ""}, "step"), ({"step": "1", "procedure": 2}, "procedure")]
)
def test_steps_that_are_refused(bench: ServedBench, given: Any, named: str) -> None:
    status, answer = wires.ask(bench, "POST", "/steps", given)
    assert status == 400
    assert named in answer["error"]


def test_a_fault_that_mends_by_itself(bench: ServedBench) -> None:
    answer = injected(bench, fault="thermal_runaway", after=5.0, duration=10.0)
    assert answer["injected"][0]["state"] == "waiting"
    until(lambda: wires.ask(bench, "GET", "/faults")[1]["injected"][0]["state"] == "over")
    assert wires.ask(bench, "GET", "/truth")[1]["faults"]["heating"] is None


@pytest.mark.parametrize(("role", "way"), [("supply", "socket"), ("supply", "hislip"), ("dynamometer", "tcp")])
def test_a_cable_that_is_pulled_out(bench: ServedBench, role: str, way: str) -> None:
    address = bench.addresses()[role][way]
    with wires.stream(address) as connection, wires.stream(bench.addresses()["voltmeter"]["socket"]) as other:
        assert injected(bench, fault="disconnect", role=role)["disconnected"] == [role]
        assert hung_up(connection)
        with wires.stream(address) as refused:
            assert hung_up(refused)
        # Nobody else is cut off.
        other.sendall(b"*OPC?\n")
        assert wires.exactly(other, 2) == b"1\n"
    assert wires.ask(bench, "DELETE", "/faults")[1]["disconnected"] == []
    if role == "supply":
        with wires.visa(address) as session:
            assert session.query("*OPC?") == "1"


def hung_up(connection: Any) -> bool:
    try:
        return connection.recv(1) == b""
    except ConnectionError:
        return True


def test_one_behind_on_a_socket(bench: ServedBench) -> None:
    injected(bench, fault="stale", role="voltmeter", count=1)
    with wires.stream(bench.addresses()["voltmeter"]["socket"]) as connection:
        connection.sendall(b"*OPC?\n")
        connection.sendall(b"*ESE?\n")
        assert wires.exactly(connection, 2) == b"1\n"
        connection.sendall(b"*OPC?\n")
        assert wires.exactly(connection, 3) == b"+0\n"
