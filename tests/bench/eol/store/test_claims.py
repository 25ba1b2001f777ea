"""Serial numbers under test: of several stations that scan one at once, exactly one gets it."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from threading import Barrier

import pytest
from sqlalchemy import Engine

from bench.eol.line.admission.serial_register import SerialRegister
from bench.eol.store.claims import (
    STALE,
    STALE_BY_PERSON,
    SerialClaim,
    claim_of_serial,
    claim_serial,
    release_serial,
)
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from tests.bench.eol.motor_records import NOON, motor_record


def claim(number: int, serial: str = "A1") -> SerialClaim:
    return SerialClaim(serial, f"{number:036d}", "B1", number, f"station {number}", "1", NOON)


def test_of_stations_that_scan_a_serial_number_at_once_exactly_one_gets_it(reference: str, engine: Engine) -> None:
    stations, rounds = 4, 12
    barrier = Barrier(stations)

    def scans(station: int) -> list[SerialClaim | None]:
        own = open_database(reference)
        try:
            holders = []
            for number in range(rounds):
                barrier.wait()
                holders.append(claim_serial(own, claim(station, f"A{number}")))
            return holders
        finally:
            own.dispose()

    with ThreadPoolExecutor(stations) as pool:
        found = list(pool.map(scans, range(1, stations + 1)))
    for number in range(rounds):
        holders = [holders[number] for holders in found]
        assert holders.count(None) == 1, "one has it"
        (holder,) = {holder for holder in holders if holder is not None}
        assert holder == claim(holders.index(None) + 1, f"A{number}"), "the others hear who"
        assert claim_of_serial(engine, f"A{number}") == holder


def test_a_claim_is_made_again_by_its_own_test_and_by_no_other(engine: Engine) -> None:
    assert claim_serial(engine, claim(1)) is None
    assert claim_serial(engine, claim(1)) is None, "a batch that goes on"
    assert claim_serial(engine, claim(2)) == claim(1)
    release_serial(engine, claim(2))
    assert claim_of_serial(engine, "A1") == claim(1), "only its holder lets go of it"
    release_serial(engine, claim(1))
    assert claim_serial(engine, claim(2)) is None


@pytest.mark.parametrize("stale", [STALE, STALE_BY_PERSON])
def test_one_that_was_left_is_taken_over_when_it_is_stale(engine: Engine, stale: timedelta) -> None:
    assert claim_serial(engine, claim(1)) is None
    soon, later = (replace(claim(2), since=NOON + stale + off) for off in (timedelta(), timedelta(seconds=1)))
    assert claim_serial(engine, soon, stale) == claim(1)
    assert claim_serial(engine, later, stale) is None
    assert claim_of_serial(engine, "A1") == later


def test_the_record_takes_the_place_of_the_claim(engine: Engine, records: Records) -> None:
    claim_serial(engine, claim(1))
    claim_serial(engine, claim(2, "A2"))
    records.save(motor_record(1, serial_number="A1"))
    assert claim_of_serial(engine, "A1") is None
    assert claim_of_serial(engine, "A2") is not None
    # A record that comes a second time, for its confirmation was lost, lets go of nothing of another test.
    claim_serial(engine, claim(3))
    records.save(motor_record(1, serial_number="A1"))
    assert claim_of_serial(engine, "A1") == claim(3)


def test_a_claim_of_a_test_whose_record_waits_for_the_server_holds_nobody_up(server: str, tmp_path: Path) -> None:
    databases = [open_database(str(tmp_path / name)) for name in ("own.sqlite", "other.sqlite")]
    own = databases[0]
    try:
        register = SerialRegister(own, server, lambda: iter(()))
        other = SerialRegister(databases[1], server, lambda: iter(()))
        assert register.claim(claim(1)) is None
        assert register.claim(claim(2)) == claim(1), "it is measured"
        # The server is away when the motor is done: it lets go of the claim when the record comes.
        Records(own).save(motor_record(1, serial_number="A1"))
        assert other.claim(claim(3)) == claim(1), "no other station knows that"
        assert register.claim(claim(2)) is None
        assert other.claim(claim(3)) == claim(2)
        register.close()
        other.close()
    finally:
        for database in databases:
            database.dispose()


def test_a_claim_of_a_station_whose_clock_was_ahead_holds_nobody_up(engine: Engine) -> None:
    early, ahead = (replace(claim(1), since=NOON + off) for off in (STALE, timedelta(days=400)))
    assert claim_serial(engine, early) is None
    assert claim_serial(engine, claim(2)) == early, "clocks differ a little"
    release_serial(engine, early)
    assert claim_serial(engine, ahead) is None
    assert claim_serial(engine, claim(2)) is None
