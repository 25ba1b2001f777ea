"""A run's connection to panels: questions go to all listeners, answers and requests come in, one JSON object per line."""

import json
import os
import secrets
import socketserver
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from bench.journal.encoding import plain
from bench.journal.stored_result import store_text
from drivers.interfaces.text import Text, text

#: The file in a run's folder that says where its line is.
FILE = "operator.json"
_LONGEST = 1 << 16

#: Does what a panel wishes; returns what was wrong with it, or None.
Hear = Callable[[Mapping[str, Any]], Text | None]


class OperatorLine:
    """Listens on loopback until closed.

    Who connects sends `{"token": …}` first, the one that stands in the run's folder, readable by its owner alone; then
    it gets what was said last of each matter, and everything said and told from then on. Each of its lines is answered by `{"heard": …}` or
    `{"refused": …}`, in English, with the same as a stored Text under `text`.
    """

    def __init__(self, hear: Hear) -> None:
        self._hear = hear
        self._token = secrets.token_urlsafe(24)
        self._lock = threading.Lock()
        self._listeners: dict[int, _Listener] = {}
        self._last: dict[str, Any] = {"question": None}
        self._server = _Server(self)
        self._thread = threading.Thread(target=self._server.serve_forever, name="operator line", daemon=True)
        self._thread.start()
        self._announced: Path | None = None

    def announce(self, folder: Path, name: str = FILE) -> None:
        """Write into a folder where the line is; raises OSError."""
        path = folder / name
        told = {"pid": os.getpid(), "port": self._server.server_address[1], "token": self._token}
        part = folder / f".{name}.part"
        descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            json.dump(told, file)
        part.replace(path)
        self._announced = path

    def say(self, message: Mapping[str, Any]) -> None:
        """Tell everyone, and who connects later."""
        said = plain(message)
        with self._lock:
            self._last = {**self._last, **said}
            listeners = list(self._listeners.values())
        for listener in listeners:
            listener.send(said)

    def tell(self, message: Mapping[str, Any]) -> None:
        """Send it to all present listeners, but not to later ones, because it is valid only now."""
        with self._lock:
            listeners = list(self._listeners.values())
        for listener in listeners:
            listener.send(plain(message))

    @property
    def heard(self) -> bool:
        """True if there is a listener."""
        return bool(self._listeners)

    def close(self) -> None:
        """Take the announcement back and stop listening: who loses the connection and still finds it knows that it was cut off."""
        if self._announced is not None:
            self._announced.unlink(missing_ok=True)
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()
        with self._lock:
            listeners = list(self._listeners.values())
        for listener in listeners:
            listener.hang_up()

    def admit(self, listener: "_Listener", token: object) -> bool:
        """Take a listener in if its token is right."""
        if not isinstance(token, str) or not secrets.compare_digest(token.encode(), self._token.encode()):
            return False
        with self._lock:
            self._listeners[id(listener)] = listener
            last = self._last
        listener.send(last)
        return True

    def leave(self, listener: "_Listener") -> None:
        """Forget a listener that has gone."""
        with self._lock:
            self._listeners.pop(id(listener), None)

    def hear(self, message: Mapping[str, Any]) -> Text | None:
        """Pass on what a listener says; return what was wrong with it, or None."""
        return self._hear(message)


class _Server(socketserver.ThreadingTCPServer):
    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, line: OperatorLine) -> None:
        self.line = line
        super().__init__(("127.0.0.1", 0), _Listener)


class _Listener(socketserver.StreamRequestHandler):
    server: _Server

    def setup(self) -> None:
        super().setup()
        self._writing = threading.Lock()

    def handle(self) -> None:
        line = self.server.line
        admitted = False
        with suppress(OSError):
            while (message := self._read()) is not None:
                if not admitted:
                    admitted = line.admit(self, message.get("token"))
                    if not admitted:
                        self.send(_refused(text("this is not the token in the run's folder")))
                        return
                    continue
                fault = line.hear(message)
                self.send(_refused(fault) if fault else {"heard": message.get("id")})

    def finish(self) -> None:
        self.server.line.leave(self)
        with suppress(OSError):
            super().finish()

    def send(self, message: Mapping[str, Any]) -> None:
        """Send one line; who has gone misses nothing that it could still read."""
        content = json.dumps(message, ensure_ascii=False).encode() + b"\n"
        with self._writing, suppress(OSError, ValueError):
            self.wfile.write(content)

    def hang_up(self) -> None:
        """End the connection."""
        with suppress(OSError):
            self.request.shutdown(2)

    def _read(self) -> dict[str, Any] | None:
        content = self.rfile.readline(_LONGEST)
        if not content.endswith(b"\n"):
            return None
        try:
            message = json.loads(content)
        except ValueError:
            message = None
        if not isinstance(message, dict):
            self.send(_refused(text("a line must be a JSON object")))
            return None
        return message


def _refused(fault: Text) -> dict[str, Any]:
    return {"refused": str(fault), "text": store_text(fault)}
