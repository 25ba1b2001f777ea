"""Relays with a watchdog in a station file, beside a run's guard, and in what is said of each role."""

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import monotonic
from typing import Any

import pytest

from bench.i18n.errors import InputError
from bench.journal.codec import data_of
from bench.safety.guardian.link import Unguarded
from bench.safety.interrupts import Interrupts
from bench.safety.watchdog_relays import FedRelay, RelayedGuard, relays_ready
from bench.safety.watchdogs import armed_watchdogs, planned_watchdogs
from bench.station.station_file import Station, make_station
from bench.station.watchdog_relay_entries import RelayEntry
from drivers.delta.options import BeckhoffRelayOptions
from drivers.interfaces import CommunicationError, InstrumentError, ReportedError, Watchdog, WhenSilent
from drivers.safety_devices import RelayDriver
from procedures.core.bench import Role
from procedures.core.events import Event
from tests.journals import event

PATIENCE = 30.0
TIME = 1.0

SUPPLY = {"driver": "keysight-e36300", "address": "TCPIP0::192.0.2.10::inst0::INSTR", "channel": 1}
DRIVE = {"driver": "cia402-six-step", "address": "can://virtual/x?node=6"}
RELAY = {"driver": "beckhoff-bk9000", "address": "tcp://192.0.2.31:502", "roles": ["supply"]}


def station(**tables: Any) -> Station:
    data = {"station": {"name": "bench"}, "instruments": {"supply": SUPPLY, "drive": DRIVE}, **tables}
    return make_station(data, "bench.toml", b"")


class Relay:
    """A relay that keeps what was done to it, and fails as it is told to."""

    watchdog = Watchdog(TIME, WhenSilent.CONTACT_OPENS, "a setting")

    def __init__(self) -> None:
        self.done: list[str] = []
        self.fails: dict[str, Exception] = {}
        self.fed = threading.Event()

    def _do(self, what: str) -> None:
        error = self.fails.get(what)
        self.done.append(what)
        if error is not None:
            raise error

    def picked_up(self) -> bool:
        return "pick_up" in self.done and "drop_out" not in self.done

    def pick_up(self) -> None:
        self._do("pick_up")

    def feed(self) -> None:
        self.fed.set()
        self._do("feed")

    def drop_out(self) -> None:
        self._do("drop_out")

    def close(self) -> None:
        self._do("close")

    def is_fed(self, times: int) -> None:
        """Wait until it has been fed so often from now on, and each time as it fails now."""
        count = len(self.done) + times + 1
        until(lambda: len(self.done) >= count)

    @property
    def commands(self) -> list[str]:
        return [what for what in self.done if what != "feed"]


class Recorder:
    def __init__(self) -> None:
        self.events: list[tuple[str, Mapping[str, Any]]] = []

    def record(self, event: Event) -> None:
        self.events.append((event.kind, data_of(event)))

    @property
    def kinds(self) -> list[str]:
        return [kind for kind, _ in self.events]


@pytest.fixture
def relay() -> Relay:
    return Relay()


@pytest.fixture
def recorder() -> Recorder:
    return Recorder()


@pytest.fixture
def entry(relay: Relay) -> RelayEntry:
    driver = RelayDriver("a relay", BeckhoffRelayOptions, lambda *_, **__: relay)
    return RelayEntry("enable", driver, "somewhere", frozenset({Role.SUPPLY}), BeckhoffRelayOptions())


@pytest.fixture
def guard(entry: RelayEntry, recorder: Recorder) -> tuple[RelayedGuard, Interrupts]:
    interrupts = Interrupts()
    return RelayedGuard(Unguarded(), [FedRelay(entry)], (), recorder, interrupts), interrupts


def until(true: Callable[[], bool]) -> None:
    begun = monotonic()
    while not true():
        assert monotonic() - begun < PATIENCE
        threading.Event().wait(0.01)


def energise(guard: RelayedGuard, role: str = "supply") -> None:
    guard.hear(event("energising", instrument=role))


def test_it_picks_up_for_its_roles_only_once_and_drops_out_at_the_end(
    guard: tuple[RelayedGuard, Interrupts], relay: Relay, recorder: Recorder
) -> None:
    made, _ = guard
    energise(made, "dynamometer")
    made.hear(event("setting", instrument="supply"))
    assert relay.done == []
    energise(made)
    energise(made)
    assert relay.fed.wait(PATIENCE)
    assert made.dismiss(journal_lost=False) == []
    assert relay.commands == ["pick_up", "drop_out", "close"]
    assert recorder.kinds == ["watchdog_relay_picked_up", "watchdog_relay_dropped_out"]
    made.dismiss(journal_lost=False)
    assert relay.commands == ["pick_up", "drop_out", "close", "close"]


def test_a_relay_that_refuses_keeps_its_role_from_being_energised_and_is_opened_all_the_same(
    guard: tuple[RelayedGuard, Interrupts], relay: Relay
) -> None:
    made, _ = guard
    relay.fails["pick_up"] = ReportedError("relay", "output 0 stays off")
    with pytest.raises(ReportedError, match="output 0 stays off"):
        energise(made)
    made.dismiss(journal_lost=False)
    assert relay.commands == ["pick_up", "drop_out", "close"]


def test_one_that_has_dropped_out_ends_the_run_and_is_not_picked_up_again(
    guard: tuple[RelayedGuard, Interrupts], relay: Relay, recorder: Recorder
) -> None:
    made, interrupts = guard
    relay.fails["feed"] = ReportedError("relay", "has dropped out")
    energise(made)
    until(lambda: "watchdog_relay_lost" in recorder.kinds)
    assert str(interrupts.requested_by) == (
        "the watchdog relay enable, which is open or silent: relay: has dropped out"
    )
    with pytest.raises(InstrumentError, match="has dropped out"):
        energise(made)
    made.dismiss(journal_lost=False)
    assert relay.commands.count("pick_up") == 1


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time (s) by which relays are fed, one item, in the test's hands: a busy machine does not move it on."""
    now = [0.0]
    monkeypatch.setattr("bench.safety.watchdog_relays.monotonic", lambda: now[0])
    return now


def test_a_lost_reply_is_passed_over_and_a_silence_of_its_time_is_not(
    guard: tuple[RelayedGuard, Interrupts], relay: Relay, recorder: Recorder, clock: list[float]
) -> None:
    made, interrupts = guard
    energise(made)
    for _ in range(2):
        relay.fails["feed"] = CommunicationError("relay", "no usable reply")
        clock[0] += 0.9 * TIME
        relay.is_fed(1)
        assert not interrupts.requested_by
        del relay.fails["feed"]
        relay.is_fed(1)
    relay.fails["feed"] = CommunicationError("relay", "no usable reply")
    clock[0] += 1.1 * TIME
    until(lambda: "watchdog_relay_lost" in recorder.kinds)
    made.dismiss(journal_lost=False)


@pytest.mark.parametrize(("brakes", "starves"), [((), True), ((Role.SUPPLY,), False)])
def test_a_way_down_that_hangs_is_not_fed_for_long(
    entry: RelayEntry, relay: Relay, recorder: Recorder, brakes: Sequence[Role], starves: bool, clock: list[float]
) -> None:
    made = RelayedGuard(Unguarded(), [FedRelay(entry)], brakes, recorder, Interrupts())
    energise(made)
    made.going_down()
    clock[0] += 1.9
    relay.is_fed(1)
    clock[0] += 0.2
    if starves:
        until(lambda: "watchdog relay enable" not in [thread.name for thread in threading.enumerate()])
    else:
        relay.is_fed(2)
    assert "watchdog_relay_lost" not in recorder.kinds
    made.dismiss(journal_lost=False)


def test_what_is_not_well_at_the_end_is_told(
    guard: tuple[RelayedGuard, Interrupts], relay: Relay, recorder: Recorder
) -> None:
    made, _ = guard
    energise(made)
    relay.fails |= {
        "drop_out": ReportedError("relay", "output 0 stays on"),
        "close": CommunicationError("relay", "no usable reply"),
    }
    assert made.dismiss(journal_lost=False) == ["relay: output 0 stays on", "relay: no usable reply"]
    assert recorder.events[-1][1]["faults"] == ["relay: output 0 stays on", "relay: no usable reply"]


def test_only_those_that_a_run_is_concerned_with_are_opened(entry: RelayEntry, relay: Relay) -> None:
    with relays_ready([entry], {Role.DRIVE}, "bench.toml") as relays:
        guard = Unguarded()
        assert relays.beside(guard, (), Recorder(), Interrupts()) is guard
    assert relay.done == []
    with relays_ready([entry], {Role.SUPPLY}, "bench.toml") as relays:
        assert isinstance(relays.beside(guard, (), Recorder(), Interrupts()), RelayedGuard)
    assert relay.done == ["close"]


def test_one_that_does_not_answer_is_told_of_before_anything_is_touched() -> None:
    (entry,) = station(watchdog_relays={"enable": RELAY | {"address": "tcp://127.0.0.1:9"}}).watchdog_relays
    with (
        pytest.raises(InputError, match=r"bench.toml: watchdog relay enable: cannot be opened at tcp://127.0.0.1:9"),
        relays_ready([entry], {Role.SUPPLY}, "bench.toml"),
    ):
        pass


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (
            {"driver": "beckhof-bk9000"},
            r"watchdog_relays.enable.driver = 'beckhof-bk9000' .*did you mean beckhoff-bk9000",
        ),
        ({"roles": ["dynamometer"]}, r"watchdog_relays.enable.roles: dynamometer is no role of this station .*supply"),
        ({"roles": ["voltmeter"]}, r"voltmeter is no role of this station that feeds energy; allowed are"),
        ({"roles": []}, r"watchdog_relays.enable.roles"),
        ({"roles": ["suply"]}, r"watchdog_relays.enable.roles"),
        ({"watchdog_tim": 1.0}, r"unknown key watchdog_relays.enable.watchdog_tim; did you mean watchdog_time"),
        ({"address": ""}, r"watchdog_relays.enable.address"),
    ],
)
def test_a_table_that_cannot_be(table: Mapping[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        station(watchdog_relays={"enable": {**RELAY, **table}})


def test_two_relays_of_one_coupler_are_refused() -> None:
    with pytest.raises(InputError, match=r"watchdog_relays.b.address: tcp://192.0.2.31:502 is the address of a too"):
        station(watchdog_relays={"a": RELAY, "b": RELAY | {"output": 1}})


def test_what_a_station_file_asks_for_by_role() -> None:
    plain, relayed = station(), station(watchdog_relays={"enable": RELAY})
    assert [str(one.words) for one in planned_watchdogs(plain, set(Role))] == [
        "drive: watchdog of 1 s, then it switches its voltage off (0x1016, 0x6007), where the instrument has one",
        "supply: no watchdog; it stays on if run and guardian end at the same time",
    ]
    assert [str(one.words) for one in planned_watchdogs(relayed, {Role.SUPPLY, Role.VOLTMETER})] == [
        "supply: watchdog relay enable, 1 s, then its contact opens (0x1120, 0x1122)"
    ]
    manual = {"driver": "manual", "maximum_voltage": 5.0, "maximum_current": 1.0}
    by_hand = make_station({"station": {"name": "b"}, "instruments": {"supply": manual}}, "b.toml", b"")
    (one,) = planned_watchdogs(by_hand, set(Role))
    assert (str(one.words), one.missing) == ("supply: set and switched off by hand", False)


def test_what_is_armed_by_role() -> None:
    class Drive:
        watchdog: Watchdog | None = None

    drive: Any = Drive()
    told = armed_watchdogs(station(), {Role.DRIVE: drive}, {Role.SUPPLY: "no answer"})
    assert [(str(one.words), one.missing) for one in told] == [
        ("drive: no watchdog; it stays on if run and guardian end at the same time", True),
        ("supply: could not be opened, so it is not known whether it has a watchdog", True),
    ]
    drive.watchdog = Watchdog(0.5, WhenSilent.AS_SET_UP, "0x1016")
    (one, _) = armed_watchdogs(station(), {Role.DRIVE: drive}, {})
    assert str(one.words) == (
        "drive: watchdog armed, 0.5 s, then it acts as it is configured for a missing heartbeat (0x1016)"
    )
    assert one.as_dict()["armed"] is True
    supply: Any = object()
    both = station(watchdog_relays={"enable": RELAY | {"roles": ["supply", "drive"]}})
    told = armed_watchdogs(both, {Role.DRIVE: drive, Role.SUPPLY: supply}, {})
    assert [(one.role, one.relay) for one in told] == [
        (Role.DRIVE, ""),
        (Role.DRIVE, "enable"),
        (Role.SUPPLY, "enable"),
    ]
    assert replace(told[2], relay="").words != told[2].words
