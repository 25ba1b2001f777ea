"""Emergency stop and door of a served bench, asked by bytes and frames of our own."""

import http.client
import json
import socket
import struct
from typing import Any

import can
import pytest

from sim_instruments.server.served_bench import ServedBench


def ask(bench: ServedBench, pdu: str, unit: int = 1) -> str:
    host, _, port = bench.interlocks()["emergency_stop"]["address"].removeprefix("tcp://").partition(":")
    request = bytes.fromhex(pdu)
    with socket.create_connection((host, int(port)), timeout=10.0) as connection:
        connection.sendall(struct.pack("!HHHB", 7, 0, len(request) + 1, unit) + request)
        return connection.recv(260)[7:].hex(" ")


def post(bench: ServedBench, given: dict[str, Any]) -> tuple[int, Any]:
    connection = http.client.HTTPConnection("127.0.0.1", int(bench.control.rpartition(":")[2]), timeout=10.0)
    connection.request("POST", "/interlocks", json.dumps(given), {"Content-Type": "application/json"})
    reply = connection.getresponse()
    told = json.loads(reply.read())
    connection.close()
    return reply.status, told


def test_bits_follow_the_contacts(bench: ServedBench) -> None:
    assert ask(bench, "02 00 00 00 02") == "02 01 03"
    assert post(bench, {"name": "emergency_stop", "closed": False}) == (200, {"emergency_stop": False, "door": True})
    assert ask(bench, "02 00 00 00 01") == "02 01 00"
    assert ask(bench, "01 00 01 00 01") == "01 01 01"
    assert post(bench, {"name": "emergency_stop", "closed": True})[1]["emergency_stop"] is True


@pytest.mark.parametrize(
    ("request_", "unit", "answer"),
    [
        ("02 00 01 00 02", 1, "82 02"),
        ("02 00 00 00 00", 1, "82 03"),
        ("02 00 00", 1, "82 03"),
        ("03 00 00 00 01", 1, "83 01"),
        ("06 00 00 00 01", 1, "86 01"),
        ("05 00 00 ff 00", 1, "85 01"),
        ("02 00 00 00 01", 9, "82 0b"),
    ],
)
def test_what_the_module_refuses(bench: ServedBench, request_: str, unit: int, answer: str) -> None:
    assert ask(bench, request_, unit) == answer


def test_the_frame_comes_again_and_again(bench: ServedBench) -> None:
    door = bench.interlocks()["door"]
    assert (door["frame"], door["byte"], door["bit"]) == (0x1A0, 0, 1)
    interface, _, channel = door["address"].removeprefix("can://").partition("/")

    def frame(bus: can.BusABC, wanted: int) -> bool:
        for _ in range(500):
            message = bus.recv(10.0)
            if message is not None and message.arbitration_id == 0x1A0 and bytes(message.data) == bytes([wanted]):
                return True
        return False

    with can.Bus(channel, interface=interface, sleep_after_open=0.0) as bus:
        assert frame(bus, 3)
        assert frame(bus, 3)
        post(bench, {"name": "door", "closed": False})
        assert frame(bus, 1)
        post(bench, {"name": "door", "closed": True})


@pytest.mark.parametrize("given", [{"name": "window", "closed": True}, {"name": "door"}, {"name": "door", "closed": 1}])
def test_what_cannot_be_asked(bench: ServedBench, given: dict[str, Any]) -> None:
    status, told = post(bench, given)
    assert status == 400
    assert "error" in told
