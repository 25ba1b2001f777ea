"""What the kit says of a driver that does not take over, tell, keep or put back what a last user left, or holds what did not open."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from bench.plugins.catalogues import installed
from bench.safety.shutdown_items import measured
from bench.testing.conformance.driver import subject_of
from bench.testing.conformance.found import check_left
from bench.testing.conformance.guarded import check_guarded
from bench.testing.conformance.manual import Left, Manual, Model
from bench.testing.conformance.models import check_model
from bench.testing.conformance.opening import check_opening
from bench.testing.conformance.recognition import check_recognition
from bench.testing.conformance.report import Checks
from bench.testing.conformance.roles.dq_currents import both_currents_fully
from bench.testing.conformance.session import Trial, session_of
from bench.testing.conformance.watchdogs import check_watchdog
from drivers.bases.found_state import FoundState
from drivers.cia402.found_objects import found_nmt_state
from drivers.delta.c2000_watchdog import CommunicationWatchdog
from drivers.interfaces import IdentityError, ReportedError
from drivers.mjbots.readings import MoteusReadings
from tests.bench.testing.conformance.own_drivers import FOUND, OPTIONS

SUPPLY, DYNAMOMETER = "keysight-e36300", "delta-dyn200"
LIST = Left("VOLT:MODE? (@1)", "VOLT:MODE LIST,(@1)", "LIST", "FIX")
PAIR = Left("OUTP:PAIR?", "OUTP:PAIR SER", error=ReportedError, says="is set to SER")
LIMIT = Left(
    "11-37",
    lambda simulated: simulated.units[1].write(0x0B25, [10]),
    "10",
    "100",
    now=lambda simulated: simulated.units[1].read(0x0B25, 1),
    watched=True,
)


def trial(driver: str, manual: Manual | None = None) -> Trial:
    subject = subject_of(driver, None, OPTIONS[driver], installed(), found=FOUND.get(driver))
    return Trial(subject, session_of(subject.role), Checks(manual=manual or Manual()), seed=0)


def failed(check: Callable[..., None], driver: str, manual: Manual | None = None, *more: Any) -> list[str]:
    one = trial(driver, manual)
    check(one, *more)
    return [finding.check for finding in one.checks.report(driver).failures]


@pytest.mark.parametrize(("driver", "left"), [(SUPPLY, LIST), (SUPPLY, PAIR), (DYNAMOMETER, LIMIT)])
def test_what_is_taken_over_as_stated_passes(driver: str, left: Left) -> None:
    assert failed(check_left, driver, Manual(left=(left,))) == []


@pytest.mark.parametrize(
    ("name", "change", "check"),
    [
        ("settings", property(lambda _: ()), "told"),
        ("give_back", lambda _: None, "put back"),
        ("take_over", lambda *_: None, "set"),
    ],
)
def test_a_driver_that_forgets_a_setting_is_found(
    monkeypatch: pytest.MonkeyPatch, name: str, change: Any, check: str
) -> None:
    monkeypatch.setattr(FoundState, name, change)
    found = failed(check_left, SUPPLY, Manual(left=(LIST,)))
    assert any(one.startswith("left with VOLT:MODE? (@1) = LIST") and one.endswith(check) for one in found), found


def test_a_driver_that_does_not_look_again_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FoundState, "verify", lambda *_: None)
    assert failed(check_left, DYNAMOMETER, Manual(left=(LIMIT,))) == ["left with 11-37 = 10 during use"]


def test_without_a_manual_what_the_simulated_instrument_may_be_left_with_is_put_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert failed(check_left, SUPPLY) == []
    monkeypatch.setattr(FoundState, "give_back", lambda _: None)
    found = failed(check_left, "keysight-34461a")
    assert any(one.startswith("as a last user may leave it (0)") and one.endswith("is put back") for one in found)


def test_what_a_driver_does_not_go_without_is_found() -> None:
    found = failed(check_opening, SUPPLY, Manual(lacks=("OUTP:PAIR",)))
    assert found == ["what it may lack at opening"]
    lacks = (r"OUTP:(PAIR|TRAC)\?", r"(VOLT|CURR):MODE\?", r"VOLT:SENS\?")
    assert failed(check_opening, SUPPLY, Manual(lacks=lacks)) == []


def test_a_connection_that_is_held_of_what_did_not_open_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.transport.visa.opening.ScpiSession.close", lambda _: None)
    found = failed(check_opening, SUPPLY)
    assert any(one.endswith("when opening: nothing is held") for one in found), found


def test_another_instrument_that_is_recognised_is_found() -> None:
    other = "Keysight Technologies,E36312A,MY1,1.0"
    assert failed(check_recognition, SUPPLY, Manual(others=(other,))) == ["recognised: nothing else is"]
    assert failed(check_recognition, DYNAMOMETER) == []


@pytest.mark.parametrize(
    ("driver", "model", "check"),
    [
        (DYNAMOMETER, Model({"^read 1 0000H": b"\0\x07"}, {"drive_code": 6}), "models"),
        (DYNAMOMETER, Model({"^read 1 0000H": None}, error=IdentityError), "not opened with"),
        ("cia402-inverter", Model({"^read 606CH": bytes(4)}, states={"measure_frequency.value": 1.0}), "measure_freq"),
        ("cia402-inverter", Model({"^read 1018H 1": None}, error=ReportedError, says="no such words"), "not opened"),
    ],
)
def test_another_model_that_is_taken_for_what_it_is_not_is_found(driver: str, model: Model, check: str) -> None:
    if check == "models":
        with pytest.raises(ReportedError, match="is set to 7, but 6 is needed"):
            check_model(trial(driver), model)
        return
    assert any(one.startswith(check) for one in failed(check_model, driver, None, model))


def test_a_setting_of_a_watchdog_that_is_not_taken_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.delta.c2000_watchdog.CommunicationWatchdog._read_back", lambda *_: None)
    one = trial(DYNAMOMETER)
    watched = one.having(watchdog_time=2.0)
    check_watchdog(watched, "watched", one)
    assert [finding.check for finding in one.checks.report("it").failures] == ["watched: not taken"]


def test_a_watchdog_that_stays_armed_where_opening_fails_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    one = trial(DYNAMOMETER)
    check_watchdog(one.having(watchdog_time=2.0), "watched", one)
    assert one.checks.report("it").failures == ()
    disarm = CommunicationWatchdog.disarm
    monkeypatch.setattr(CommunicationWatchdog, "disarm", lambda watch: disarm(watch) if watch.armed else None)
    check_watchdog(one.having(watchdog_time=2.0), "watched", one)
    (finding,) = (each for each in one.checks.report("it").failures if each.check.endswith("where opening fails"))
    assert "'read 1 0902H 1' having been refused" in finding.wrong


def test_what_is_not_put_back_where_opening_fails_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FoundState, "take_over", lambda state, rows: [state._take_over(row) for row in rows])
    left = (Left("TRIG:SOUR?", "TRIG:SOUR HOLD", "HOLD", "BUS"),)
    assert failed(check_left, "keysight-e4980a", Manual(left=left)) == ["put back where opening fails"]


@pytest.mark.slow
def test_what_a_moteus_may_lack_is_held_to_its_manual() -> None:
    lacks = ("conf get servo.fw",)
    assert failed(check_opening, "mjbots-moteus", Manual(lacks=lacks)) == ["what it may lack at opening"]


@pytest.mark.parametrize("driver", ["cia402-six-step", "cia402-inverter", SUPPLY])
def test_a_guardian_measures_what_the_shutdown_waits_for(monkeypatch: pytest.MonkeyPatch, driver: str) -> None:
    assert failed(check_guarded, driver) == []
    monkeypatch.setattr("bench.testing.conformance.guarded.measured", wrong_for_every_second(measured))
    found = failed(check_guarded, driver)
    assert found
    assert all(one.endswith("by a second connection") for one in found)


def wrong_for_every_second(measure: Callable[..., Any]) -> Callable[..., Any]:
    calls = iter(range(100))

    def measured_wrongly(*given: Any) -> Any:
        found = measure(*given)
        return replace(found, value=1000.0 * found.value + 1.0) if next(calls) % 3 == 1 else found

    return measured_wrongly


def test_a_rotor_that_turns_shows_a_wrong_scale_of_speed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(MoteusReadings, "frequency", lambda *_: 1.0)
    one = trial("mjbots-moteus")
    with one.opened() as (made, instrument):
        both_currents_fully(made, instrument, one.checks)
    found = [finding.check for finding in one.checks.report("it").failures]
    assert {"turned: electrical speed", "turned: frequency"} <= set(found)


def test_a_row_that_tells_a_change_that_was_none_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def told(state: Any) -> Any:
        row = found_nmt_state(state)
        return replace(row, changed=not row.changed)

    monkeypatch.setattr("drivers.cia402.node.found_nmt_state", told)
    subject = subject_of("cia402-inverter", None, OPTIONS["cia402-inverter"], installed())
    checks = Checks()
    check_left(Trial(subject, session_of(subject.role), checks, seed=0))
    failed = [one for one in checks.report("inverter").failures if "changed is what was another" in one.check]
    assert failed
    assert all("NMT state: " in one.wrong for one in failed)
