"""What a guardian makes of what it hears, without instruments and without a run."""

import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bench.journal.guardian_record import GuardianRecord, read_guardian
from bench.station.shutdown_sequence import Item, ShutdownAction, item
from procedures.core.bench import Role
from tests.bench.safety.guardian.watched import DECAYED, DISABLE, OFF, ZERO, Clock, Starved, Watched


@pytest.fixture
def watched() -> Iterator[type[Watched]]:
    made: list[Watched] = []

    class Kept(Watched):
        def __init__(self, *items: Item, **options: Any) -> None:
            made.append(self)
            super().__init__(*items, **options)

    yield Kept
    for one in made:
        one.close()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """The watch's clock in the hands of the test: what must happen in time happens in time on a loaded machine, too."""
    made = Clock()
    monkeypatch.setattr("bench.safety.guardian.watch.monotonic", made)
    return made


def test_a_run_that_is_done_needs_nothing(watched: type[Watched]) -> None:
    one = watched()
    one.tell(beat=1, age=0.1)
    assert one.await_said("echo") == 1
    one.tell(done=True, journal=True)
    assert one.ended() == []
    assert one.instruments.done == []


def test_a_run_that_died(watched: type[Watched]) -> None:
    one = watched()
    os.close(one.outgoing)
    assert one.ended() == ["the run's process has died"]
    assert one.instruments.done == [ShutdownAction.OUTPUT_OFF, ShutdownAction.VOLTAGE_DECAYED]
    measured = next(data for kind, data in one.journal.events if kind == "measured")
    assert (measured["value"], measured["unit"], measured["outcome"]) == (0.1, "V", "safe")


def test_a_silent_run_is_kept_off_until_it_says_that_it_is_awake(watched: type[Watched]) -> None:
    one = watched(heartbeat=0.2)
    assert one.await_said("took") == "no heartbeat for 0.2 s"
    one.until(lambda: one.instruments.done.count(ShutdownAction.OUTPUT_OFF) >= 3)
    one.tell(beat=7, age=0.0)
    one.until(lambda: len(one.all_said("took")) >= 2)
    one.tell({"awake": True}, {"down": True}, {"done": True, "journal": True})
    assert one.ended() == ["no heartbeat for 0.2 s"]


def test_a_run_that_got_no_processor_is_given_the_same_time_once_more_and_no_longer(watched: type[Watched]) -> None:
    begun = time.monotonic()
    one = watched(heartbeat=0.4, queue=Starved(os.getpid()))
    assert one.await_said("took") == "no heartbeat for 0.4 s"
    assert time.monotonic() - begun >= 0.8
    os.close(one.outgoing)
    one.ended()


@pytest.mark.parametrize("late", [0.012, 0.03])
def test_a_guardian_that_wakes_up_a_little_late_asks_how_long_the_run_had_no_processor(
    watched: type[Watched], clock: Clock, late: float
) -> None:
    one = watched(heartbeat=0.4, queue=Starved(os.getpid()))
    for _ in range(9):
        clock.move_on(0.042)
    clock.move_on(0.4 - 9 * 0.042 + late)
    clock.move_on(0.3)
    assert not one.all_said("took")
    clock.move_on(0.3)
    clock.move_on(0.06)
    assert one.await_said("took") == "no heartbeat for 0.4 s"
    os.close(one.outgoing)
    one.ended()


def test_a_run_that_does_not_get_on(watched: type[Watched]) -> None:
    one = watched(stalled=5.0)
    one.tell(beat=1, age=4.9)
    one.tell(beat=2, age=5.1)
    assert one.await_said("took") == "the run has not got on for 5.1 s"
    os.close(one.outgoing)
    one.ended()


def test_a_block_that_is_not_off_in_time_is_helped_and_the_run_goes_on(watched: type[Watched], clock: Clock) -> None:
    one = watched()
    one.tell(on=["supply"])
    one.tell(ending="supply")
    clock.move_on(0.39)
    assert one.instruments.done == []
    clock.move_on(0.02)
    one.await_done(ShutdownAction.OUTPUT_OFF)
    one.tell(beat=3, age=0.0)
    assert one.await_said("echo") == 3
    one.tell(down=True)
    one.tell(done=True, journal=True)
    assert one.ended() == ["what was energised is not off 0.4 s after an error"]
    assert not any("took" in message for message in one.said)


def test_a_lost_journal_has_its_outcomes_here(watched: type[Watched]) -> None:
    one = watched()
    one.tell(done=True, journal=False)
    assert one.ended() == ["the run's journal cannot be written"]
    assert one.instruments.done == [ShutdownAction.OUTPUT_OFF, ShutdownAction.VOLTAGE_DECAYED]


@pytest.mark.parametrize("answers", [True, False])
def test_an_alarm_is_the_runs_own_business_unless_it_does_nothing(
    watched: type[Watched], clock: Clock, answers: bool
) -> None:
    one = watched()
    one.watch.alarm("the door, which is open")
    assert one.await_said("alarm") == "the door, which is open"
    if answers:
        one.tell(down=True)
        one.tell(done=True, journal=True)
        assert one.ended() == []
    else:
        one.tell(ended="supply")
        clock.move_on(0.41)
        assert one.await_said("took") == "the door, which is open"
        os.close(one.outgoing)
        one.ended()


@pytest.mark.parametrize("begins", [True, False])
def test_a_requested_stop_is_the_runs_own_business_unless_it_does_not_begin(
    watched: type[Watched], clock: Clock, begins: bool
) -> None:
    one = watched()
    one.tell(stop="Ctrl-C")
    # Neither signs of life nor the end of a single block are the shutdown.
    one.tell(beat=1, age=0.0)
    one.tell(ended="supply")
    if begins:
        one.tell(down=True)
        one.tell(done=True, journal=True)
        assert one.ended() == []
    else:
        took = "the run has not begun its shutdown 0.5 s after it was requested by Ctrl-C"
        clock.move_on(0.51)
        assert one.await_said("took") == took
        os.close(one.outgoing)
        assert one.ended() == [took]


def test_a_source_that_does_not_answer_is_switched_off_at_once_and_the_run_goes_on(watched: type[Watched]) -> None:
    one = watched()
    one.tell(unanswered="the supply, which is energised and has not answered for 0.7 s", role="supply")
    one.await_done(ShutdownAction.OUTPUT_OFF)
    one.tell(down=True)
    one.tell(done=True, journal=True)
    assert one.ended() == ["the supply, which is energised and has not answered for 0.7 s"]
    assert not any("took" in message for message in one.said)


def test_a_disk_that_hangs_keeps_nothing_on(
    watched: type[Watched], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers = threading.Event()
    sync = os.fdatasync
    monkeypatch.setattr(os, "fdatasync", lambda file: (answers.wait(30.0), sync(file)))
    record = GuardianRecord(tmp_path)
    one = watched(record=record)
    one.tell(unanswered="the supply, which is energised and has not answered for 0.7 s", role="supply")
    one.await_done(ShutdownAction.OUTPUT_OFF)
    assert [event.kind for event in read_guardian(tmp_path)] in ([], ["took"])
    answers.set()
    one.tell(down=True)
    one.tell(done=True, journal=True)
    one.thread.join(20.0)
    assert record.close()
    assert read_guardian(tmp_path)[0].kind == "took"


@pytest.mark.parametrize("off", [True, False])
def test_a_shutdown_that_does_not_switch_everything_off_in_time_is_helped(
    watched: type[Watched], clock: Clock, off: bool
) -> None:
    one = watched()
    one.tell(on=["supply"])
    one.tell(down=True)
    if off:
        one.tell(on=[])
        clock.move_on(0.41)
    else:
        clock.move_on(0.41)
        one.await_done(ShutdownAction.OUTPUT_OFF)
    one.tell(done=True, journal=True, unsafe=not off)
    took = [] if off else ["the run's shutdown has not switched everything off within 0.4 s"]
    assert one.ended() == [*took, *([] if off else ["the run could not switch everything off"])]
    assert [message["walked"] for message in one.said if "walked" in message] == [[]] * (0 if off else 3)


def test_a_run_hears_that_it_is_off_only_where_that_was_measured(watched: type[Watched]) -> None:
    one = watched(OFF, item(ShutdownAction.CURRENT_ZERO, Role.SUPPLY, within=0.3))
    one.instruments.still = "the current is 7.25 A"
    one.tell(on=["supply"])
    one.tell(done=True, journal=True, unsafe=True)
    assert one.ended() == ["the run could not switch everything off"]
    said = [message["walked"] for message in one.said if "walked" in message]
    assert said[0] == [], "the supply says that it is off"
    (words,) = said[-1]
    assert "the current is 7.25 A" in words


def test_a_run_that_waits_is_not_kept_by_an_instrument_that_is_mute_to_the_guardian_too(watched: type[Watched]) -> None:
    one = watched(
        OFF,
        *(item(do, Role.SUPPLY, within=0.3) for do in (ShutdownAction.VOLTAGE_DECAYED, ShutdownAction.CURRENT_ZERO)),
    )
    one.instruments.still = "does not answer"
    one.tell(on=["supply"])
    one.tell(done=True, journal=True, unsafe=True)
    one.ended()
    assert max(one.instruments.allowed) <= 0.3
    assert ShutdownAction.CURRENT_ZERO in one.instruments.done


def test_the_end_of_an_inner_block_gives_the_outer_ones_no_more_time(watched: type[Watched], clock: Clock) -> None:
    one = watched(DISABLE, OFF)
    one.tell(on=["inverter", "supply"])
    one.tell(ending="inverter")
    clock.move_on(0.3)
    one.tell(on=["supply"])
    one.tell(ended="inverter")
    one.tell(ending="supply")
    clock.move_on(0.09)
    assert one.instruments.done == []
    clock.move_on(0.02)
    one.await_done(ShutdownAction.OUTPUT_OFF)
    one.tell(done=True, journal=True)
    one.ended()


def test_an_outer_block_whose_procedure_has_handled_the_error_is_left_alone(
    watched: type[Watched], clock: Clock
) -> None:
    one = watched(DISABLE, OFF)
    one.tell(on=["inverter", "supply"])
    one.tell(ending="inverter")
    one.tell(on=["supply"])
    one.tell(ended="inverter")
    clock.move_on(0.5)
    # Nor does a later error find the time of the first one over.
    one.tell(handled=True)
    one.tell(ending="supply")
    clock.move_on(0.3)
    one.tell(on=[])
    one.tell(ended="supply")
    one.tell(down=True)
    one.tell(done=True, journal=True)
    assert one.ended() == []
    assert one.instruments.done == []


def test_a_block_whose_end_failed_is_not_forgotten_over_the_next(watched: type[Watched], clock: Clock) -> None:
    one = watched(DISABLE, OFF)
    one.tell(on=["inverter", "supply"])
    one.tell(ending="inverter")
    one.tell(ending="supply")
    one.tell(on=["inverter"])
    one.tell(ended="supply")
    one.tell(handled=True)
    clock.move_on(0.41)
    one.await_done(ShutdownAction.DISABLE)
    one.tell(done=True, journal=True)
    assert one.ended() == ["what was energised is not off 0.4 s after an error"]
    assert one.instruments.done == [ShutdownAction.DISABLE]


@pytest.mark.parametrize("by_itself", [True, False])
def test_a_run_is_helped_with_the_silent_role_first_and_has_time_for_the_others(
    watched: type[Watched], clock: Clock, by_itself: bool
) -> None:
    one = watched(ZERO, DISABLE, OFF, DECAYED)
    one.tell(on=["inverter", "supply"])
    one.tell(unanswered="the supply, which …", role="supply")
    one.await_done(ShutdownAction.OUTPUT_OFF)
    one.tell(ending="inverter")
    one.tell(beat=1, age=0.0)
    # It is heard meanwhile.
    assert one.await_said("echo") == 1
    if by_itself:
        one.tell(on=["supply"])
        one.tell(ended="inverter")
    else:
        clock.now += 0.19
        clock.heard()
        assert one.instruments.done == [ShutdownAction.OUTPUT_OFF]
        clock.now += 0.02
    one.await_said("walked")
    one.tell(on=[])
    one.tell(down=True)
    one.tell(done=True, journal=True)
    assert one.ended() == ["the supply, which …"]
    assert one.instruments.done == [
        ShutdownAction.OUTPUT_OFF,
        *([] if by_itself else [ShutdownAction.COMMAND_ZERO, ShutdownAction.DISABLE]),
    ]


def test_a_run_that_dies_while_it_is_helped_leaves_the_rest_to_the_guardian(watched: type[Watched]) -> None:
    one = watched(DISABLE, OFF)
    one.tell(on=["inverter", "supply"])
    one.tell(unanswered="the supply, which …", role="supply")
    one.await_done(ShutdownAction.OUTPUT_OFF)
    os.close(one.outgoing)
    assert one.ended() == ["the supply, which …", "the run's process has died"]
    assert set(one.instruments.commanded) == {Role.INVERTER, Role.SUPPLY}


def test_an_instrument_that_is_still_stuck_is_tried_again_for_a_run_that_could_not_switch_it_off(
    watched: type[Watched],
) -> None:
    one = watched()
    one.instruments.busy = {Role.SUPPLY}
    one.tell(on=["supply"])
    one.tell(unanswered="the supply, which …", role="supply")
    one.await_said("walked")
    assert one.instruments.done == []
    one.tell(down=True)
    one.tell(done=True, journal=True, unsafe=True)
    assert one.ended()[-1] == "the run could not switch everything off"
    assert ShutdownAction.OUTPUT_OFF in one.instruments.done
