"""A server whose connection breaks in the middle of a commit: what it took and what it did not."""

import socket
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Literal

import pytest
from sqlalchemy import make_url

from bench.eol.store.database import open_database
from bench.eol.store.forwarding import ForwardingRecords
from bench.eol.store.records import Records
from tests.bench.eol.store.test_records import record


class Wire:
    """Stands between a client and the server, and breaks at the next commit: before the server has heard it, or its answer is."""

    def __init__(self, host: str, port: int) -> None:
        self._target = (host, port)
        self.breaks: Literal["before", "after"] | None = None
        self.broken = 0
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = self._listening.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        self._listening.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listening.accept()
                server = socket.create_connection(self._target)
                for source, sink in ((client, server), (server, client)):
                    threading.Thread(target=self._pass_on, args=(source, sink, client), daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket, client: socket.socket) -> None:
        with suppress(OSError), source, sink:
            while data := source.recv(1 << 16):
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


@pytest.fixture
def wire(server: str) -> Iterator[Wire]:
    url = make_url(server)
    between = Wire(url.host or "127.0.0.1", url.port or 5432)
    yield between
    between.close()


@pytest.mark.parametrize("when", ["before", "after"])
def test_a_commit_that_is_cut_off_loses_no_record_and_keeps_none_twice(
    tmp_path: Path, server: str, wire: Wire, when: Literal["before", "after"]
) -> None:
    through = make_url(server).set(host="127.0.0.1", port=wire.port).render_as_string(hide_password=False)
    station = ForwardingRecords(open_database(str(tmp_path / "own.sqlite")), lambda: open_database(through))
    kept = [record(number) for number in (1, 2, 3)]
    for each in kept[:2]:
        station.save(each)
    assert station.forward() == 2
    station.save(kept[2])
    wire.breaks = when
    assert station.forward() == 0
    assert wire.broken == 1
    assert station.waiting() == 1
    assert station.fault
    there = open_database(server)
    taken = 3 if when == "after" else 2
    for _ in range(500):
        if Records(there).count() == taken:
            break
        threading.Event().wait(0.01)
    assert Records(there).count() == taken

    assert station.forward() == 1
    assert (station.waiting(), station.fault) == (0, "")
    assert sorted(found.serial_number for found in Records(there).read()) == ["P-0001", "P-0002", "P-0003"]
    there.dispose()
    station.close()
