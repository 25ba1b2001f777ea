"""An outsider at the panel: HTTP as it is written, and a page's connection by long polling."""

import http.client
import json
import re
import urllib.parse
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

LIVE = "/_nicegui_ws/socket.io/?EIO=4&transport=polling"


@dataclass
class Answer:
    status: int
    headers: http.client.HTTPMessage
    text: str


class Outsider:
    """Sends requests to a port of this computer; `headers` go with all of them."""

    def __init__(self, port: int, address: str = "127.0.0.1") -> None:
        self.port = port
        self.address = address
        self.headers: dict[str, str] = {"Host": f"127.0.0.1:{port}"}
        self.origin = f"http://127.0.0.1:{port}"

    def ask(self, path: str, method: str = "GET", body: str = "", **headers: str) -> Answer:
        """Return the answer; a header's underscores are dashes."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30, source_address=(self.address, 0))
        given = self.headers | {name.replace("_", "-"): value for name, value in headers.items()}
        try:
            connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for name, value in given.items():
                connection.putheader(name, value)
            if body or method == "POST":
                connection.putheader("Content-Length", str(len(body)))
            # A body that is too long is answered before it has all been sent.
            with suppress(BrokenPipeError, ConnectionResetError):
                connection.endheaders(body.encode())
            response = connection.getresponse()
            return Answer(response.status, response.headers, response.read().decode())
        finally:
            connection.close()

    def begin(self) -> "Outsider":
        """Open the panel, and keep the session that it gives."""
        self._keep(self.ask("/"))
        return self

    def log_in(self, name: str, password: str, **headers: str) -> Answer:
        """Send the login's form, and keep the session where it gives one."""
        body = urllib.parse.urlencode({"name": name, "password": password})
        kind = {"Content-Type": "application/x-www-form-urlencoded", "Origin": self.origin}
        answer = self.ask("/login", "POST", body, **(kind | headers))
        self._keep(answer)
        return answer

    def _keep(self, answer: Answer) -> None:
        if cookie := answer.headers["set-cookie"]:
            self.headers["Cookie"] = cookie.partition(";")[0]


class Page:
    """A page's identifier and elements, and messages in its name over a connection of `by`."""

    def __init__(self, html: str) -> None:
        result = re.search(r'"client_id": ?"([^"]+)"|\'client_id\': ?\'([^\']+)\'', html)
        assert result is not None
        self.identifier = result[1] or result[2]
        raw = re.search(r"parseElements\(String\.raw`(.*?)`\)", html, re.DOTALL)
        assert raw is not None
        plain = raw[1]
        for escaped, sign in (("&#36;", "$"), ("&#96;", "`"), ("&gt;", ">"), ("&lt;", "<"), ("&amp;", "&")):
            plain = plain.replace(escaped, sign)
        self.elements: Mapping[str, Any] = json.loads(plain)

    def connect(self, by: Outsider) -> str:
        """Open a connection for the page and return what the server says to it."""
        asked = f"{LIVE}&client_id={self.identifier}&tab_id=t&document_id=d&implicit_handshake=true&next_message_id=0"
        opened = by.ask(asked)
        if opened.status != 200:
            return f"{opened.status} {opened.text}"
        self._path = f"{asked}&sid={json.loads(opened.text[1:])['sid']}"
        return self.send(by, "40") and by.ask(self._path).text

    def send(self, by: Outsider, packet: str) -> str:
        answer = by.ask(self._path, "POST", packet, Origin=by.origin, Content_Type="text/plain;charset=UTF-8")
        return f"{answer.status} {answer.text}"

    def press(self, by: Outsider, label: str) -> str:
        """Press the button of this label."""
        number, listener = next(
            (number, event["listener_id"])
            for number, element in self.elements.items()
            if element.get("props", {}).get("label") == label
            for event in element["events"]
            if event["type"] == "click"
        )
        message = {"id": int(number), "client_id": self.identifier, "listener_id": listener, "args": ["{}"]}
        return self.send(by, f"42{json.dumps(['event', message])}")
