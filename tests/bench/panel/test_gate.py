"""What strangers get from a panel that runs: another's name, another page, too much, no session, guessed passwords."""

import asyncio
import http.client
import re
import socket
import ssl
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path

import pytest
from starlette.middleware.base import BaseHTTPMiddleware, RequestResponseEndpoint
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import Message, Receive, Scope, Send

from bench.cli.main import main
from bench.panel.server.access import add_person
from bench.panel.server.gate import Gate
from bench.panel.server.hosts import AllowedHosts
from bench.panel.server.sessions import Sessions
from tests.bench.panel.client import LIVE, Outsider, Page
from tests.bench.panel.conftest import QUICK, Server

UPGRADE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec_WebSocket_Version": "13",
    "Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ==",
}
WEBSOCKET = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A panel of this computer, without a login."""
    server = Server(tmp_path_factory.mktemp("open") / "runs", "--virtual", "--allow-host", "panel.example")
    server.start()
    yield server
    assert "Traceback" not in server.stop()


@pytest.fixture(scope="module")
def people(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("people") / "people.toml"
    add_person(path, "anna", "engineer", "correct horse", QUICK)
    add_person(path, "bo", "viewer", "battery staple", QUICK)
    return path


@pytest.fixture
def guarded(tmp_path: Path, people: Path) -> Iterator[Callable[..., Server]]:
    started: list[Server] = []

    def make(*options: str) -> Server:
        server = Server(tmp_path / "runs", "--virtual", "--people", str(people), *options)
        server.start()
        started.append(server)
        return server

    yield make
    assert not [message for message in (server.stop() for server in started) if "Traceback" in message]


@pytest.mark.parametrize("path", ["/", "/login", LIVE, WEBSOCKET])
@pytest.mark.parametrize("host", ["evil.example", "evil.example:{port}", "127.0.0.1.evil.example", "[::2]", "", "a b"])
def test_another_name_is_refused_with_the_option_that_would_allow_it(server: Server, path: str, host: str) -> None:
    headers = {"Host": host.format(port=server.port), **(UPGRADE if path == WEBSOCKET else {})}
    answer = Outsider(server.port).ask(path, **headers)
    assert answer.status == 403
    assert answer.headers["content-type"].startswith("text/plain")
    assert "--allow-host" in answer.text
    assert "set-cookie" not in answer.headers


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost:{port}", "LOCALHOST", "[::1]:{port}", "panel.example"])
def test_its_own_names_are_served(server: Server, host: str) -> None:
    assert Outsider(server.port).ask("/", Host=host.format(port=server.port)).status == 200


def test_two_hosts_are_none(server: Server) -> None:
    with socket.create_connection(("127.0.0.1", server.port)) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nHost: evil.example\r\n\r\n")
        assert connection.recv(100).startswith((b"HTTP/1.1 403", b"HTTP/1.1 400"))


@pytest.mark.parametrize(
    "origin",
    ["http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1:{port}", "http://localhost:{port}"],
)
def test_another_pages_request_is_refused(server: Server, origin: str) -> None:
    outsider = Outsider(server.port).begin()
    origin = origin.format(port=server.port)
    for path, method, headers in (
        ("/", "GET", {}),
        ("/login", "POST", {}),
        (LIVE, "GET", {}),
        (LIVE, "POST", {}),
        (WEBSOCKET, "GET", UPGRADE),
    ):
        answer = outsider.ask(path, method, Origin=origin, **headers)
        assert answer.status == 403, (path, method)
        assert "access-control-allow-origin" not in answer.headers


@pytest.mark.parametrize("path", ["/", LIVE])
def test_what_changes_something_names_its_origin(server: Server, path: str) -> None:
    assert Outsider(server.port).begin().ask(path, "POST", "40").status == 403
    assert Outsider(server.port).begin().ask(WEBSOCKET, **UPGRADE).status == 403


def test_what_another_page_loads_without_naming_itself_is_refused(server: Server) -> None:
    outsider = Outsider(server.port).begin()
    stranger = Outsider(server.port)
    for kind in ("image", "script", "iframe", "empty"):
        answer = stranger.ask("/", Sec_Fetch_Site="cross-site", Sec_Fetch_Dest=kind)
        assert answer.status == 403
        # Else a page could begin sessions until those of others are forgotten.
        assert "set-cookie" not in answer.headers
    assert stranger.ask("/", Sec_Fetch_Site="cross-site", Sec_Fetch_Dest="document").status == 200
    assert outsider.ask(LIVE, Sec_Fetch_Site="cross-site").status == 403
    assert outsider.ask(LIVE, Sec_Fetch_Site="same-site").status == 403
    assert outsider.ask(LIVE, Sec_Fetch_Site="same-origin").status == 200


def test_its_own_page_connects_and_is_told_of_no_other_origin(server: Server) -> None:
    outsider = Outsider(server.port).begin()
    answer = outsider.ask(LIVE, Origin=outsider.origin)
    assert answer.status == 200
    assert not [name for name in answer.headers if name.lower().startswith("access-control")]
    with socket.create_connection(("127.0.0.1", server.port)) as connection:
        headers = outsider.headers | UPGRADE | {"Origin": outsider.origin}
        lines = [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
        connection.sendall("\r\n".join([f"GET {WEBSOCKET} HTTP/1.1", *lines, "", ""]).encode())
        assert connection.recv(100).startswith(b"HTTP/1.1 101")


def test_a_connection_needs_a_session(server: Server) -> None:
    outsider = Outsider(server.port)
    assert outsider.ask(LIVE).status == 403
    assert outsider.ask(WEBSOCKET, Origin=outsider.origin, **UPGRADE).status == 403


def test_every_answer_says_what_a_browser_may_do_with_it(server: Server) -> None:
    outsider = Outsider(server.port).begin()
    nonces = set()
    for path in ("/", "/history", "/nothing", "/login", LIVE):
        headers = outsider.ask(path).headers
        policy = headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "frame-ancestors 'none'" in policy
        assert "script-src" in policy
        assert "'unsafe-inline'" not in policy.partition("script-src")[2].partition(";")[0]
        assert headers["x-frame-options"] == "DENY"
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "same-origin"
        nonces.add(re.search(r"'nonce-([^']+)'", policy)[1])  # type: ignore[index]
    assert len(nonces) == 5


def test_only_the_templates_own_scripts_carry_the_nonce(server: Server) -> None:
    answer = Outsider(server.port).ask("/", X_Forwarded_Prefix='"><script>alert(1)</script>')
    nonce = re.search(r"'nonce-([^']+)'", answer.headers["content-security-policy"])
    assert nonce is not None
    scripts = re.findall(r"<script([^>]*)>", answer.text)
    assert scripts
    within = [attributes for attributes in scripts if f'nonce="{nonce[1]}"' in attributes]
    assert within
    # The panel's own file needs none: the policy lets scripts of this server be loaded.
    assert [attributes.strip() for attributes in scripts if attributes not in within] == ['src="/assets/page.js"']
    assert "alert(1)" not in answer.text


def test_a_page_takes_messages_of_its_own_session_only(server: Server) -> None:
    victim, stranger = Outsider(server.port).begin(), Outsider(server.port).begin()
    page = Page(victim.ask("/").text)
    assert "not a page of this session" in page.connect(stranger)
    assert "sid" in page.connect(victim)
    # The connection is the victim's, and so is the page: but another speaks.
    own = Page(stranger.ask("/").text)
    assert "sid" in own.connect(stranger)
    own.identifier, own.elements = page.identifier, page.elements
    own.press(stranger, "Take the control")
    assert "Nobody has the control" in victim.ask("/").text
    page.press(victim, "Take the control")
    assert "You have the control" in victim.ask("/").text


def send_body(server: Server, head: str, piece: bytes, pieces: int) -> tuple[bytes, int]:
    """Send a body until the server has had enough; return the beginning of its answer and how much was sent."""
    sent = 0
    with socket.create_connection(("127.0.0.1", server.port), timeout=30) as connection:
        connection.sendall(head.format(port=server.port).encode())
        try:
            for _ in range(pieces):
                connection.sendall(piece)
                sent += len(piece)
        except (BrokenPipeError, ConnectionResetError):
            pass
        try:
            return connection.recv(100), sent
        except ConnectionResetError:
            return b"", sent


POST = "POST /login HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\n"
FORM = "Content-Type: application/x-www-form-urlencoded\r\n"


def memory(server: Server) -> int:
    """Return the most memory (kB) that a server had so far."""
    status = Path(f"/proc/{server.pid}/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+)", status)[1])  # type: ignore[index]


def test_a_body_before_the_login_is_small(guarded: Callable[..., Server]) -> None:
    server = guarded()
    before = memory(server)
    answer, _ = send_body(server, POST + FORM + "Content-Length: 100000000\r\n\r\n", bytes(1 << 16), 1600)
    assert answer.startswith(b"HTTP/1.1 413") or answer == b""
    chunk = b"10000\r\n" + bytes(1 << 16) + b"\r\n"
    answer, _ = send_body(server, POST + FORM + "Transfer-Encoding: chunked\r\n\r\n", chunk, 1600)
    assert answer.startswith(b"HTTP/1.1 413") or answer == b""
    answer, _ = send_body(server, POST + FORM + "Content-Length: 20000\r\n\r\n", b"a" * 16, 1)
    assert answer.startswith(b"HTTP/1.1 413")
    assert memory(server) - before < 20_000
    assert Outsider(server.port).log_in("anna", "correct horse").headers["location"] == "/"


def test_a_body_of_who_is_known_is_bounded_too(server: Server) -> None:
    outsider = Outsider(server.port).begin()
    answer = outsider.ask("/login", "POST", "a" * 1_100_000, Origin=outsider.origin)
    assert answer.status == 413


def test_a_head_without_end_is_refused(server: Server) -> None:
    answer, sent = send_body(
        server, "GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n", b"X-A: " + b"a" * 8000 + b"\r\n", 200
    )
    assert sent < 200 * 8000 or answer.startswith(b"HTTP/1.1 4") or answer == b""


def test_before_the_login_there_is_the_login_alone(guarded: Callable[..., Server]) -> None:
    server = guarded()
    outsider = Outsider(server.port)
    for path in ("/", "/history", "/runs/x", "/line", "/nothing", "/docs", "/openapi.json", "/favicon.ico"):
        answer = outsider.ask(path)
        assert (answer.status, answer.headers["location"]) == (303, "/login"), path
    for path in ("/_nicegui/3.0.0/static/nicegui.js", LIVE, "/_nicegui_ws/socket.io/"):
        assert outsider.ask(path).status == 403, path
    assert "<script" not in outsider.ask("/login").text


def test_the_cookie_is_for_no_script_and_no_other_site(guarded: Callable[..., Server]) -> None:
    outsider = Outsider(guarded().port)
    first = outsider.log_in("anna", "correct horse").headers["set-cookie"]
    assert re.fullmatch(r"motorbench_session=[\w-]{43}; Path=/; HttpOnly; SameSite=Strict", first)
    before = dict(outsider.headers)
    second = outsider.log_in("anna", "correct horse").headers["set-cookie"]
    assert first != second
    # Who logs in again leaves no session behind; who logs out none either.
    assert outsider.ask("/").status == 200
    assert outsider.ask("/", **before).status == 303
    assert outsider.ask("/logout", "POST", Origin=outsider.origin).status == 303
    assert outsider.ask("/").status == 303


def test_guesses_delay_nobody_else(guarded: Callable[..., Server]) -> None:
    server = guarded()
    here, there = Outsider(server.port), Outsider(server.port, "127.0.0.2")
    answers: list[int] = []
    threads = [
        threading.Thread(target=lambda: answers.append(here.log_in("anna", "wrong password").status)) for _ in range(25)
    ]
    for thread in threads:
        thread.start()
    # While all that is under way:
    assert there.log_in("bo", "battery staple").headers["location"] == "/"
    for thread in threads:
        thread.join()
    assert set(answers) == {303, 429}
    for _ in range(6):
        refused = here.log_in("anna", "wrong password")
    assert refused.status == 429
    assert int(refused.headers["retry-after"]) >= 1
    assert "尝试次数过多" in refused.text
    assert here.log_in("anna", "correct horse").status == 429
    assert here.log_in("bo", "battery staple").headers["location"] == "/"
    assert there.log_in("anna", "correct horse").headers["location"] == "/"


def test_an_address_is_not_believed_of_whoever_names_it(guarded: Callable[..., Server]) -> None:
    outsider = Outsider(guarded().port)
    answers = [
        outsider.log_in("anna", "wrong password", X_Forwarded_For=f"192.0.2.{number}", X_Forwarded_Proto="https").status
        for number in range(8)
    ]
    assert answers[-1] == 429


def test_a_trusted_proxy_is_believed(guarded: Callable[..., Server]) -> None:
    outsider = Outsider(guarded("--trusted-proxy", "127.0.0.1", "--allow-host", "panel.example").port)
    outsider.headers["Host"] = "panel.example"
    outsider.origin = "https://panel.example"
    behind = {"X_Forwarded_Proto": "https"}
    for _ in range(8):
        last = outsider.log_in("anna", "wrong password", X_Forwarded_For="192.0.2.1", **behind)
    assert last.status == 429
    answer = outsider.log_in("anna", "correct horse", X_Forwarded_For="192.0.2.2", **behind)
    assert answer.headers["location"] == "/"
    assert answer.headers["set-cookie"].endswith("; Secure")
    assert outsider.log_in("anna", "correct horse").status == 403


def test_an_idle_session_ends_for_pages_and_connections(guarded: Callable[..., Server]) -> None:
    server = guarded("--session-idle", "90")
    outsider = Outsider(server.port)
    outsider.log_in("anna", "correct horse")
    page = Page(outsider.ask("/").text)
    assert "sid" in page.connect(outsider)
    other = Outsider(server.port)
    # Whoever acts goes on, over the connection as well; the connection's own traffic is no act.
    for _ in range(3):
        assert page.press(outsider, "Take the control").startswith("200")
        server.pass_an_hour()
    assert page.press(outsider, "Take the control").startswith("200")
    other.log_in("bo", "battery staple")
    assert "anna has the control" in other.ask("/").text
    for _ in range(2):
        server.pass_an_hour()
        assert other.ask("/").status == 200
    assert page.press(outsider, "Take the control").startswith("403")
    assert "sid" not in page.connect(outsider)
    assert outsider.ask("/").status == 303
    other.log_in("bo", "battery staple")
    for _ in range(200):
        if "Nobody has the control" in (shown := other.ask("/").text):
            break
        threading.Event().wait(0.05)
    assert "Nobody has the control" in shown


def test_a_session_ends_in_time_however_much_it_is_used(guarded: Callable[..., Server]) -> None:
    server = guarded("--session-idle", "90", "--session-length", "2.5")
    outsider = Outsider(server.port)
    outsider.log_in("anna", "correct horse")
    for status in (200, 200, 303):
        server.pass_an_hour()
        assert outsider.ask("/statistics").status == status


@pytest.fixture
def certificate(tmp_path: Path) -> Path:
    command = [
        "openssl",
        "req",
        "-x509",
        "-newkey",
        "ec",
        "-pkeyopt",
        "ec_paramgen_curve:prime256v1",
        "-nodes",
        "-days",
        "1",
    ]
    command += ["-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1"]
    subprocess.run(
        [*command, "-keyout", tmp_path / "key.pem", "-out", tmp_path / "certificate.pem"],
        check=True,
        capture_output=True,
    )
    return tmp_path / "certificate.pem"


def test_tls_and_cookies_for_tls_alone(guarded: Callable[..., Server], certificate: Path) -> None:
    server = guarded("--certificate", str(certificate), "--key", str(certificate.with_name("key.pem")))
    context = ssl.create_default_context(cafile=certificate)
    connection = http.client.HTTPSConnection("127.0.0.1", server.port, context=context, timeout=30)
    headers = {"Origin": f"https://127.0.0.1:{server.port}", "Content-Type": "application/x-www-form-urlencoded"}
    connection.request("POST", "/login", "name=anna&password=correct+horse", headers)
    answer = connection.getresponse()
    assert answer.headers["location"] == "/"
    assert answer.headers["set-cookie"].endswith("; Secure")
    connection.close()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--certificate", "a.pem"], "--key together"),
        (["--certificate", "a.pem", "--key", "b.pem"], "cannot be used"),
        (["--session-idle", "0"], "--session-idle"),
        (["--session-idle", "nan"], "--session-idle"),
        (["--session-idle", "90", "--session-length", "1"], "--session-length"),
        (["--trusted-proxy", "proxy.example"], "give an IP address"),
    ],
)
def test_options_that_will_not_do(options: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["serve", "--virtual", *options])
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error


@pytest.mark.parametrize(("left", "looked"), [(True, True), (True, False), (False, False)])
def test_a_page_that_was_left_before_its_answer_is_no_fault(left: bool, looked: bool) -> None:
    class Passing(BaseHTTPMiddleware):
        async def dispatch(self, request: Request, call_next: RequestResponseEndpoint) -> Response:
            return await call_next(request)

    async def answering_nothing(scope: Scope, receive: Receive, send: Send) -> None:
        while looked and (await receive())["type"] == "http.request":
            pass

    coming = iter([{"type": "http.request", "body": b""}])
    scope = {"type": "http", "method": "GET", "path": "/", "scheme": "http", "headers": [(b"host", b"127.0.0.1")]}

    async def receive() -> Message:
        if message := next(coming, None):
            return message
        if not left:
            await asyncio.Event().wait()
        return {"type": "http.disconnect"}

    sent: list[Message] = []

    async def send(message: Message) -> None:
        sent.append(message)

    gate = Gate(Passing(answering_nothing), hosts=AllowedHosts("127.0.0.1"), sessions=Sessions(), login=False)
    # NiceGUI's own stand before and behind the gate, and take an answer that never comes for a fault.
    with nullcontext() if left else pytest.raises(RuntimeError, match="No response"):
        asyncio.run(Passing(gate)(scope, receive, send))
    assert [message["status"] for message in sent if "status" in message] == ([499] if left else [])
