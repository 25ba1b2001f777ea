import json
from collections.abc import Iterator
from typing import Any

import pytest

from sim_instruments.server.control.faults import clear
from sim_instruments.server.served_bench import ServedBench
from tests.sim_instruments.server import wires

JSON = {"Content-Type": "application/json"}


@pytest.fixture(autouse=True)
def at_rest(bench: ServedBench) -> Iterator[None]:
    yield
    clear(bench.bench)
    world = bench.bench.world
    world.release_rotor()
    world.let_go()
    world.hold_shaft()
    world.let_go()


@pytest.fixture
def act(bench: ServedBench) -> Any:
    def perform(action: str, **details: Any) -> Any:
        status, answer = wires.ask(bench, "POST", "/actions", {"action": action, **details})
        assert status == 200, answer
        return answer["result"]

    return perform


def truth(bench: ServedBench) -> dict[str, Any]:
    status, answer = wires.ask(bench, "GET", "/truth")
    assert status == 200
    return dict(answer)


def test_hands(bench: ServedBench, act: Any) -> None:
    act("connect", wiring={"A": "supply+", "B": "supply-"})
    assert truth(bench)["wiring"] == {"A": "supply+", "B": "supply-", "C": "open"}
    act("lock_rotor")
    assert truth(bench)["rotor_locked"] is True
    act("release_rotor")
    act("turn_shaft", speed=5.0)
    assert truth(bench)["shaft_speed"] == pytest.approx(5.0)
    act("turn_shaft", speed=-5, wobble=0.1)
    assert truth(bench)["shaft_holder"] == "turning"
    act("hold_shaft")
    assert truth(bench)["shaft_speed"] == 0.0
    act("let_go")
    assert act("nudge_to_next_rest", direction=-1) > 0.0
    act("connect", wiring={"A": "lcr_high", "B": "lcr_low"})
    act("take_off", terminals=["A"])
    assert truth(bench)["wiring"] == {"A": "open", "B": "lcr_low", "C": "open"}
    act("short_leads", shorted=True)
    assert truth(bench)["leads_shorted"] is True
    act("short_leads", shorted=False)
    act("attach_voltage_probe", channel=1, positive="A", negative="star")
    act("attach_current_probe", channel=4, terminal="B")
    act("detach_probe", channel=1)
    act("attach_voltmeter", positive="A", negative="B")
    act("detach_voltmeter")
    act("set_ambient_temperature", temperature=30.0)
    act("set_winding_temperature", temperature=80.5)
    assert truth(bench)["winding_temperature"] == pytest.approx(80.5, abs=0.5)
    act("set_ambient_temperature", temperature=25)
    act("set_winding_temperature", temperature=25)
    act("hold_shaft")
    act("couple_dynamometer")
    assert truth(bench)["dynamometer_coupled"] is True
    act("uncouple_dynamometer")
    act("connect", wiring={})


def test_what_the_world_does_not_let_be_done_is_a_conflict(bench: ServedBench, act: Any) -> None:
    act("lock_rotor")
    status, answer = wires.ask(bench, "POST", "/actions", {"action": "turn_shaft", "speed": 1.0})
    assert (status, answer["error"][:21]) == (409, "the rotor is locked; ")
    for terminal in ("drive_1", "drive_2"):
        assert wires.ask(bench, "POST", "/actions", {"action": "connect", "wiring": {"A": terminal}})[0] == 409


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({}, "action"),
        ({"action": "explode"}, "lock_rotor"),
        ({"action": "connect"}, "connect.wiring"),
        ({"action": "connect", "wiring": {"D": "open"}}, "D"),
        ({"action": "connect", "wiring": {"A": "mains"}}, "supply+"),
        ({"action": "connect", "wiring": {"A": "open"}, "now": True}, "now"),
        ({"action": "lock_rotor", "hard": 1}, "hard"),
        ({"action": "turn_shaft", "speed": "5"}, "speed"),
        ({"action": "turn_shaft", "speed": 1e9}, "200"),
        ({"action": "turn_shaft", "speed": True}, "speed"),
        ({"action": "attach_current_probe", "channel": 0, "terminal": "A"}, "channel"),
        ({"action": "attach_current_probe", "channel": 1.5, "terminal": "A"}, "channel"),
        ({"action": "nudge_to_next_rest", "direction": 2}, "direction"),
        ({"action": "short_leads", "shorted": 1}, "shorted"),
    ],
)
def test_actions_that_are_refused_say_why(bench: ServedBench, given: Any, named: str) -> None:
    status, answer = wires.ask(bench, "POST", "/actions", given)
    assert status == 400
    assert named in answer["error"]


def test_faults_of_motor_and_wiring(bench: ServedBench) -> None:
    for fault in (
        {"fault": "open_phase", "terminal": "B"},
        {"fault": "swapped", "pair": ["A", "C"]},
        {"fault": "stuck_rotor"},
    ):
        status, answer = wires.ask(bench, "POST", "/faults", fault)
        assert status == 200
    given = {"open_phase": "B", "swapped": ["A", "C"], "stuck_rotor": True}
    assert {name: answer["world"][name] for name in given} == given
    wires.ask(bench, "POST", "/faults", {"fault": "open_phase", "terminal": None})
    wires.ask(bench, "POST", "/faults", {"fault": "stuck_rotor", "stuck": False})
    left = {name: fault for name, fault in truth(bench)["faults"].items() if fault}
    assert left == {"swapped": ["A", "C"]}
    assert wires.ask(bench, "DELETE", "/faults")[1]["world"]["swapped"] is None


def test_faults_of_instruments_by_role(bench: ServedBench) -> None:
    for fault in (
        {"fault": "silence", "role": "supply", "count": 1},
        {"fault": "replace", "role": "supply", "pattern": r"^\*tst", "reply": "\u00ff9\n", "times": None},
        {"fault": "wrong_identity", "role": "supply"},
        {"fault": "late", "role": "inverter", "pattern": "6041H", "delay": 0.5},
    ):
        status, answer = wires.ask(bench, "POST", "/faults", fault)
        assert status == 200, answer
    assert answer["instruments"] == {
        "supply": [
            {"fault": "silence", "times": 1},
            {"fault": "replace", "times": None},
            {"fault": "replace", "times": None},
        ],
        "inverter": [{"fault": "late", "times": 1}],
    }
    with wires.stream(bench.addresses()["supply"]["socket"]) as connection:
        connection.sendall(b"*OPC?\n*TST?\n*IDN?\n*OPC?\n")
        assert wires.exactly(connection, 24) == b"\xff9\nACME,MODEL 1,0,0.0\n1\n"
    assert wires.ask(bench, "DELETE", "/faults")[1]["instruments"] == {}


@pytest.mark.parametrize(
    ("given", "status", "named"),
    [
        ({"fault": "meteor"}, 400, "stuck_rotor"),
        ({"fault": "silence", "role": "supply"}, 400, "pattern or count"),
        ({"fault": "silence", "role": "supply", "count": 1, "pattern": "x"}, 400, "pattern or count"),
        ({"fault": "silence", "role": "supply", "count": 1, "times": 2}, 400, "times belongs to pattern"),
        ({"fault": "silence", "role": "supply", "pattern": "("}, 400, "no regular expression"),
        ({"fault": "replace", "role": "supply", "count": 1, "reply": "Ω"}, 400, "one character for each"),
        ({"fault": "late", "role": "supply", "count": 1, "delay": -1.0}, 400, "delay"),
        ({"fault": "silence", "role": "kettle", "count": 1}, 409, "'kettle' is unknown"),
        ({"fault": "open_phase"}, 400, "terminal"),
        ({"fault": "swapped", "pair": ["A"]}, 400, "pair"),
        ({"fault": "swapped", "pair": ["A", "A"]}, 409, "two different"),
    ],
)
def test_faults_that_are_refused_say_why(bench: ServedBench, given: Any, status: int, named: str) -> None:
    answered, answer = wires.ask(bench, "POST", "/faults", given)
    assert answered == status
    assert named in answer["error"]


def test_what_can_be_asked(bench: ServedBench) -> None:
    assert wires.ask(bench, "GET", "/addresses") == (200, json.loads(json.dumps(bench.addresses())))
    assert wires.ask(bench, "GET", "/motor") == (200, {"truth": {"pole_pairs": 4.0}})
    status, clock = wires.ask(bench, "GET", "/clock")
    assert (status, clock["speedup"]) == (200, 50.0)
    assert 0.0 < clock["time"] <= bench.clock.now()


@pytest.mark.parametrize(
    ("method", "path", "body", "headers", "status"),
    [
        ("GET", "/", None, {}, 404),
        ("GET", "/actions", None, {}, 405),
        ("DELETE", "/truth", None, {}, 405),
        ("GET", "/truth", None, {"Host": "motor.example:80"}, 403),
        ("POST", "/actions", "{}", {}, 415),
        ("POST", "/actions", "{}", {"Content-Type": "text/plain"}, 415),
        ("POST", "/actions", "", JSON, 400),
        ("POST", "/actions", "[]", JSON, 400),
        ("POST", "/actions", "{", JSON, 400),
        ("POST", "/actions", b"\xff", JSON, 400),
        ("POST", "/actions", "[" * 10_000, JSON, 400),
        ("POST", "/actions", '{"action": "turn_shaft", "speed": NaN}', JSON, 400),
        ("POST", "/actions", '{"action": "let_go", "action": "lock_rotor"}', JSON, 400),
        ("POST", "/actions", "x", {**JSON, "Content-Length": "-1"}, 400),
        ("POST", "/actions", "x" * 70_000, JSON, 413),
        ("POST", "/actions", None, {**JSON, "Content-Length": "9" * 10}, 413),
        ("POST", "/actions", None, {**JSON, "Content-Length": "9" * 30}, 400),
        ("POST", "/actions", None, {**JSON, "Transfer-Encoding": "chunked"}, 411),
        ("GET", "/" + "x" * 70_000, None, {}, 431),
    ],
)
def test_requests_that_are_refused(
    bench: ServedBench, method: str, path: str, body: Any, headers: dict[str, str], status: int
) -> None:
    answered, answer = wires.ask_raw(bench, method, path, body, headers)
    assert answered == status
    assert answer["error"]


@pytest.mark.parametrize(
    "garbage", [b"\0" * 50 + b"\r\n\r\n", b"GET /truth\r\n\r\n", b"GET /truth HTTP/1.1\r\n bad\r\n\r\n"]
)
def test_what_is_no_http_is_told_and_hung_up_on(bench: ServedBench, garbage: bytes) -> None:
    with wires.stream(bench.control) as connection:
        connection.sendall(garbage)
        answer = b""
        while data := connection.recv(1000):
            answer += data
    assert answer.startswith(b"HTTP/1.1 400 Bad Request\r\n")


def test_one_connection_serves_many_requests(bench: ServedBench) -> None:
    request = b"GET /clock HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with wires.stream(bench.control) as connection, wires.stream(bench.control) as idle:
        idle.sendall(b"POST /act")
        connection.sendall(request * 3 + request.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n"))
        answer = b""
        while data := connection.recv(1000):
            answer += data
    assert answer.count(b"HTTP/1.1 200 OK") == 4
