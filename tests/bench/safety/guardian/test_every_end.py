"""However a run on a bench of wires ends: everything off, asked of the bench itself."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from bench.cli.run import run as motorbench_run
from bench.i18n.errors import InputError
from bench.safety.interrupts import Interrupted

#: Whatever the end, everything is off soon (s); how soon is measured in tests/benchmarks.
SOON = 5.0
#: A frozen run is seen by its silence first (s).
HEARTBEAT = 0.6


#: What the shutdown sequence does to these instruments by default, but with less patience for a shaft that goes on turning.
IMPATIENT = "".join(
    f'[[way_down]]\ndo = "{do}"\nrole = "{role}"\n'
    for do, role in (
        ("command_zero", "inverter"),
        ("command_zero", "dynamometer"),
        ("disable", "inverter"),
        ("disable", "dynamometer"),
        ("output_off", "supply"),
        ("voltage_decayed", "supply"),
        ("current_zero", "supply"),
        ("speed_zero", "dynamometer"),
    )
)


def kinds(events: list[dict[str, Any]]) -> list[str]:
    return [event.kind for event in events]


@contextmanager
def opened(served: Any, name: str) -> Iterator[None]:
    """Open a contact; whatever becomes of the block, the next test finds it closed and the station reset."""
    served.contact(name, closed=False)
    try:
        yield
    finally:
        served.contact(name, closed=True)
        served.reset("Li Wei")


def test_killed(hold: Callable[..., Any], served: Any) -> None:
    run = hold("wait")
    run.signal(signal.SIGKILL)
    assert served.seconds_until_off() < SOON
    events = run.guardian_left()
    took = next(event.data for event in events if event.kind == "took")
    assert took["cause"] == "the run's process has died"
    done = [(e.data["instrument"], e.data["item"]) for e in events if e.data.get("outcome") == "safe"]
    # One that takes longer than the others is not waited for: in order are the items of each instrument.
    assert {name: [item for instrument, item in done if instrument == name] for name, _ in done} == {
        "inverter": ["command_zero", "disable"],
        "dynamometer": ["command_zero", "disable", "speed_zero"],
        "supply": ["output_off", "voltage_decayed", "current_zero"],
    }
    assert run.journal[-1].kind == "energised"


def test_frozen_and_woken_again(hold: Callable[..., Any], served: Any) -> None:
    run = hold("wait")
    run.signal(signal.SIGSTOP)
    assert served.seconds_until_off() < SOON + HEARTBEAT
    run.signal(signal.SIGCONT)
    told = run.ended()
    assert told["status"] == "aborted"
    assert "the guardian, which carried out the shutdown: no heartbeat for 0.6 s" in told["cause"]
    assert kinds(run.guardian_left())[-1] == "left"
    assert served.world.truth()["energised"] is False


def test_the_guardians_death_stops_the_run(hold: Callable[..., Any], served: Any) -> None:
    run = hold("wait")
    os.kill(run.guardian_pid, signal.SIGKILL)
    assert served.seconds_until_off() < SOON
    told = run.ended()
    assert (told["status"], told["cause"]) == ("aborted", "interrupted by the guardian, which died")


def test_a_frozen_guardian_stops_the_run(hold: Callable[..., Any], served: Any) -> None:
    run = hold("wait")
    os.kill(run.guardian_pid, signal.SIGSTOP)
    told = run.ended()
    assert told["status"] == "aborted"
    assert "interrupted by the guardian, which does not answer" in told["cause"]
    assert served.world.truth()["energised"] is False


@pytest.mark.parametrize(
    ("numbers", "by"),
    [
        ([signal.SIGTERM], "SIGTERM"),
        ([signal.SIGHUP], "SIGHUP"),
        ([signal.SIGINT, signal.SIGINT], "Ctrl-C"),
    ],
)
def test_interrupted(hold: Callable[..., Any], served: Any, numbers: list[signal.Signals], by: str) -> None:
    run = hold("wait")
    for number in numbers:
        run.signal(number)
    assert served.seconds_until_off() < SOON
    told = run.ended()
    assert told["status"] == "aborted"
    assert told["cause"].splitlines()[0] == f"interrupted by {by}"
    (start,) = (event.data for event in run.journal if event.kind == "way_down_started")
    assert start["interrupted_after"] < SOON
    events = run.guardian_left()
    assert (kinds(events)[:2], kinds(events)[-1]) == (["started", "ready"], "left")
    # A run that has no processor for half a second is helped by its guardian, which waits no longer.
    helped = ("the run has not begun its shutdown", "the run's shutdown has not switched everything off")
    assert all(event.data["cause"].startswith(helped) for event in events if event.kind == "took")


def test_a_full_disk(hold: Callable[..., Any], served: Any) -> None:
    run = hold("disk-full")
    assert served.seconds_until_off() < SOON
    told = run.ended()
    assert told["status"] == "failed"
    assert "journal.jsonl cannot be written" in told["cause"]
    events = run.guardian_left()
    # What the run switched off it could not write down: its guardian may do it again before it is told why.
    assert "the run's journal cannot be written" in [e.data["cause"] for e in events if e.kind == "took"]
    assert ("supply", "output_off", "safe") in [
        (e.data.get("instrument"), e.data.get("item"), e.data.get("outcome")) for e in events
    ]


def test_an_output_that_only_says_it_is_off(
    hold: Callable[..., Any], served: Any, tmp_path_factory: pytest.TempPathFactory
) -> None:
    station = tmp_path_factory.mktemp("impatient") / "station.toml"
    station.write_text(f"{served.station.read_text(encoding='utf-8')}\n{IMPATIENT}within = 1.0\n", encoding="utf-8")
    run = hold("wait", station=station)
    served.world._ask("POST", "/faults", {"fault": "stuck_output", "role": "supply", "reports": "off"})
    try:
        run.signal(signal.SIGTERM)
        told = run.ended()
    finally:
        served.mend()
    assert told["status"] == "aborted", told
    assert "supply could not be made safe (voltage_decayed)" in told["cause"]
    _, _, by_guardian = told["cause"].partition("the guardian could not either: ")
    assert "supply could not be made safe (voltage_decayed)" in by_guardian, told["cause"]
    assert "has switched off" not in told["cause"]
    assert "may still be on: switch it off by hand" in told["cause"]
    assert "not waited for" not in told["cause"]
    measured = [event.data for event in run.guardian_left() if event.kind == "measured"]
    assert ("voltage_decayed", "failed") in [(one["item"], one["outcome"]) for one in measured]


def test_an_instrument_that_is_lost(
    hold: Callable[..., Any], served: Any, tmp_path_factory: pytest.TempPathFactory
) -> None:
    station = tmp_path_factory.mktemp("impatient") / "station.toml"
    station.write_text(f"{served.station.read_text(encoding='utf-8')}\n{IMPATIENT}within = 10.0\n", encoding="utf-8")
    run = hold("lose", "inverter", station=station)
    served.silence("inverter")
    try:
        told = run.ended()
    finally:
        served.mend()
    assert told["status"] == "failed", told
    assert "no usable reply" in told["cause"]
    assert "inverter could not be made safe (disable)" in told["cause"]
    truth = served.world.truth()
    assert (truth["dynamometer_enabled"], truth["output_on"]) == (False, False)
    safe = [(e.data["instrument"], e.data["item"]) for e in run.journal if e.data.get("outcome") == "safe"]
    assert {("dynamometer", "disable"), ("supply", "output_off"), ("supply", "voltage_decayed")} <= set(safe)


@pytest.mark.parametrize("name", ["emergency_stop", "door"])
def test_an_interlock_that_opens(hold: Callable[..., Any], served: Any, tmp_path: Path, name: str) -> None:
    run = hold("wait")
    with opened(served, name):
        assert served.seconds_until_off() < SOON
        told = run.ended()
        assert told["status"] == "aborted"
        assert told["cause"].splitlines()[0] == f"interrupted by the interlock {name}, which is open"
        (start,) = (event.data for event in run.journal if event.kind == "way_down_started")
        assert start["interrupted_after"] < SOON
        for closed, why in ((False, f"the interlock {name} was open at"), (True, "it has not been reset")):
            served.contact(name, closed=closed)
            with pytest.raises(InputError, match=why):
                motorbench_run("pole-pairs-static", station=str(served.station), motor="lg-400w", runs=tmp_path)


def test_the_guardian_answers_an_interlock_where_the_run_does_not(hold: Callable[..., Any], served: Any) -> None:
    run = hold("deadlock")
    with opened(served, "door"):
        assert served.seconds_until_off() < SOON
        # By itself, or because a watching thread of the run has asked for a shutdown that does not begin: whichever looks first.
        (cause,) = [event.data["cause"] for event in run.guardian if event.kind == "took"]
        assert cause.endswith("the interlock door, which is open")
        run.signal(signal.SIGKILL)
        run.guardian_left()


def test_a_drive_goes_off_by_itself_where_nobody_is_left(hold: Callable[..., Any], served: Any) -> None:
    run = hold("wait")
    os.kill(run.guardian_pid, signal.SIGSTOP)
    run.signal(signal.SIGKILL)
    assert served.truth_becomes("inverter_enabled", False)
    # Nobody but its own watchdog did that: what has none is still on.
    assert served.world.truth()["output_on"] is True
    os.kill(run.guardian_pid, signal.SIGCONT)
    assert served.seconds_until_off() < SOON
    run.guardian_left()


def test_an_interrupted_request_to_the_bench_does_not_spoil_the_next(served: Any, monkeypatch: Any) -> None:
    def interrupted(*_: object) -> object:
        raise Interrupted("a test")

    with monkeypatch.context() as patched:
        patched.setattr(served.world._connection, "getresponse", interrupted)
        with pytest.raises(Interrupted):
            served.world.truth()
    assert served.world.truth()["energised"] is False
