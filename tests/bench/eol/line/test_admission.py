"""Who may be tested at two stations of one server, with the server there and away."""

import errno
import gc
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path
from threading import Barrier, Event
from time import monotonic

import pytest
from sqlalchemy import make_url

from bench.eol.admission_rule import AdmittedTest, RefusedTest
from bench.eol.line.admission.admission_desk import AdmissionDesk
from bench.eol.line.record_writer import RecordWriter, open_record_writer
from bench.eol.plan_file import RetestSection
from bench.eol.serial_number import spelled
from bench.eol.store.faults import StoreError
from bench.eol.store.waiting import ForwardingProblem, Waiting
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError
from drivers.interfaces.text import Text
from tests.bench.eol.motor_records import motor_record
from tests.bench.eol.wire import Wire

AWAY = "postgresql://nobody@127.0.0.1:9/none"


class Station:
    """A station with its own records, and a desk that admits for its batch."""

    def __init__(self, name: str, writer: RecordWriter, rule: RetestSection, *, shared: bool) -> None:
        self.name, self.writer = name, writer
        self.troubles: list[str] = []
        self.shared = shared
        self.desk = AdmissionDesk(
            writer.register, lambda _: None, self.identifier, self._trouble, f"batch of {name}", name, "LG-400W", rule
        )

    def identifier(self, number: int) -> str:
        return f"{self.name}-{number}"

    def _trouble(self, words: Text) -> None:
        self.troubles.append(str(words))

    def admit(self, serial: str, number: int = 1) -> AdmittedTest | RefusedTest:
        return self.desk.admit(serial, number, "1")

    def done(self, serial: str, verdict: Verdict, number: int = 1, again_by: str = "") -> None:
        """Keep the record of a test that begins now, and have the server know it."""
        now = datetime.now(UTC)
        self.writer.save(
            motor_record(
                identifier=self.identifier(number),
                number=number,
                batch=f"batch of {self.name}",
                station=self.name,
                serial_number=serial,
                verdict=verdict,
                again_by=again_by,
                started=now,
                ended=now,
            )
        )
        if self.shared:
            until = monotonic() + 10.0
            while self.writer._forwarding.waiting() and monotonic() < until:
                Event().wait(0.02)


@pytest.fixture
def make_station(tmp_path: Path) -> Iterator[Callable[..., Station]]:
    with ExitStack() as stack:

        def make(name: str, server: str, rule: RetestSection | None = None) -> Station:
            writer = open_record_writer(server, tmp_path / name)
            stack.callback(writer.close)
            return Station(name, writer, rule or RetestSection(), shared=server != AWAY)

        yield make


def test_two_stations_that_scan_one_serial_number_at_once(make_station: Callable[..., Station], server: str) -> None:
    stations = [make_station(name, server) for name in ("east", "west")]
    barrier = Barrier(2)

    def scan(station: Station) -> list[AdmittedTest | RefusedTest]:
        decisions = []
        for number in range(1, 9):
            barrier.wait()
            decisions.append(station.admit(f"A{number}", number))
        return decisions

    with ThreadPoolExecutor(2) as pool:
        for east, west in zip(*pool.map(scan, stations), strict=True):
            admitted, refused = (east, west) if isinstance(east, AdmittedTest) else (west, east)
            assert admitted == AdmittedTest(1)
            assert isinstance(refused, RefusedTest)
            assert f"is under test at station {'east' if admitted is east else 'west'}, socket 1" in str(refused.why)


def test_what_one_station_found_the_other_knows(make_station: Callable[..., Station], server: str) -> None:
    east, west = make_station("east", server), make_station("west", server)
    assert east.admit("A1") == AdmittedTest(1)
    east.done("A1", Verdict.FAIL)
    refused = west.admit("A1")
    assert isinstance(refused, RefusedTest)
    assert "fail at station east, socket 1" in str(refused.why)
    assert "batch of east" in str(refused.why)
    west.desk.permit("A1", "Wang")
    assert west.admit("A1") == AdmittedTest(2, "Wang", judged_before=True)
    west.done("A1", Verdict.ABORTED, again_by="Wang")
    assert east.admit("A1", 2) == AdmittedTest(3, judged_before=True), "what a person had permitted was cut off"
    east.done("A1", Verdict.PASS, 2)
    assert isinstance(west.admit("A1", 2), RefusedTest)
    assert isinstance(west.admit("A1", 3), RefusedTest), "a permission is for one test"


def test_a_motor_scanned_in_other_capitals_is_not_tested_as_new(
    make_station: Callable[..., Station], server: str
) -> None:
    """A scanner with Caps Lock on sends a1 for A1: it had failed, and would pass as another one."""
    east, west = make_station("east", server), make_station("west", server)
    assert east.admit("A1") == AdmittedTest(1)
    east.done("A1", Verdict.FAIL)
    for station, other in ((west, "a1"), (east, "ａ１")):
        refused = station.desk.admit(spelled(other), 2, "1")
        assert isinstance(refused, RefusedTest)
        assert refused.by_person
        assert "serial number a1 differs from A1 in capitals only, and would be another motor" in str(refused.why)
        assert "serial number A1 was tested before: fail at station east" in str(refused.why)
    west.desk.permit("a1", "Wang")
    assert west.admit("a1", 3) == AdmittedTest(1, "Wang"), "another motor: a person says so"
    west.done("a1", Verdict.PASS, 3)
    assert isinstance(west.admit("A1", 4), RefusedTest)
    assert "tested before: fail" in str(west.admit("A1", 4).why), "and each has its own tests"
    assert east.troubles == west.troubles == []
    east.desk.spelling_stated = True
    east.done("B1", Verdict.PASS, 5)
    assert east.admit("b1", 6) == AdmittedTest(1), "the plan's pattern takes both"
    assert "serial number b1 differs from B1 in capitals only" in east.troubles[0]


def test_a_server_that_is_away_holds_nothing_up_and_is_told_of_once(make_station: Callable[..., Station]) -> None:
    station = make_station("east", AWAY)
    assert station.admit("A1") == AdmittedTest(1)
    station.done("A1", Verdict.PASS)
    assert station.admit("A2", 2) == AdmittedTest(1)
    (words,) = station.troubles
    assert "cannot be read: the server:" in words
    assert isinstance(station.admit("A1", 3), RefusedTest), "its own records are known all the same"


def test_a_server_that_is_there_and_silent_holds_nothing_up(
    make_station: Callable[..., Station], server: str, wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = make_url(server).set(host="127.0.0.1", port=wire.port).render_as_string(hide_password=False)
    station = make_station("east", address)
    assert station.admit("A1") == AdmittedTest(1)
    monkeypatch.setattr("bench.eol.line.admission.serial_register._PATIENCE", 0.5)
    monkeypatch.setattr("bench.eol.line.admission.serial_register._PAUSE", 0.0)
    wire.passes.clear()
    assert station.admit("A2", 2) == AdmittedTest(1)
    assert station.admit("A3", 3) == AdmittedTest(1)
    (silent,) = station.troubles
    assert "cannot be read: the server: no answer within 0.5 s" in silent
    wire.passes.set()
    until = monotonic() + 60.0
    while len(station.troubles) < 2 and monotonic() < until:
        assert isinstance(station.admit("A4", 4), AdmittedTest)
    assert station.troubles[-1] == "from serial number A4 on, earlier tests are looked up again"
    # A connection that nobody closed is told of when it is collected.
    gc.collect()


def test_when_earlier_tests_can_be_looked_up_again_it_is_told(
    make_station: Callable[..., Station], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unreadable(*_: object) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr("bench.eol.line.admission.serial_register._PAUSE", 0.0)
    station = make_station("east", str(tmp_path / "records.sqlite"))
    with monkeypatch.context() as patch:
        patch.setattr("bench.eol.line.admission.serial_register.earlier_tests", unreadable)
        for number in (1, 2):
            assert station.admit(f"A{number}", number) == AdmittedTest(1)
    for number in (3, 4):
        assert station.admit(f"A{number}", number) == AdmittedTest(1)
    away, back = station.troubles
    assert "serial number A1 and those after it are measured" in away
    assert "the station's own database: " in away
    assert back == "from serial number A3 on, earlier tests are looked up again"


def test_a_plan_may_refuse_what_cannot_be_looked_up(make_station: Callable[..., Station]) -> None:
    refused = make_station("east", AWAY, RetestSection(unknown="refuse")).admit("A1")
    assert isinstance(refused, RefusedTest)
    assert "cannot be read: the server:" in str(refused.why)


def test_what_is_refused_is_not_claimed(make_station: Callable[..., Station], server: str) -> None:
    east, west = make_station("east", server), make_station("west", server)
    east.done("A1", Verdict.PASS)
    for station in (east, west, east):
        refused = station.admit("A1", 2)
        assert isinstance(refused, RefusedTest)
        assert "was tested before: pass" in str(refused.why)

    def never(serial: str) -> None:
        raise InputError(f"{serial}: no")

    west.desk.check = never
    assert isinstance(west.admit("A2"), RefusedTest)
    assert east.admit("A2", 2) == AdmittedTest(1)


def test_a_server_that_takes_records_again_is_asked_for_earlier_tests_at_once(
    make_station: Callable[..., Station], server: str
) -> None:
    station = make_station("east", server)
    writer, heard = station.writer, list[Waiting]()
    writer.listen(heard.append)
    writer.register._away["server"] = (monotonic(), Text("away"))
    away = Waiting(troubles=(ForwardingProblem(Text("away"), datetime.now(UTC)),))
    writer._forwarder._say(away)
    with pytest.raises(StoreError, match="away"):
        writer.register.tests_elsewhere("A1")
    writer._forwarder._say(Waiting())
    assert writer.register.tests_elsewhere("A1") == []
    assert heard == [away, Waiting()]
