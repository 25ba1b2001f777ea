"""Interlocks as a run sees them: refused while open, latched once opened, reset by a person."""

import re
import threading
from pathlib import Path
from typing import Any

import pytest

from bench.cli.station.check import check
from bench.cli.station.reset import reset
from bench.i18n.errors import InputError, UsageError
from bench.journal.codec import data_of
from bench.journal.events.safety import InterlocksStart
from bench.safety.interlocks import Delays, Interlocks, Uninterlocked, ready
from bench.safety.interrupts import Interrupts
from bench.safety.ownership.state_folder import state_folder
from bench.safety.trip_latch import Latch
from bench.station.interlock_entries import InterlockEntry
from bench.station.station_file import load_station
from bench.virtual.virtual_station import virtual_station
from drivers.cia402.options import CanInterlockOptions
from drivers.delta.options import ModbusInterlockOptions
from drivers.interfaces import CommunicationError
from drivers.interlocks.catalogue import CAN, MODBUS
from drivers.safety_devices import InterlockDriver
from procedures.core.events import Event

STATION = """
[station]
name = "Bench 1"
[interlocks.emergency_stop]
address = "tcp://192.0.2.9:502"
number = 3
[interlocks.door]
address = "can://socketcan/can0"
frame = 0x1A0
byte = 0
bit = 1
closed = false
"""


class Contact:
    """A contact in the hands of a test."""

    def __init__(self) -> None:
        self.is_closed = True
        self.error: Exception | None = None
        self.ended = 0

    def closed(self) -> bool:
        if self.error is not None:
            raise self.error
        return self.is_closed

    def close(self) -> None:
        self.ended += 1


@pytest.fixture
def contacts(monkeypatch: pytest.MonkeyPatch) -> dict[str, Contact]:
    made = {"emergency_stop": Contact(), "door": Contact()}
    monkeypatch.setattr(InterlockDriver, "open", lambda *_, name: made[name.split(".")[-1]])
    return made


@pytest.fixture
def station(tmp_path: Path) -> Path:
    path = tmp_path / "station.toml"
    path.write_text(STATION, encoding="utf-8")
    return path


@pytest.fixture(autouse=True)
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MOTORBENCH_STATE", str(tmp_path / "state"))


def start(station: Path) -> None:
    """Start and end at once."""
    with ready(load_station(station), state_folder()):
        pass


class Journal:
    def __init__(self) -> None:
        self.events: list[tuple[str, dict[str, Any]]] = []
        self.told = threading.Event()

    def record(self, event: Event) -> None:
        self.events.append((event.kind, data_of(event)))
        self.told.set()


def test_a_station_has_its_interlocks(station: Path) -> None:
    assert load_station(station).interlocks == (
        InterlockEntry("emergency_stop", MODBUS, "tcp://192.0.2.9:502", ModbusInterlockOptions(3)),
        InterlockEntry("door", CAN, "can://socketcan/can0", CanInterlockOptions(0x1A0, 0, 1, closed=False)),
    )


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ('address = "tcp://192.0.2.9:502"', "", ["interlocks.emergency_stop.address is missing"]),
        ("tcp://192", "http://192", ["interlocks.emergency_stop.address", "write tcp://host:port"]),
        ("number = 3", "", ["interlocks.emergency_stop.number"]),
        ("number = 3", "frame = 3", ["interlocks.emergency_stop.frame"]),
        ("bit = 1", 'bit = "1"', ["interlocks.door.bit"]),
    ],
)
def test_each_fault_of_an_interlock_is_named(station: Path, old: str, new: str, parts: list[str]) -> None:
    station.write_text(STATION.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_station(station)
    assert all(part in str(refused.value) for part in parts), str(refused.value)


def test_a_station_without_any_is_not_held_up() -> None:
    with ready(virtual_station({}), None) as nothing:
        assert isinstance(nothing, Uninterlocked)
        assert nothing.about() == InterlocksStart()
        nothing.watch(Journal(), Interrupts())


@pytest.mark.parametrize("silent", [False, True])
def test_nothing_starts_while_one_is_open(station: Path, contacts: dict[str, Contact], silent: bool) -> None:
    contacts["door"].is_closed = False
    contacts["door"].error = CommunicationError("interlock door", "no frame") if silent else None
    how = r"silent, which counts as open \(interlock door: no frame\)" if silent else "open"
    with pytest.raises(InputError, match=f"the interlock door is {how}. Close it, then: motorbench station reset"):
        start(station)
    assert [contact.ended for contact in contacts.values()] == [1, 1]
    contacts["door"].is_closed, contacts["door"].error = True, None
    with pytest.raises(InputError, match=r"the interlock door was .* it has not been reset"):
        start(station)
    assert reset(station, by="Li Wei") == 0
    start(station)


@pytest.mark.parametrize("silent", [False, True])
def test_one_that_opens_ends_the_run_and_keeps_the_station_still(
    station: Path, contacts: dict[str, Contact], silent: bool
) -> None:
    journal, interrupts = Journal(), Interrupts()
    with ready(load_station(station), state_folder()) as watched:
        watched.watch(journal, interrupts)
        assert not interrupts.requested_by
        contacts["door"].is_closed = False
        contacts["door"].error = CommunicationError("interlock door", "no frame") if silent else None
        assert journal.told.wait(10.0)
        assert re.match("the interlock door, which is (open|silent)", str(interrupts.requested_by))
    assert [kind for kind, _ in journal.events] == ["interlock_opened"]
    contacts["door"].is_closed, contacts["door"].error = True, None
    with pytest.raises(
        InputError, match=r"the interlock door was .* it has not been reset.*station reset .* --by NAME"
    ):
        start(station)


class Woken(Contact):
    """Silent for so many readings that its reader was late for."""

    def __init__(self, silent: int) -> None:
        super().__init__()
        self.silent = silent
        self.read = threading.Event()

    def closed(self) -> bool:
        if self.silent:
            self.silent -= 1
            raise CommunicationError("interlock door", "no frame")
        self.read.set()
        return self.is_closed


@pytest.mark.parametrize(("late", "silent", "trips"), [(True, 1, False), (True, 2, True), (False, 1, True)])
def test_a_reader_that_was_late_itself_reads_once_more(
    monkeypatch: pytest.MonkeyPatch, late: bool, silent: int, trips: bool
) -> None:
    door = Woken(silent)
    monkeypatch.setattr(InterlockDriver, "open", lambda *_, **__: door)
    monkeypatch.setattr(Delays, "since", lambda *_: late)
    tripped = threading.Event()
    interlocks = Interlocks([InterlockEntry("door", MODBUS, "tcp://h", ModbusInterlockOptions(0))])
    interlocks.watch(lambda *_: tripped.set())
    assert (tripped if trips else door.read).wait(10.0)
    interlocks.close()
    assert tripped.is_set() is trips


def test_a_process_knows_when_it_got_no_time() -> None:
    time = [0.0]
    delays = Delays(lambda: time[0])
    for _ in range(10):
        time[0] += 0.06
        delays.tick()
    assert not delays.since(0.0)
    time[0] += 0.5
    # Known before the next tick, and remembered after it.
    assert delays.since(time[0])
    delays.tick()
    assert delays.since(time[0] - 0.1)
    assert not delays.since(time[0] + 0.001)


def test_a_person_resets_and_the_next_record_says_who(
    station: Path, contacts: dict[str, Contact], capsys: pytest.CaptureFixture[str]
) -> None:
    latch = Latch(state_folder(), load_station(station))
    latch.trip("door", "open")
    latch.trip("emergency_stop", "open")
    contacts["door"].is_closed = False
    with pytest.raises(InputError, match="the interlock door is open"):
        reset(station, by="Li Wei")
    contacts["door"].is_closed = True
    with pytest.raises(UsageError, match="--by NAME"):
        reset(station, by=" ")
    assert reset(station, by="Li Wei") == 0
    assert "reset by Li Wei: the interlock door was open at 20" in capsys.readouterr().out
    assert reset(station, by="Li Wei", json=True) == 0
    assert '"reset": false' in capsys.readouterr().out
    for expected in ("Li Wei", None):
        with ready(load_station(station), state_folder()) as watched:
            about = watched.about()
            assert (about.reset or {}).get("reset_by") == expected
            assert about.names == ["emergency_stop", "door"]


def test_a_latch_that_cannot_be_read_stands(station: Path) -> None:
    latch = Latch(state_folder(), load_station(station))
    latch.path.write_text("{", encoding="utf-8")
    trip = latch.standing()
    assert trip is not None
    assert "line 1, cannot be read" in trip.how
    latch.trip("door", "open")
    assert latch.path.read_text(encoding="utf-8").count("\n") == 2
    assert latch.reset("Li Wei") is not None
    assert latch.standing() is None


def test_where_nothing_can_be_remembered_nothing_starts(
    station: Path, contacts: dict[str, Contact], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = state_folder()
    (folder.path / "trips.jsonl").mkdir()
    with pytest.raises(InputError, match=r"trips\.jsonl.*cannot be read|trips\.jsonl: it is a folder"):
        ready(load_station(station), folder).__enter__()
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(InputError, match=r"this folder, which keeps .* you have no permission to write there"):
        state_folder()


def test_a_station_without_interlocks_has_nothing_to_reset(tmp_path: Path) -> None:
    path = tmp_path / "station.toml"
    path.write_text('[station]\nname = "Bench 1"\n', encoding="utf-8")
    with pytest.raises(InputError, match="nothing to reset"):
        reset(path, by="Li Wei")


def test_the_stations_check_tells_how_they_are(
    station: Path, contacts: dict[str, Contact], capsys: pytest.CaptureFixture[str]
) -> None:
    assert check(station) == 0
    contacts["door"].is_closed = False
    assert check(station) == 1
    assert "it is open" in capsys.readouterr().out
    assert check(station, json=True) == 1
    assert '"error": "it is open"' in capsys.readouterr().out


def test_those_that_are_open_are_let_go_of_where_another_cannot_be_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    first = Contact()

    def opening(_: InterlockDriver, address: str, options: object, name: str) -> Contact:
        if "door" in name:
            raise CommunicationError(name, "no such bus")
        return first

    monkeypatch.setattr(InterlockDriver, "open", opening)
    entries = [
        InterlockEntry(name, MODBUS, "tcp://h", ModbusInterlockOptions(0)) for name in ("emergency_stop", "door")
    ]
    with pytest.raises(CommunicationError, match="no such bus"):
        Interlocks(entries)
    assert first.ended == 1
