import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bench.journal.journal import Journal
from bench.journal.journal_file import read_journal
from bench.journal.run_view import view_of
from bench.run.plan import Planned
from bench.run.retry_policy import never_stop
from bench.run.sequencer import Runner
from bench.station.shutdown_sequence import default_items
from drivers.interfaces import CommunicationError
from procedures.core.actions import Action
from procedures.core.bench import Role
from procedures.core.events import Event
from tests.journals import event

MakeRunner = Callable[..., Runner]

#: What each item of the usual list does to its instrument, and the items as the journal has them.
CALLS = {
    "command_zero": "command_zero",
    "output_off": "output_off",
    "voltage_decayed": "measure_voltage",
    "current_zero": "measure_current",
    "speed_zero": "measure",
}
USUAL = [(item.role.value, item.do.value) for item in default_items()]
OTHERWISE = {
    ("drive", "speed_zero"): "measure_frequency",
    ("tachometer", "speed_zero"): "measure_speed",
    ("insulation_tester", "output_off"): "make_safe",
}
DONE = [f"{role}.{OTHERWISE.get((role, do)) or CALLS.get(do, 'make_safe')}" for role, do in USUAL]


def test_a_run_completes(make_runner: MakeRunner, plan: list[Planned], about: dict[str, Any], tmp_path: Path) -> None:
    view = make_runner().run(plan, event("run_started", **about))
    result = view.as_dict()
    assert result["status"] == "completed"
    resistance = result["parameters"]["stator_resistance"]
    assert resistance["value"] == 0.016
    assert resistance["procedure"] == "tiny"
    assert [other["procedure"] for other in resistance["alternatives"]] == ["other"]
    assert {warning["id"] for warning in result["warnings"]} == {"E9", "disagreement"}
    assert result["warnings"][0]["message"] == "the share is 25%"
    assert [s["id"] for s in result["procedures"]["tiny"]["steps"]] == ["9.9/1", "9.9/2", "9.9/3"]
    assert result["procedures"]["tiny"]["findings"] == {"temperature": 25.0}
    assert result["bench_time"] == 2.0
    assert view_of(read_journal(tmp_path / "journal.jsonl").events).as_dict() == result


@pytest.mark.parametrize("what", ["on", "measure_current", "off"])
@pytest.mark.parametrize("error", [CommunicationError("supply", "no reply"), RuntimeError("bug"), KeyboardInterrupt()])
def test_every_failure_takes_the_way_down(
    make_runner: MakeRunner,
    plan: list[Planned],
    about: dict[str, Any],
    fakes: dict[Role, Any],
    trace: list[str],
    tmp_path: Path,
    what: str,
    error: BaseException,
) -> None:
    fakes[Role.SUPPLY].failing[what] = error
    view = make_runner().run(plan, event("run_started", **about))
    assert view.status == ("aborted" if isinstance(error, KeyboardInterrupt) else "failed")
    assert not any(fake.on for fake in fakes.values())
    closing = next(place for place, entry in enumerate(trace) if entry.endswith("close"))
    assert trace[closing - len(DONE) : closing] == DONE
    assert {entry for entry in trace if entry.endswith("close")} == {f"{role.value}.close" for role in Role}
    assert "other" not in view.procedures
    events = read_journal(tmp_path / "journal.jsonl").events
    assert events[-1].kind == "run_finished"
    safe = [(e.data["instrument"], e.data["item"]) for e in events if e.kind == "made_safe"]
    assert safe[-len(USUAL) :] == USUAL
    assert view.as_dict()["procedures"]["tiny"]["status"] == "failed"


def test_one_that_cannot_be_made_safe_does_not_keep_the_next(
    fakes: dict[Role, Any], trace: list[str], make_runner: MakeRunner, plan: list[Planned], about: dict[str, Any]
) -> None:
    fakes[Role.SUPPLY].failing["output_off"] = CommunicationError("supply", "no reply")
    fakes[Role.INVERTER].failing["make_safe"] = KeyboardInterrupt()
    fakes[Role.TACHOMETER].failing["close"] = OSError("gone")
    view = make_runner().run(plan, event("run_started", **about))
    assert [entry for entry in trace if entry in DONE][-len(DONE) :] == DONE
    assert view.status == "failed"
    assert "supply could not be made safe (output_off): supply: no reply" in view.cause
    assert "inverter could not be made safe (disable): KeyboardInterrupt" in view.cause
    assert "tachometer: gone" in view.cause


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_abort_safely(
    make_runner: MakeRunner, plan: list[Planned], about: dict[str, Any], trace: list[str], number: signal.Signals
) -> None:
    class Hands:
        def perform(self, action: Action) -> object:
            signal.raise_signal(number)
            return None

    before = signal.getsignal(number)
    view = make_runner(operator=Hands()).run(plan, event("run_started", **about))
    assert view.status == "aborted"
    assert ("Ctrl-C" if number == signal.SIGINT else number.name) in view.cause
    assert trace[: len(DONE)] == DONE
    assert signal.getsignal(number) == before


def test_a_signal_on_the_way_down_waits(
    make_runner: MakeRunner, plan: list[Planned], about: dict[str, Any], fakes: dict[Role, Any], trace: list[str]
) -> None:
    off = fakes[Role.SUPPLY].output_off

    def impatient() -> None:
        signal.raise_signal(signal.SIGTERM)
        off()

    fakes[Role.SUPPLY].output_off = impatient
    view = make_runner().run(plan, event("run_started", **about))
    assert view.status == "completed"
    assert trace[-len(fakes) :] == [f"{role.value}.close" for role in fakes]


def test_going_on_after_an_error(
    make_runner: MakeRunner, plan: list[Planned], about: dict[str, Any], fakes: dict[Role, Any]
) -> None:
    fakes[Role.SUPPLY].failing["on"] = CommunicationError("supply", "no reply", command="OUTP ON")
    view = make_runner().run(plan, event("run_started", **about), after=never_stop)
    assert view.status == "failed"
    assert set(view.procedures) == {"tiny", "other"}
    assert "supply after 'OUTP ON': no reply" in view.cause


def test_a_run_is_resumed_at_the_first_unfinished(
    make_runner: MakeRunner, plan: list[Planned], about: dict[str, Any], fakes: dict[Role, Any], tmp_path: Path
) -> None:
    class Hands:
        count = 0

        def perform(self, action: Action) -> object:
            self.count += 1
            if self.count == 3:
                raise KeyboardInterrupt
            return 25.0

    first = make_runner(operator=Hands()).run(plan, event("run_started", **about))
    assert first.status == "aborted"
    path = tmp_path / "journal.jsonl"
    with path.open("ab") as file:
        file.write(b'{"n":99,"ki')
    previous = read_journal(path)
    assert previous.torn
    view = view_of(previous.events)
    assert list(view.finished) == ["tiny"]
    again = make_runner(journal=Journal(path, lambda: 0.0, previous=previous), view=view)
    second = again.run(plan, event("run_resumed"))
    assert second.status == "completed"
    started = [e.data["procedure"] for e in read_journal(path).events if e.kind == "procedure_started"]
    assert started == ["tiny", "other", "other"]
    assert second.parameters().parameters["stator_resistance"].value == 0.016


def test_what_an_interrupted_session_left_on_is_switched_off_before_hands_touch_it(
    make_runner: MakeRunner, plan: list[Planned], about: dict[str, Any], fakes: dict[Role, Any], trace: list[str]
) -> None:
    class Hands:
        def perform(self, action: Action) -> object:
            assert not fakes[Role.SUPPLY].on
            return 25.0

    fakes[Role.SUPPLY].on = True
    assert (
        make_runner(operator=Hands()).run(plan, event("run_resumed", **about), unsafe_before=True).status == "completed"
    )
    assert trace[: len(DONE)] == DONE


def test_what_cannot_be_switched_off_keeps_a_run_from_going_on(
    make_runner: MakeRunner, plan: list[Planned], about: dict[str, Any], fakes: dict[Role, Any]
) -> None:
    fakes[Role.SUPPLY].failing["output_off"] = CommunicationError("supply", "no reply")
    view = make_runner().run(plan, event("run_resumed", **about), unsafe_before=True)
    assert view.status == "failed"
    assert "Switch it off by hand, then go on with --resume" in view.cause
    assert view.procedures == {}


def test_a_full_disk_still_leaves_everything_off(
    make_runner: MakeRunner,
    plan: list[Planned],
    about: dict[str, Any],
    trace: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    runner = make_runner()
    real = runner.journal.record

    def full(event: Event) -> None:
        if event.kind in ("step_started", "made_safe", "run_finished", "step_failed", "procedure_failed"):
            raise OSError(28, "No space left on device")
        real(event)

    monkeypatch.setattr(runner.journal, "record", full)
    view = runner.run(plan, event("run_started", **about))
    assert view.status == "failed"
    assert "no space is left" in view.cause
    assert [entry for entry in trace if entry in DONE][: len(DONE)] == DONE
