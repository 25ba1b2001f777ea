"""Calls to instruments: refused after a request to stop, impatient with an energised source, reported when unanswered."""

import threading
from contextlib import suppress
from time import monotonic
from typing import Any

import pytest

from bench.safety.calls import CallWatch, CallWatches
from bench.safety.interrupts import Interrupted, Interrupts
from bench.station.clock import SystemClock
from drivers.bases.always import always
from drivers.catalogue import Surroundings
from drivers.interfaces import CommunicationError
from drivers.transport.visa.opening import open_session
from procedures.core.bench import Role
from tests.journals import event

ADDRESS = "TCPIP0::thing::inst0::INSTR"
REPLY_TIME = 0.4
ENERGISING = {"instrument": "supply", "call": "energised"}


@pytest.fixture
def interrupts() -> Any:
    made = Interrupts()
    with suppress(Interrupted), made.raising():
        yield made


@pytest.fixture
def watches(interrupts: Interrupts) -> CallWatches:
    return CallWatches(
        interrupts, {Role.SUPPLY: REPLY_TIME, Role.VOLTMETER: REPLY_TIME, Role.ROTOR_ACTUATOR: REPLY_TIME}
    )


@pytest.fixture
def wire(manager: Any, connect: Any, settings_class: Any) -> Any:
    return connect(ADDRESS, settings_class("Maker,Model,1,2", {"A?": "1.5"}))


def test_nothing_is_sent_after_a_request_but_what_switches_off(
    interrupts: Interrupts, watches: CallWatches, manager: Any, wire: Any
) -> None:
    session = open_session(
        ADDRESS, Surroundings(SystemClock(), lambda: manager, calls=watches.of(Role.SUPPLY)), "supply"
    )
    session.identity_line()
    interrupts.request("the door")
    wire.sent.clear()
    with pytest.raises(Interrupted), always(lambda: session.write("OUTP OFF"), session.calls):
        session.write("OUTP ON")
    assert wire.sent == ["OUTP OFF", "SYST:ERR?"]
    for call in (lambda: session.send("INIT"), lambda: session.query("A?"), lambda: session.query_block("B?")):
        with pytest.raises(Interrupted):
            call()
    assert wire.sent == ["OUTP OFF", "SYST:ERR?"]
    # The threads of the shutdown are not the run's.
    others = threading.Thread(target=session.write, args=("OUTP OFF",))
    others.start()
    others.join()
    assert wire.sent[2:] == ["OUTP OFF", "SYST:ERR?"]
    session.close()


def test_an_energised_source_has_its_own_time_for_an_answer(watches: CallWatches, manager: Any, wire: Any) -> None:
    watch = watches.of(Role.SUPPLY)
    session = open_session(ADDRESS, Surroundings(SystemClock(), lambda: manager, calls=watch), "supply", timeout=10.0)
    session.identity_line()
    wire.lost["A?"] = 1
    watches.hear(event("energising", **ENERGISING))
    begun = monotonic()
    assert session.query_number("A?") == 1.5
    assert monotonic() - begun < 10.0
    assert (watch.since, watches.unanswered()) == (0.0, None)
    wire.lost.update({"A?": 9, "*IDN?": 9})
    begun = monotonic()
    with pytest.raises(CommunicationError):
        session.query_number("A?")
    assert monotonic() - begun < 5.0
    # Who waits on asks again and again; it is the first call that counts.
    since = watch.since
    with pytest.raises(CommunicationError):
        session.query_number("A?")
    assert watch.since == since
    while monotonic() < since + REPLY_TIME:
        threading.Event().wait(0.01)
    assert watches.unanswered() is watch
    watches.hear(event("made_safe", instrument="supply", item="output_off", outcome="safe"))
    assert watches.unanswered() is None
    session.close()


def test_an_answer_to_what_switches_off_does_not_hide_the_call_that_failed(
    interrupts: Interrupts, watches: CallWatches
) -> None:
    watch = watches.of(Role.SUPPLY)
    watches.hear(event("energising", **ENERGISING))
    with suppress(CommunicationError), watch.exchange():
        since = watch.since
        raise CommunicationError("supply", "no reply")
    assert watches.silent() == {Role.SUPPLY}
    with watch.making_safe(), watch.exchange():
        pass
    assert (watch.since, watch.unanswered_since, watches.silent()) == (0.0, since, {Role.SUPPLY})
    assert watches.energised == {"supply"}
    with watch.exchange():
        pass
    assert (watch.unanswered_since, watches.silent()) == (0.0, set())
    # A call that was broken off by a request to stop says nothing about the instrument.
    interrupts.request("the door")
    with suppress(Interrupted), watch.exchange():
        pass
    assert watches.silent() == set()


def test_what_feeds_nothing_has_all_its_time(watches: CallWatches) -> None:
    for role in (Role.SUPPLY, Role.VOLTMETER):
        watches.hear(event("reading", instrument=role.value, call="measure_voltage"))
        assert watches.of(role).patience is None
    watches.hear(event("energising", instrument="voltmeter", call="energised"))
    assert watches.of(Role.VOLTMETER).patience is None


@pytest.mark.parametrize(
    ("role", "events", "energised"),
    [
        (Role.SUPPLY, [("energising", "energised")], True),
        (Role.SUPPLY, [("energising", "energised"), ("de_energised", "energised")], False),
        (Role.SUPPLY, [("energising", "energised")] * 2 + [("de_energised", "energised")], True),
        (Role.SUPPLY, [("commanding", "configure")], False),
        (Role.ROTOR_ACTUATOR, [("commanding", "turn"), ("setting", "turn")], True),
        (Role.ROTOR_ACTUATOR, [("commanding", "turn"), ("setting", "turn"), ("setting", "stop")], False),
        (Role.ROTOR_ACTUATOR, [("commanding", "move_by")], True),
        (Role.ROTOR_ACTUATOR, [("commanding", "move_by"), ("setting", "move_by")], False),
    ],
)
def test_what_is_energised_is_known_from_the_journal(
    watches: CallWatches, role: Role, events: list[tuple[str, str]], energised: bool
) -> None:
    for kind, call in events:
        watches.hear(event(kind, instrument=role.value, call=call))
    assert (watches.of(role).patience is not None) is energised


def test_a_block_that_did_not_end_well_stays_energised(watches: CallWatches) -> None:
    watches.hear(event("energising", **ENERGISING))
    watches.hear(event("de_energised", **{**ENERGISING, "error": "CommunicationError: no reply"}))
    assert watches.of(Role.SUPPLY).patience is not None


def test_an_answer_within_another_exchange_is_a_sign_of_life(interrupts: Interrupts) -> None:
    watch = CallWatch(Role.SUPPLY, interrupts, REPLY_TIME, interruptible=True)
    with watch.exchange():
        first = watch.since
        threading.Event().wait(0.01)
        with watch.exchange():
            pass
        assert watch.since > first
    assert watch.since == 0.0
