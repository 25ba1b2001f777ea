"""Who holds a database's tables while others wait for them: told at once, and not after the wait."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from os import getpid
from pathlib import Path
from threading import Event, Thread

from sqlalchemy import Connection, Engine
from sqlalchemy import text as sql
from sqlalchemy.exc import SQLAlchemyError

from drivers.interfaces.text import Text, lines, text

#: After so long (s) a wait is told of, and so often it is looked who is waited for now.
_LOOK = 0.5
_BLOCKING = sql(
    "SELECT pid, application_name, usename, coalesce(host(client_addr), 'localhost') AS address, xact_start FROM pg_stat_activity "
    "WHERE pid = ANY(pg_blocking_pids(:pid)) ORDER BY pid"
)


@contextmanager
def told_who_holds(connection: Connection, patience: float, tell: Callable[[Text], None]) -> Iterator[None]:
    """Call `tell`, from a thread, with who is waited for in the block, and again where that changes; `patience` (s) is the longest wait."""
    file = connection.connection.driver_connection
    pid = 0 if connection.dialect.name == "sqlite" or file is None else file.info.backend_pid
    ended = Event()

    def watch() -> None:
        before = ""
        while not ended.wait(_LOOK):
            with suppress(SQLAlchemyError, OSError):
                holders = (
                    _of_server(connection.engine, pid) if pid else _of_file(Path(str(connection.engine.url.database)))
                )
                words = str(lines(holders, between="; "))
                if holders and words != before and not ended.is_set():
                    tell(
                        text(
                            "others use the tables; they are waited for, {patience:g} s at most: {holders}",
                            patience=patience,
                            holders=lines(holders, between="; "),
                        )
                    )
                before = words

    thread = Thread(target=watch, name="lock holders", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _of_server(engine: Engine, pid: int) -> list[Text]:
    """Return the connections that a server's process waits for."""
    with engine.connect() as connection:
        rows = connection.execute(_BLOCKING, {"pid": pid}).all()
    return [
        text(
            "{program} of {user} at {address}, in a transaction since {time} (process {pid} of the server)",
            program=row.application_name or text("a program without a name"),
            user=row.usename or "?",
            address=row.address,
            time="?" if row.xact_start is None else row.xact_start.astimezone().strftime("%H:%M:%S"),
            pid=row.pid,
        )
        for row in rows
    ]


def _of_file(path: Path) -> list[Text]:
    """Return the processes that have a SQLite file locked for writing, as Linux tells it; none elsewhere.

    The file is not opened: as it is closed again this process would lose its own locks.
    """
    inodes = {file.stat().st_ino for file in (path, Path(f"{path}-shm")) if file.exists()}
    pids = set[int]()
    for line in Path("/proc/locks").read_text(encoding="ascii").splitlines():
        words = line.split()
        if len(words) == 8 and words[3] == "WRITE" and int(words[5].rsplit(":", 1)[1]) in inodes:
            pids.add(int(words[4]))
    return [_process(pid) for pid in sorted(pids - {getpid()})]


def _process(pid: int) -> Text:
    command = Path(f"/proc/{pid}/cmdline").read_bytes().decode("utf-8", "replace").replace("\0", " ").strip()
    return text("process {pid}: {command}", pid=pid, command=command[:120])
