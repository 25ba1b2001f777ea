from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bench.journal.codec import RecordedEvent
from bench.journal.events.instruments import Energising
from bench.journal.events.run import RunFinished
from bench.journal.events.safety import MadeSafe, ShutdownStarted
from bench.journal.stored_result import store_text
from bench.panel.bench_state import StateKind, bench_state, state_at_end
from bench.panel.live.live_run import LiveRun
from drivers.interfaces.text import text
from procedures.core.events import Event

READ_AT = 100.0
CONFIRM = {"id": 1, "kind": "action", "action": "Connect"}
SUPPLY_OFF = {"role": "supply", "found": "off", "feeds": True, "values": [[0.002, "V"], [0.0, "A"]], "error": None}
SHAFT_AT_REST = {"role": "dynamometer", "found": "off", "feeds": True, "values": [[0.0, "rad/s"]], "error": None}


@pytest.fixture
def run(tmp_path: Path) -> LiveRun:
    made = LiveRun(tmp_path)
    made.line.question = CONFIRM
    made.line.sources_at = READ_AT
    return made


def energise(run: LiveRun, role: str = "supply") -> None:
    run.view.energised[role] = 0.0


def source(found: str, *values: tuple[float, str], role: str = "supply", error: str = "") -> Mapping[str, Any]:
    stored = store_text(text("{error}", error=error)) if error else None
    return {"role": role, "found": found, "feeds": True, "values": [list(value) for value in values], "error": stored}


def test_leads_may_be_touched_only_within_a_second_of_everything_reading_zero(run: LiveRun) -> None:
    run.line.sources = [SUPPLY_OFF, SHAFT_AT_REST]
    fresh = bench_state(run, READ_AT + 0.9)
    assert fresh.kind is StateKind.OFF
    assert str(fresh.headline) == "Outputs off. You may touch the leads."
    assert str(fresh.detail) == "Read back 0.9 s ago: DC supply 0.00\u00a0V, 0.00\u00a0A, Dynamometer 0\u00a0rpm"
    assert fresh.waits is None
    assert bench_state(run, READ_AT + 1.1).kind is not StateKind.OFF
    old = bench_state(run, READ_AT + 2.1)
    assert old.kind is StateKind.UNKNOWN
    assert old.waits is not None


def test_a_shaft_whose_speed_nobody_measures_is_not_said_to_be_safe(run: LiveRun) -> None:
    run.line.sources = [SUPPLY_OFF]
    state = bench_state(run, READ_AT)
    assert state.kind is StateKind.OFF
    assert "touch" not in str(state.headline)
    assert "Speed not measured" in str(state.detail)


def test_a_source_that_does_not_answer_is_unknown_and_named(run: LiveRun) -> None:
    run.line.sources = [source("silent", error="no answer within 2 s"), SHAFT_AT_REST]
    state = bench_state(run, READ_AT)
    assert state.kind is StateKind.UNKNOWN
    assert "DC supply does not answer: no answer within 2 s" in str(state.detail)
    assert state.waits is not None


def test_nothing_read_back_yet_is_unknown(tmp_path: Path) -> None:
    run = LiveRun(tmp_path)
    run.line.question = CONFIRM
    assert bench_state(run).kind is StateKind.UNKNOWN


def test_what_reads_as_on_is_on_whatever_the_journal_says(run: LiveRun) -> None:
    run.line.sources = [SUPPLY_OFF, source("on", (52.4, "rad/s"), role="dynamometer")]
    state = bench_state(run, READ_AT)
    assert state.kind is StateKind.ON
    assert "Dynamometer 500\u00a0rpm" in str(state.headline)
    assert state.waits is not None


@pytest.mark.parametrize(
    ("at_shaft", "volts", "may_confirm"),
    [(True, 0.3, True), (True, 61.0, False), (False, 0.3, False)],
)
def test_hands_work_at_an_energised_motor_only_at_the_shaft_and_below_60_v(
    run: LiveRun, at_shaft: bool, volts: float, may_confirm: bool
) -> None:
    run.line.question = CONFIRM | {"at_shaft": at_shaft}
    run.line.sources = [source("on", (volts, "V"), (2.9, "A"))]
    energise(run)
    state = bench_state(run, READ_AT)
    assert state.kind is StateKind.ON
    assert (state.waits is None) is may_confirm
    assert "2.90\u00a0A" in str(state.headline) + str(state.detail)


def test_what_was_read_back_before_it_was_switched_on_is_not_said_of_it(run: LiveRun) -> None:
    run.line.sources = [SUPPLY_OFF]
    energise(run)
    assert str(bench_state(run, READ_AT + 0.1).headline) == "Energised: DC supply. Do not touch."


def test_what_the_measurement_does_is_told_with_its_age_and_never_as_safe(run: LiveRun) -> None:
    run.line.question = None
    run.line.sources = [SUPPLY_OFF, SHAFT_AT_REST]
    assert bench_state(run, READ_AT + 0.1).kind is StateKind.UNREAD
    late = bench_state(run, READ_AT + 8.0)
    assert late.kind is StateKind.UNKNOWN
    assert "not read back for 8 s" in str(late.detail)


@pytest.mark.parametrize("sources", [[], [source("by_hand")], [source("unreadable")]])
def test_what_cannot_be_read_back_is_left_to_the_person(run: LiveRun, sources: list[Mapping[str, Any]]) -> None:
    run.line.sources = sources
    state = bench_state(run, READ_AT)
    assert state.kind is StateKind.UNREAD
    assert state.waits is None
    assert "yourself" in f"{state.headline} {state.detail}"


def test_an_abort_stands_until_each_source_has_read_back_as_off(run: LiveRun) -> None:
    view = run.view
    for event in (
        Energising(instrument="supply", call="energised"),
        ShutdownStarted(cause="J. Doe at the panel"),
        MadeSafe(instrument="dynamometer", item="speed_zero", outcome="safe", value=0.0, unit="rad/s"),
    ):
        view.take(RecordedEvent(1, "", 0.0, event))
    state = bench_state(run, READ_AT)
    assert state.kind is StateKind.ABORTING
    assert str(state.detail) == "DC supply: being switched off …, Dynamometer: off ✓"
    failed = MadeSafe(instrument="supply", item="voltage_decayed", outcome="failed", error="the voltage is 12 V")
    view.take(RecordedEvent(1, "", 0.0, failed))
    assert "DC supply: not proved off" in str(bench_state(run, READ_AT).detail)


def test_a_hand_that_turns_the_shaft_is_not_told_to_keep_off(run: LiveRun) -> None:
    run.line.question, run.line.sources = None, []
    assert str(bench_state(run).headline) == "Measuring. Keep your hands off."
    run.view.layout = replace(run.view.layout, shaft_turned=True)
    assert str(bench_state(run).headline) == "Measuring. Hands at the shaft only, touch no lead."
    run.line.sources = [source("off", (0.0, "V"))]
    assert "Keep your hands off" not in str(bench_state(run, READ_AT + 1.0).headline)
    assert "Do not touch" not in str(bench_state(run, READ_AT + 3.0).headline)


def test_what_only_a_person_can_switch_off_can_be_confirmed_on_the_way_down(run: LiveRun) -> None:
    run.abort_asked_at = READ_AT
    assert bench_state(run, READ_AT).waits is not None
    run.line.question = {"id": 2, "kind": "confirm", "instrument": "supply"}
    state = bench_state(run, READ_AT)
    assert (state.kind, state.waits) == (StateKind.ABORTING, None)
    assert "by hand" in str(state.headline)


OFF = MadeSafe(instrument="supply", item="supply_off", outcome="safe")
AT_ZERO = MadeSafe(instrument="supply", item="voltage_decayed", outcome="safe", value=0.01, unit="V")


@pytest.mark.parametrize(
    ("events", "kind", "words"),
    [
        ([OFF, AT_ZERO], StateKind.OFF, "Outputs were off at its end."),
        ([OFF], StateKind.UNREAD, "Switched off, not read back: DC supply"),
        ([], StateKind.UNREAD, "It switched nothing on."),
        ([Energising(instrument="supply", call="energised")], StateKind.UNKNOWN, "Outputs not proved off"),
        ([replace(AT_ZERO, outcome="failed", error="12 V")], StateKind.UNKNOWN, "Outputs not proved off"),
    ],
)
def test_only_what_was_read_back_at_a_runs_end_is_said_to_have_been_off(
    run: LiveRun, events: list[Event], kind: StateKind, words: str
) -> None:
    for event in (*events, RunFinished(status="completed", bench_time=1.0, wall_time=1.0)):
        run.view.take(RecordedEvent(1, "", 0.0, event))
    found, told = state_at_end(run.view)
    assert found is kind
    assert words in str(told)
