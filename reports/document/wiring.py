"""The verification of a procedure's connections, and its results."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from drivers.interfaces.text import Text, text
from procedures.core.actions import SOCKET_NAMES, Connect, Socket
from procedures.verification.check import Connection, connections_of
from procedures.verification.messages import outcome
from reports.document.model import Column, Table, TableRow
from reports.labels import role_name


def wiring_table(checks: Sequence[Mapping[str, Any]], colours: Mapping[str, str]) -> Table | None:
    """Return a row for every check, as it stands in a result's findings under "wiring"; None where there was none."""
    rows = [
        TableRow(
            [_connected(connections_of(check)), role_name(check["by"]) if check["by"] else "", outcome(check, colours)]
        )
        for check in checks
    ]
    if not rows:
        return None
    return Table(
        [Column(text("Connection"), wide=True), Column(text("Verified by")), Column(text("Wiring"), wide=True)],
        rows,
    )


def _connected(made: Sequence[Connection]) -> Text:
    message = None
    for line in _lines(made):
        message = line if message is None else Text("{said}; {line}", {"said": message, "line": line})
    return message or Text("")


def _lines(made: Sequence[Connection]) -> Iterator[Text]:
    for connection in made:
        if not isinstance(connection, Connect):
            lines = connection.lines({})
            yield from lines[1:] or lines
            continue
        joined = [(t, socket) for t, socket in connection.complete().items() if socket is not Socket.OPEN]
        for terminal, socket in joined:
            yield text("{terminal} → {socket}", terminal=terminal.value, socket=SOCKET_NAMES[socket])
        if not joined:
            yield text("all terminals open")
