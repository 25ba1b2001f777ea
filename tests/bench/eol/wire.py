"""What stands between a station and its server, and breaks."""

import socket
import threading
from contextlib import suppress
from typing import Literal


class Wire:
    """Stands between a client and the server, and breaks at the next commit: before the server has heard it, or its answer is.

    While `passes` is not set, it takes what is sent and passes nothing on.
    """

    def __init__(self, host: str, port: int) -> None:
        self._target = (host, port)
        self.breaks: Literal["before", "after"] | None = None
        self.broken = 0
        self.passes = threading.Event()
        self.passes.set()
        self._connections: list[socket.socket] = []
        self._cut = False
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = self._listening.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        """Break for good: every connection, and whoever calls again is refused."""
        self._cut = True
        # A thread that waits for a call keeps the port; shutting it down wakes that thread.
        self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        self._part()

    def close(self) -> None:
        """Listen no more."""
        self.passes.set()
        self._listening.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listening.accept()
                server = socket.create_connection(self._target)
                self._connections += client, server
                if self._cut:
                    self._part()
                for source, sink in ((client, server), (server, client)):
                    threading.Thread(target=self._pass_on, args=(source, sink, client), daemon=True).start()

    def _part(self) -> None:
        for connection in list(self._connections):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def _pass_on(self, source: socket.socket, sink: socket.socket, client: socket.socket) -> None:
        with suppress(OSError), source, sink:
            while data := source.recv(1 << 16):
                self.passes.wait()
                breaks = self.breaks if source is client and b"COMMIT" in data else None
                if breaks is not None:
                    self.breaks, self.broken = None, self.broken + 1
                if breaks == "after":
                    # The client goes first: it must not hear that the server has taken it.
                    client.shutdown(socket.SHUT_RDWR)
                if breaks != "before":
                    sink.sendall(data)
                if breaks is not None:
                    client.close()
                    # The server ends what it was told before it looks whether anybody is there.
                    sink.shutdown(socket.SHUT_WR)
                    while sink.recv(1 << 16):
                        pass
                    return
