"""A server whose connection breaks in the middle of a commit: what it took and what it did not."""

import threading
from pathlib import Path
from typing import Literal

import pytest
from sqlalchemy import make_url

from bench.eol.store.database import open_database
from bench.eol.store.forwarding import ForwardingRecords
from bench.eol.store.records import Records
from bench.eol.store.spool import Spool
from tests.bench.eol.store.test_records import record
from tests.bench.eol.wire import Wire


@pytest.mark.parametrize("when", ["before", "after"])
def test_a_commit_that_is_cut_off_loses_no_record_and_keeps_none_twice(
    tmp_path: Path, server: str, wire: Wire, when: Literal["before", "after"]
) -> None:
    through = make_url(server).set(host="127.0.0.1", port=wire.port).render_as_string(hide_password=False)
    station = ForwardingRecords(
        open_database(str(tmp_path / "own.sqlite")), lambda: open_database(through), Spool(tmp_path, "own")
    )
    kept = [record(number) for number in (1, 2, 3)]
    for each in kept[:2]:
        station.save(each)
    assert station.forward() == 2
    station.save(kept[2])
    wire.breaks = when
    assert station.forward() == 0
    assert wire.broken == 1
    assert station.waiting() == 1
    # As one reads of a connection that cannot be made: where, without the password, and why.
    assert str(station.fault).startswith(make_url(through).render_as_string(hide_password=True))
    there = open_database(server)
    taken = 3 if when == "after" else 2
    for _ in range(500):
        if Records(there).count() == taken:
            break
        threading.Event().wait(0.01)
    assert Records(there).count() == taken

    assert station.forward() == 1
    assert (station.waiting(), station.fault) == (0, "")
    assert sorted(result.serial_number for result in Records(there).read()) == ["P-0001", "P-0002", "P-0003"]
    there.dispose()
    station.close()
