"""Whole batches whose records go to a PostgreSQL server."""

import json
from collections.abc import Callable
from typing import Any

import pytest
from sqlalchemy import make_url

from bench.cli.main import main
from bench.eol.line.record_writer import own_records
from bench.eol.store.database import NoDatabaseError
from tests.bench.eol.wire import Wire
from tests.command_line import called


def through(server: str, wire: Wire) -> str:
    return make_url(server).set(host="127.0.0.1", port=wire.port).render_as_string(hide_password=False)


def numbers(reference: str, batch: str) -> list[int]:
    try:
        with own_records(reference) as records:
            return sorted(record.number for record in records.read(batch))
    except NoDatabaseError:
        # The server has no tables before the first record comes.
        return []


def test_a_batch_on_a_server_has_the_records_of_one_in_a_file_and_its_statistics(
    make_bench: Callable[[str], Any], timeless: Callable[..., Any], server: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file, remote = make_bench("file"), make_bench("server")
    file.run()
    counts, stopped = remote.run(records=server)
    assert (counts.motors, counts.waits.anything, stopped) == (4, False, "")
    with own_records(str(file.folder / "records.sqlite")) as here, own_records(server) as there:
        one = sorted(here.read("small"), key=lambda record: record.number)
        other = sorted(there.read("small"), key=lambda record: record.number)
    assert [timeless(record) for record in other] == [timeless(record) for record in one]
    assert len(other) == 4
    with pytest.raises(SystemExit) as stop:
        main(["eol", "stats", "--records", server, "--json"])
    assert not stop.value.code
    assert json.loads(capsys.readouterr().out)["motors"] == 4


def test_a_server_that_goes_in_the_middle_of_a_batch_has_every_record_once_with_the_next(
    bench: Any, server: str, wire: Wire, capsys: pytest.CaptureFixture[str]
) -> None:
    address = through(server, wire)

    def cut(motor: Any) -> None:
        if motor.number == 3:
            wire.cut()

    bench.listener.when_begun = cut
    counts, stopped = bench.run(records=address)
    assert (counts.motors, stopped) == (4, ""), "a line goes on without its server"
    assert counts.waits.for_server >= 2
    assert [str(trouble.why) for trouble in counts.waits.troubles]
    assert any(waiting.troubles and waiting.next_try for waiting in bench.listener.waitings), "told while it goes on"
    assert set(numbers(server, "small")) <= {1, 2}
    assert numbers(str(bench.folder / "runs" / "records.sqlite"), "small") == [1, 2, 3, 4]

    runs = ("--runs", str(bench.request.runs), "--json")
    code, said, error = called(capsys, "eol", "forward", "--records", address, *runs)
    assert (code, json.loads(said)["forwarded"]) == (1, 0)
    assert "the server accepts no records" in error
    code, said, _ = called(capsys, "eol", "forward", "--records", server, *runs)
    left = json.loads(said)
    assert (code, left["forwarded"], left["waiting_for_server"]) == (0, counts.waits.for_server, 0)
    assert numbers(server, "small") == [1, 2, 3, 4]

    bench.listener.when_begun = lambda _: None
    counts, stopped = bench.run(records=server, batch="next", motors=1, again=True, person="Wang")
    assert (counts.waits.anything, stopped) == (False, "")
    assert numbers(server, "small") == [1, 2, 3, 4]
    assert numbers(server, "next") == [1]


def test_a_server_without_tables_is_not_the_one_that_records_wait_for(
    bench: Any, server: str, capsys: pytest.CaptureFixture[str]
) -> None:
    counts, _ = bench.run(records="postgresql://nobody@127.0.0.1:1/line", motors=1)
    assert counts.waits.for_server == 1
    runs = ("--runs", str(bench.request.runs))
    for _ in range(2):
        code, said, error = called(capsys, "eol", "forward", "--records", server, *runs)
        assert (code, said) == (2, "")
        assert "has no tables of records; give the one that eol run was given" in error
    code, _, error = called(capsys, "eol", "forward", "--records", "postgresql://nobody@127.0.0.1:1/line", *runs)
    assert code == 1
    assert "records that wait for the server: 1" in error
