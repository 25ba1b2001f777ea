"""Every process of the bench killed at once: what has a watchdog goes off by itself within its time, over real sockets."""

import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from bench.cli.run import run as motorbench_run
from bench.cli.station.check import check
from tests.studies.energised.held import PATIENCE, Served
from tests.studies.energised.held_driver import hold_driver
from tests.studies.forked import Forked

#: What a loaded machine may add to a watchdog's time (s).
SOON = 5.0


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    made = Served(tmp_path_factory.mktemp("relayed"), "--watchdog-relay")
    yield made
    made.end()


@pytest.fixture(scope="module")
def fixture_bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    made = Served(tmp_path_factory.mktemp("fixture"), "--fixture", motor="92bl-30-25l", speedup=1.0, wired=False)
    made.world.uncouple_dynamometer()
    made.world.connect({"A": "drive_1", "B": "drive_2", "C": "drive_3"})
    yield made
    made.end()


def seconds_until(served: Served, off: Callable[[dict[str, Any]], bool]) -> float:
    begun = time.monotonic()
    while not off(served.world.truth()):
        assert time.monotonic() - begun < PATIENCE
        served.world.clock.sleep(0.05)
    return time.monotonic() - begun


def test_run_and_guardian_killed_together(hold: Callable[..., Any], served: Any) -> None:
    served.wire()
    run = hold("wait")
    guardian = run.guardian_pid
    for number in (signal.SIGSTOP, signal.SIGKILL):
        # Stopped first, neither sees the other's end.
        run.signal(number)
        os.kill(guardian, number)
    still = served.world.truth()
    assert [still[key] for key in ("output_on", "inverter_enabled", "dynamometer_enabled")] == [True, True, True]
    took = seconds_until(served, lambda truth: not truth["energised"])
    assert took < 3.0 + SOON
    assert [event.kind for event in run.guardian] == ["started", "ready"]
    (begin,) = (event.data for event in run.journal if event.kind == "run_started")
    assert begin["guardian"]["said"].startswith("the guardian has ")
    told = {one["role"]: (one["watchdog"]["time"], one["relay"]) for one in begin["watchdogs"]}
    assert told == {"inverter": (3.0, None), "dynamometer": (3.0, None), "supply": (3.0, "supply_enable")}
    opened = {
        event.data["instrument"]: event.data["watchdog"] for event in run.journal if event.kind == "instrument_opened"
    }
    assert opened["inverter"] == {"time": 3.0, "action": "switches its voltage off", "setting": "0x1016, 0x6007"}
    assert opened["dynamometer"] == {"time": 3.0, "action": "coasts to a stop", "setting": "09-02, 09-03"}
    assert opened["supply"] is None


def test_the_next_run_picks_the_relay_up_again_and_drops_it_out_at_its_end(served: Any, tmp_path: Path) -> None:
    assert motorbench_run("pole-pairs-static", station=str(served.station), motor="lg-400w", runs=tmp_path) == 0
    events = [json.loads(line) for line in next(tmp_path.glob("*/journal.jsonl")).read_text().splitlines()]
    kinds = [event["kind"] for event in events]
    first = kinds.index("watchdog_relay_picked_up")
    assert kinds.index("energising") < first < kinds.index("energised")
    assert events[first]["data"] == {"relay": "supply_enable", "time": 3.0, "setting": "0x1120, 0x1122"}
    assert kinds[-2:] == ["watchdog_relay_dropped_out", "run_finished"]
    assert events[-2]["data"] == {"relay": "supply_enable", "faults": []}


def test_a_relay_that_is_lost_ends_the_run(hold: Callable[..., Any], served: Any) -> None:
    served.wire()
    run = hold("wait")
    # Frozen for longer than the relay waits, while the guardian keeps everything off.
    run.signal(signal.SIGSTOP)
    assert seconds_until(served, lambda truth: not truth["energised"]) < SOON
    served.world.clock.sleep(4.0 * served.told["speedup"])
    run.signal(signal.SIGCONT)
    told = run.ended()
    assert told["status"] == "aborted"
    lost = [event.data for event in run.journal if event.kind == "watchdog_relay_lost"]
    assert [one["relay"] for one in lost] == ["supply_enable"]
    assert "has dropped out" in lost[0]["error"]
    # A run that was frozen has missed the door's frames, too, and may take it for silent.
    served.reset("Li Wei")


def test_station_check_says_what_is_armed(served: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert check(served.station, language="en") == 0
    said = capsys.readouterr().out
    for line in (
        "✓ inverter: watchdog armed, 3 s, then it switches its voltage off (0x1016, 0x6007)",
        "✓ dynamometer: watchdog armed, 3 s, then it coasts to a stop (09-02, 09-03)",
        "✓ supply: watchdog relay supply_enable, 3 s, then its contact opens (0x1120, 0x1122)",
    ):
        assert line in said
    assert check(served.station, json=True) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["watchdog_relays"]["supply_enable"]["picked_up"] is False
    assert [one["armed"] for one in told["watchdogs"]] == [True, True, False]


@pytest.mark.parametrize(
    ("role", "on", "off"),
    [
        ("drive", lambda truth: truth["six_step_enabled"], lambda truth: not truth["six_step_enabled"]),
        ("rotor_actuator", lambda truth: truth["shaft_speed"] > 1.0, lambda truth: abs(truth["shaft_speed"]) < 0.1),
    ],
)
def test_a_driver_killed_without_any_guardian(
    fixture_bench: Served, role: str, on: Callable[..., bool], off: Callable[..., bool]
) -> None:
    for last in (False, False, True):
        process = Forked(hold_driver, str(fixture_bench.station), role)
        if said := process.stdout.readline():
            break
        # On a busy machine a drive may answer later than its driver waits.
        errors = process.communicate(timeout=PATIENCE)[1]
        process.close()
        assert not last, errors
    try:
        assert on(fixture_bench.world.truth())
        process.send_signal(signal.SIGKILL)
        assert seconds_until(fixture_bench, off) < float(said) + SOON
    finally:
        process.close()
