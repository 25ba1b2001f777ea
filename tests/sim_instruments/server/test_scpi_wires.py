import socket
import threading
from contextlib import ExitStack
from typing import Any

import pytest

from sim_instruments.faults.line_faults import Fault
from sim_instruments.server.served_bench import ServedBench
from tests.sim_instruments.motors import BENCH_MOTOR
from tests.sim_instruments.server import wires

#: An answer comes within this time (s), however busy the machine.
PATIENCE = 60.0
#: Messages of a client that floods: they are worked off in a second of a processor.
FLOOD = 20_000


@pytest.fixture(params=["socket", "hislip", "vxi11"])
def way(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def supply(bench: ServedBench) -> dict[str, Any]:
    return bench.addresses()["supply"]


@pytest.mark.parametrize("role", ["supply", "lcr_meter", "oscilloscope", "voltmeter"])
def test_every_instrument_answers_pyvisa(bench: ServedBench, role: str, way: str) -> None:
    face: Any = bench.bench.instrument(role)
    with wires.visa(bench.addresses()[role][way]) as session:
        assert session.query("*IDN?") == face.identity
        assert session.query("*CLS;*ESE 32;:SYST:ERR?;*OPC?") == '+0,"No error";1'
        assert session.query("system:error:next?") == '+0,"No error"'
        session.write("NONSENSE 5")
        assert session.query("*ESR?") == "+32"
        assert session.query("SYST:ERR?") == '-113,"Undefined header"'


def test_settings_and_errors_are_one_for_all_clients(supply: dict[str, Any]) -> None:
    with wires.visa(supply["socket"]) as one, wires.visa(supply["hislip"]) as other:
        one.write("*RST;*CLS;:VOLT 3.25,(@1)")
        assert float(other.query("VOLT? (@1)")) == 3.25
        other.write("VOLT 1e9,(@1)")
        # A query of the same client is answered after what it has sent before.
        assert other.query("*OPC?") == "1"
        assert one.query("SYST:ERR?").startswith("-222")


def test_measuring_takes_bench_time(bench: ServedBench, way: str) -> None:
    with wires.visa(bench.addresses()["voltmeter"][way]) as session:
        session.write("*RST;:CONF:VOLT:DC 10;:VOLT:DC:NPLC 100;:SAMP:COUN 2")
        before = bench.clock.now()
        assert len(session.query("READ?").split(",")) == 2
        # Two readings of 100 cycles of 20 ms, with autozero.
        assert bench.clock.now() - before >= 4.0


def test_replies_go_to_who_has_asked(supply: dict[str, Any]) -> None:
    wrong: list[str] = []

    def ask(session: Any, query: str, answer: str) -> None:
        wrong.extend(reply for _ in range(100) if (reply := session.query(query)) != answer)

    queries = (("*OPC?", "1"), ("*TST?", "+0"), ("SYST:VERS?", "1999.0"), ("*OPT?", "0"))
    with ExitStack() as stack:
        sessions = [(stack.enter_context(wires.visa(supply[way])), *asked) for asked in queries for way in supply]
        clients = [threading.Thread(target=ask, args=session) for session in sessions]
        for client in clients:
            client.start()
        for client in clients:
            client.join(20.0)
    assert wrong == []


def test_a_block_arrives_whole(bench: ServedBench, way: str) -> None:
    with wires.visa(bench.addresses()["oscilloscope"][way]) as scope:
        scope.write("*RST;:TIM:SCAL 1E-3;:DIG;:WAV:FORM BYTE;:WAV:POIN:MODE MAX;:WAV:POIN 100000")
        scope.read_termination = None
        scope.write(":WAV:DATA?")
        start = scope.read_bytes(2, break_on_termchar=False)
        digits = scope.read_bytes(int(start[1:]), break_on_termchar=False)
        data = scope.read_bytes(int(digits) + 1, break_on_termchar=False)
        assert int(digits) >= 10_000
        assert data[-1:] == b"\n"
        scope.read_termination = "\n"
        assert scope.query("*OPC?") == "1"


# HiSLIP's own


def test_the_status_byte_shows_a_reply(supply: dict[str, Any]) -> None:
    with wires.visa(supply["hislip"]) as session:
        session.write("*CLS;*SRE 0;*ESE 32")
        assert session.query("*OPC?") == "1"
        assert session.read_stb() == 0
        session.write("*IDN?")
        while not session.read_stb() & 0x10:
            continue
        session.read()
        assert session.read_stb() == 0
        session.write("NONSENSE")
        assert session.query("*OPC?") == "1"
        assert session.read_stb() == 0x24
        session.write("*CLS")


def test_device_clear_ends_a_wait_without_end(bench: ServedBench) -> None:
    address = bench.addresses()["oscilloscope"]["hislip"]
    with wires.visa(address, timeout=0.2) as waiting, wires.visa(address) as other:
        waiting.write("*RST;:TRIG:SWE NORM;:TRIG:LEV 4,CHAN1;:DIG CHAN1;*OPC?")
        with pytest.raises(Exception, match="VI_ERROR_TMO"):
            waiting.read()
        # Whoever else talks to the instrument is not held up by the wait.
        assert other.query("*OPT?") == "0"
        waiting.clear()
        waiting.timeout = 5000
        assert waiting.query("*OPT?") == "0"
        assert waiting.query(":RST?") == "STOP" or waiting.query(":RSTate?") == "STOP"


def test_a_bench_that_cannot_keep_up_is_slower_and_answers_all_the_same() -> None:
    # No machine looks through a signal a thousand times as fast as it comes.
    with ServedBench(BENCH_MOTOR, speedup=1000.0, seed=1) as bench:
        address = bench.addresses()["oscilloscope"]["hislip"]
        # It is answered once the bench has caught up, which takes some tenths of a second of a processor.
        with wires.visa(address, timeout=0.2) as waiting, wires.visa(address, timeout=PATIENCE) as other:
            waiting.write("*RST;:TIM:SCAL 1E-4;:TRIG:SWE NORM;:TRIG:LEV 4,CHAN1;:DIG CHAN1;*OPC?")
            with pytest.raises(Exception, match="VI_ERROR_TMO"):
                waiting.read()
            assert other.query("*OPT?") == "0"


@pytest.mark.parametrize("way", ["hislip", "vxi11"])
def test_a_reply_that_nobody_has_read_is_told_and_not_taken_for_the_next(supply: dict[str, Any], way: str) -> None:
    with wires.visa(supply[way]) as session:
        session.write("*CLS")
        session.write("*IDN?")
        assert session.query("*OPC?") == "1"
        assert session.query("SYST:ERR?") == '-410,"Query INTERRUPTED"'


def test_trigger_message(bench: ServedBench) -> None:
    address = bench.addresses()["voltmeter"]["hislip"]
    with wires.stream(address) as synchronous, wires.stream(address) as asynchronous:
        open_session(synchronous, asynchronous)
        first = wires.FIRST_MESSAGE
        synchronous.sendall(wires.header(7, 0, first, b"*RST;:CONF:VOLT:DC 10;:VOLT:DC:NPLC 1;:TRIG:SOUR BUS;:INIT\n"))
        synchronous.sendall(wires.header(12, 0, first + 2))
        synchronous.sendall(wires.header(7, 0, first + 4, b"FETC?\n"))
        kind, _, parameter, payload = wires.message(synchronous)
        assert (kind, parameter) == (7, first + 4)
        assert abs(float(payload)) < 0.01


def test_service_is_asked_for_once_a_reason(bench: ServedBench) -> None:
    address = bench.addresses()["voltmeter"]["hislip"]
    with wires.stream(address) as synchronous, wires.stream(address) as asynchronous:
        open_session(synchronous, asynchronous)
        first = wires.FIRST_MESSAGE
        synchronous.sendall(wires.header(7, 0, first, b"*RST;*CLS;*SRE 32;*ESE 33\n"))
        # A command error; that another one follows is no new reason.
        synchronous.sendall(wires.header(7, 0, first + 2, b"NONSENSE\n"))
        synchronous.sendall(wires.header(7, 0, first + 4, b"NONSENSE\n"))
        assert wires.message(asynchronous) == (20, 0x64, 0, b"")
        # The end of a measurement, for which nobody waits.
        synchronous.sendall(wires.header(7, 0, first + 6, b"*CLS\n"))
        synchronous.sendall(wires.header(7, 0, first + 8, b"CONF:VOLT:DC 10;:INIT;*OPC\n"))
        assert wires.message(asynchronous) == (20, 0x60, 0, b"")
        synchronous.sendall(wires.header(7, 0, first + 10, b"*CLS;*SRE 16\n"))
        synchronous.sendall(wires.header(7, 0, first + 12, b"*IDN?\n"))
        assert wires.message(synchronous)[0] == 7
        assert wires.message(asynchronous) == (20, 0x50, 0, b"")
        synchronous.sendall(wires.header(7, 1, first + 14, b"*SRE 0;*CLS\n"))
        # Nothing else has come in between.
        asynchronous.sendall(wires.header(21, 1, first + 14))
        assert wires.message(asynchronous)[0] == 22


def open_session(synchronous: socket.socket, asynchronous: socket.socket) -> int:
    synchronous.sendall(wires.header(0, 0, 0x01007878, b"hislip0"))
    kind, control, parameter, _ = wires.message(synchronous)
    assert (kind, control, parameter >> 16) == (1, 0, 0x0100)
    asynchronous.sendall(wires.header(17, 0, parameter & 0xFFFF))
    assert wires.message(asynchronous)[0] == 18
    return int(parameter & 0xFFFF)


def test_long_replies_are_cut_to_what_the_client_takes(supply: dict[str, Any]) -> None:
    with wires.stream(supply["hislip"]) as synchronous, wires.stream(supply["hislip"]) as asynchronous:
        open_session(synchronous, asynchronous)
        asynchronous.sendall(wires.header(15, 0, 0, (256).to_bytes(8, "big")))
        assert wires.message(asynchronous) == (16, 0, 0, (1 << 20).to_bytes(8, "big"))
        synchronous.sendall(wires.header(7, 0, wires.FIRST_MESSAGE, b";".join([b"*IDN?"] * 12) + b"\n"))
        parts = [wires.message(synchronous)]
        while parts[-1][0] == 6:
            parts.append(wires.message(synchronous))
        assert parts[-1][0] == 7
        assert all(len(payload) <= 240 for *_, payload in parts)
        assert b"".join(payload for *_, payload in parts).count(b"E36313A") == 12


def test_locks(supply: dict[str, Any]) -> None:
    with wires.stream(supply["hislip"]) as s1, wires.stream(supply["hislip"]) as a1:
        open_session(s1, a1)
        a1.sendall(wires.header(4, 1, 1000))
        assert wires.message(a1)[:2] == (5, 1)
        with wires.visa(supply["hislip"], timeout=0.2) as other:
            with pytest.raises(Exception, match="VI_ERROR_TMO"):
                other.query("*OPC?")
            with wires.stream(supply["hislip"]) as s2, wires.stream(supply["hislip"]) as a2:
                open_session(s2, a2)
                a2.sendall(wires.header(4, 1, 50))
                assert wires.message(a2)[:2] == (5, 0)
                a2.sendall(wires.header(24))
                assert wires.message(a2)[:3] == (25, 1, 1)
                a1.sendall(wires.header(4, 0, 0))
                assert wires.message(a1)[:2] == (5, 1)
                # Two may share one by the same key; another key is refused.
                for asynchronous, key, answer in ((a1, b"k", 1), (a2, b"k", 1), (a2, b"k", 3), (a2, b"", 0)):
                    asynchronous.sendall(wires.header(4, 1, 20, key))
                    assert wires.message(asynchronous)[:2] == (5, answer)
            # Who leaves gives its locks back.
            a1.sendall(wires.header(4, 0, 0))
            assert wires.message(a1)[:2] == (5, 2)
            with wires.visa(supply["hislip"]) as next_one:
                assert next_one.query("*OPC?") == "1"


@pytest.mark.parametrize(
    ("greeting", "code"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", 1),
        (b"HS" + b"\xff" * 6 + b"\0" * 8, 3),
        (b"HS\x11\0\xff\xff\xff\xff" + b"\0" * 8, 3),
        (b"HS\0\0\x01\0xx" + b"\0" * 7 + b"\x05inst0", 3),
    ],
)
def test_what_is_no_hislip_is_told_and_hung_up_on(supply: dict[str, Any], greeting: bytes, code: int) -> None:
    with wires.stream(supply["hislip"]) as connection:
        connection.sendall(greeting)
        kind, control, _, words = wires.message(connection)
        assert (kind, control) == (2, code)
        assert words
        assert connection.recv(1) == b""


def test_one_client_too_many_is_told(supply: dict[str, Any]) -> None:
    with ExitStack() as stack:
        crowd = [stack.enter_context(wires.stream(supply["hislip"])) for _ in range(31)]
        for connection in crowd:
            connection.sendall(wires.header(0, 0, 0x01007878, b"hislip0"))
        kinds = [wires.message(connection)[:2] for connection in crowd]
    assert kinds == [(1, 0)] * 30 + [(2, 4)]


def test_a_channel_alone_is_no_session(supply: dict[str, Any]) -> None:
    with wires.stream(supply["hislip"]) as connection:
        connection.sendall(wires.header(0, 0, 0x01007878) + wires.header(7, 0, wires.FIRST_MESSAGE, b"*IDN?\n"))
        assert wires.message(connection)[0] == 1
        assert wires.message(connection)[:2] == (2, 2)
        assert connection.recv(1) == b""


def test_unknown_messages_and_large_ones_are_survived(supply: dict[str, Any]) -> None:
    with wires.stream(supply["hislip"]) as synchronous, wires.stream(supply["hislip"]) as asynchronous:
        open_session(synchronous, asynchronous)
        for channel in (synchronous, asynchronous):
            channel.sendall(wires.header(99, 0, 0, b"what?"))
            assert wires.message(channel)[:2] == (3, 1)
        large = (1 << 20) + 1
        synchronous.sendall(wires.header(7, 0, wires.FIRST_MESSAGE, length=large) + b"x" * large)
        assert wires.message(synchronous)[:2] == (3, 4)
        synchronous.sendall(wires.header(7, 0, wires.FIRST_MESSAGE + 2, b"x" * 100_000))
        synchronous.sendall(wires.header(7, 0, wires.FIRST_MESSAGE + 4, b"SYST:ERR?;ERR?;*CLS\n"))
        assert wires.message(synchronous)[3] == b'-363,"Input buffer overrun";-363,"Input buffer overrun"\n'


# Clients that do harm


def test_a_hundred_megabytes_without_an_end_harm_nobody(supply: dict[str, Any]) -> None:
    with wires.visa(supply["socket"]) as good, wires.stream(supply["socket"]) as bad:
        good.write("*CLS")
        chunk = b"\xffgarbage" * (1 << 17)
        sender = threading.Thread(target=lambda: [bad.sendall(chunk) for _ in range(100)])
        sender.start()
        answered = 0
        while sender.is_alive():
            assert good.query("*TST?") == "+0"
            answered += 1
        sender.join()
        # In between, and not once all of it was taken.
        assert answered > 10
        bad.sendall(b"\nSYST:ERR?\n")
        assert bad.recv(100).startswith(b"-363")


def test_clients_that_flood_hang_or_babble_harm_nobody(bench: ServedBench) -> None:
    addresses = bench.addresses()["oscilloscope"]
    with (
        wires.visa(addresses["hislip"]) as good,
        wires.stream(addresses["socket"]) as deaf,
        wires.stream(addresses["socket"]) as flood,
        wires.stream(addresses["socket"]) as silent,
        wires.stream(addresses["hislip"]) as half,
    ):
        half.sendall(b"HS\0")
        silent.sendall(b"*IDN")
        deaf.sendall(b":WAV:POIN:MODE MAX;:WAV:POIN 100000;*RST;:SING\n")
        deaf.settimeout(0.2)
        flood.settimeout(0.2)
        before = bench.queued_errors.qsize()
        for connection, what in ((deaf, b":WAV:DATA?\n" * 200), (flood, b"\0\xff?;'\n" * FLOOD)):
            try:
                connection.sendall(what)
            except TimeoutError:
                continue
        for _ in range(20):
            assert good.query("*OPT?") == "0"
        # In between, and not once all of it was worked off.
        assert bench.queued_errors.qsize() - before < FLOOD
    with wires.visa(addresses["socket"]) as next_one:
        # What was sent before its client left is still worked off; the tests that follow find an instrument at rest.
        quiet = 0
        while quiet < 5:
            quiet = quiet + 1 if next_one.query("SYST:ERR?") == '+0,"No error"' else 0
            next_one.write("*CLS")
            threading.Event().wait(0.02)


def test_too_many_connections_are_hung_up_on_and_those_there_stay(supply: dict[str, Any]) -> None:
    with ExitStack() as stack:
        good = stack.enter_context(wires.visa(supply["socket"]))
        assert good.query("*TST?") == "+0"
        crowd = [stack.enter_context(wires.stream(supply["socket"])) for _ in range(70)]
        assert crowd[-1].recv(1) == b""
        assert good.query("*TST?") == "+0"


def test_a_client_that_has_finished_sending_still_gets_its_reply(supply: dict[str, Any]) -> None:
    with wires.stream(supply["socket"]) as connection:
        connection.sendall(b"*TST?\n*OPC?\n")
        connection.shutdown(socket.SHUT_WR)
        assert wires.exactly(connection, 5) == b"+0\n1\n"
        assert connection.recv(1) == b""


def test_faults_pass_through_the_wires(bench: ServedBench, supply: dict[str, Any], way: str) -> None:
    faults = bench.bench.faults("supply")
    with wires.visa(supply[way], timeout=0.3) as session:
        session.write("*CLS")
        assert session.query("*OPC?") == "1"
        try:
            faults.add(Fault.on("silence", r"\*TST"))
            with pytest.raises(Exception, match="VI_ERROR_TMO"):
                session.query("*TST?")
            faults.add(Fault.on("replace", r"\*TST", reply=b"+7\n"))
            assert session.query("*TST?") == "+7"
            # A late reply on a socket stands in the way of the next one; by HiSLIP it is known for what it is.
            faults.add(Fault.on("late", r"\*TST", delay=25.0))
            with pytest.raises(Exception, match="VI_ERROR_TMO"):
                session.query("*TST?")
            session.timeout = 5000
            assert session.query("*OPC?") == ("+0" if way == "socket" else "1")
        finally:
            faults.clear()
