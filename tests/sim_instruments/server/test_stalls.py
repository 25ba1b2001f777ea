"""One client never stalls another: what takes long is done in pieces, and whoever keeps the bench waiting is hung up on."""

import asyncio
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest

from sim_instruments.scpi.long_reply import LongReply
from sim_instruments.scpi.session import ClientSession
from sim_instruments.scpi.tree import bare
from sim_instruments.server.control.http import JsonService
from sim_instruments.server.served_bench import ServedBench
from sim_instruments.transports.client import Client, Patience
from sim_instruments.transports.tcp_service import TcpService
from tests.sim_instruments.motors import BENCH_MOTOR
from tests.sim_instruments.server import wires

HASTY = Patience(idle=0.15, half=0.05, stalled=0.05)


@pytest.fixture(scope="module")
def hasty() -> Iterator[ServedBench]:
    with ServedBench(BENCH_MOTOR, speedup=50.0, seed=1, patience=HASTY) as served:
        yield served


def test_others_are_answered_while_a_record_is_sampled_and_sent(bench: ServedBench) -> None:
    scope = bench.bench.instrument("oscilloscope")
    reader, other = (ClientSession(scope, np.random.default_rng(seed)) for seed in (1, 2))

    def reply(session: ClientSession) -> Any:
        while (outgoing := session.take()) is None:
            assert session.next_wake() is not None
        return outgoing

    reader.write(b"*CLS;*RST;:TIM:RANG 0.0008;:WAV:POIN:MODE RAW;:WAV:POIN 500000;:WAV:FORM ASC;:SING;*OPC?\n")
    assert b"".join(reply(reader).parts) == b"1\n"
    reader.write(b":WAV:POIN?;:WAV:DATA?;:SYST:ERR?\n")
    turns = 0
    while (outgoing := reader.take()) is None:
        other.write(b"*OPT?\n")
        assert b"".join(reply(other).parts) == b"0\n"
        turns += 1
    # The settings are those of the moment of the query.
    other.write(b":WAV:FORM BYTE;*OPT?\n")
    assert b"".join(reply(other).parts) == b"0\n"
    parts = list(outgoing.parts)
    data = b"".join(parts)
    assert turns > 10
    assert max(map(len, parts)) < 1 << 18
    points = 500_000
    start = data.index(b"#8")
    assert data[:start] == b"+500000;"
    assert data[start : start + 10] == b"#8%08d" % (13 * points - 1)
    assert data[start + 10 :].count(b",") == points - 1 + 1
    assert data.endswith(b';+0,"No error"\n')


def test_a_long_message_is_handled_in_turns(bench: ServedBench) -> None:
    session = ClientSession(bench.bench.instrument("supply"), np.random.default_rng(1))
    session.write(b"*CLS;" + b"*OPT?;" * 1000 + b"NONSENSE;*OPT?\n")
    turns = 0
    while (outgoing := session.take()) is None:
        turns += 1
    assert turns > 30
    assert b"".join(outgoing.parts) == b";".join([b"0"] * 1000) + b"\n"
    session.write(b"SYST:ERR?\n")
    errors = session.take()
    assert errors is not None
    assert b"".join(errors.parts).startswith(b"-113")


def test_a_long_reply_that_nobody_took_is_interrupted(bench: ServedBench) -> None:
    supply = bench.bench.instrument("supply")
    supply.tree.add("TEST:LONG", query=bare(lambda: LongReply([b"never"])))
    session = ClientSession(supply, np.random.default_rng(1))
    session.write(b"*CLS;*ESE 0\n")
    session.write(b"TEST:LONG?\n")
    session.write(b"SYST:ERR?\n")
    outgoing = session.take()
    assert outgoing is not None
    assert b"".join(outgoing.parts).startswith(b"-410")


def test_a_long_reply_that_cannot_be_made_ends_its_connection_alone(bench: ServedBench) -> None:
    def parts() -> Iterator[bytes]:
        yield b"1,"
        raise ZeroDivisionError("of no use")

    bench.bench.instrument("supply").tree.add("TEST:BROKen", query=bare(lambda: LongReply(parts())))
    address = bench.addresses()["supply"]["socket"]
    with wires.stream(address) as good, wires.stream(address) as bad:
        bad.sendall(b"*CLS;TEST:BROK?\n")
        assert (wires.exactly(bad, 2), bad.recv(1)) == (b"1,", b"")
        good.sendall(b"SYST:ERR?\n")
        assert good.recv(100) == b'-310,"System error;ZeroDivisionError: of no use"\n'


def test_contacts_and_control_do_without_the_instruments(bench: ServedBench) -> None:
    held, release = threading.Event(), threading.Event()

    def hold() -> str:
        held.set()
        release.wait(10.0)
        return "1"

    bench.bench.instrument("supply").tree.add("TEST:HOLD", query=bare(hold))
    contacts = bench.interlocks()["emergency_stop"]["address"]
    with wires.stream(bench.addresses()["supply"]["socket"]) as stalled, wires.stream(contacts) as poll:
        stalled.sendall(b"TEST:HOLD?\n")
        assert held.wait(10.0)
        try:
            with bench.bench.world.lock:
                for closed, bits in ((False, b"\2"), (True, b"\3")):
                    status, states = wires.ask(
                        bench, "POST", "/interlocks", {"name": "emergency_stop", "closed": closed}
                    )
                    assert (status, states["emergency_stop"]) == (200, closed)
                    poll.sendall(bytes.fromhex("0001 0000 0006 01 02 0000 0002"))
                    assert wires.exactly(poll, 10)[-1:] == bits
                assert wires.ask(bench, "GET", "/clock")[0] == 200
        finally:
            release.set()
        assert wires.exactly(stalled, 2) == b"1\n"


@pytest.mark.parametrize(
    ("role", "way", "said"),
    [
        ("supply", "socket", b"*IDN"),
        ("supply", "socket", b""),
        ("supply", "hislip", wires.header(0, 0, 0x0100_0000, b"", 20)),
        ("dynamometer", "tcp", b"\0\1\0"),
        ("dynamometer", "tcp", b""),
        ("inverter", "can", b"t1"),
    ],
)
def test_half_a_message_and_silence_end(hasty: ServedBench, role: str, way: str, said: bytes) -> None:
    address = hasty.addresses()[role][way]
    with wires.stream(address["channel"] if isinstance(address, dict) else address) as connection:
        connection.sendall(said)
        assert connection.recv(1) == b""


def test_half_a_request_of_the_control_endpoint_ends() -> None:
    service = JsonService({"/": {"GET": lambda _: {}}})
    assert asyncio.run(_said(service.serve, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\nGET ")).startswith(
        b"HTTP/1.1 200"
    )


async def _said(serve: Callable[[Client], Any], data: bytes) -> bytes:
    """Return all that a service says to what a client sends who then is silent."""
    service = TcpService(serve, "127.0.0.1", patience=HASTY)
    await service.start()
    reader, writer = await asyncio.open_connection("127.0.0.1", service.port)
    writer.write(data)
    try:
        return await reader.read()
    except ConnectionResetError:
        return b""
    finally:
        writer.close()
        await service.stop()


def test_a_client_that_reads_nothing_is_hung_up_on() -> None:
    async def deaf() -> int:
        sent, over = 0, asyncio.Event()

        async def endless(client: Client) -> None:
            nonlocal sent
            try:
                while True:
                    await client.send(bytes(1 << 16))
                    sent += 1
            finally:
                over.set()

        service = TcpService(endless, "127.0.0.1", patience=HASTY)
        await service.start()
        with socket.create_connection(("127.0.0.1", service.port)):
            await over.wait()
        await service.stop()
        return sent

    # No more than the system's own buffers take.
    assert 0 < asyncio.run(deaf()) < 1000


def test_a_session_that_is_asked_for_its_status_is_not_idle(hasty: ServedBench) -> None:
    with ExitStack() as opened:
        address = hasty.addresses()["supply"]["hislip"]
        first, second = (opened.enter_context(wires.stream(address)) for _ in range(2))
        first.sendall(wires.header(0, 0, 0x0100_0000, b"hislip0"))
        number = wires.message(first)[2] & 0xFFFF
        second.sendall(wires.header(17, 0, number))
        wires.message(second)
        for _ in range(20):
            second.sendall(wires.header(21))
            assert wires.message(second)[0] == 22
            threading.Event().wait(0.01)
        first.sendall(wires.header(7, 0, wires.FIRST_MESSAGE, b"*OPT?\n"))
        assert wires.message(first)[3] == b"0\n"


def test_who_listens_on_the_bus_may_be_silent(hasty: ServedBench) -> None:
    address = hasty.addresses()["inverter"]["can"]
    assert isinstance(address, dict)
    with wires.stream(address["channel"]) as listener:
        listener.sendall(b"L\r")
        assert len(wires.exactly(listener, 10 * len(b"t1A0103\r"))) == 80
