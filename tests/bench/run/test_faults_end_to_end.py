"""Faults of real instruments, through the whole program: one message, outputs off, the journal complete."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bench.cli.main import main
from bench.journal.journal_file import read_journal
from bench.operators.virtual import VirtualOperator
from bench.safety.interrupts import Interrupted
from procedures.core.actions import ChangeSetup, HandWork, TurnToRest
from procedures.core.setup_change import ChangeKind
from sim_instruments.bench import VirtualBench
from sim_instruments.faults.line_faults import Fault, FaultKind

Prepared = list[VirtualBench]


@pytest.fixture
def run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, dict[str, Any], dict[str, Any]]]:
    """Return a function that runs procedures on a bench prepared with a fault: exit status, result, truth at the end."""
    monkeypatch.chdir(tmp_path)
    ends: list[dict[str, Any]] = []

    def call(
        prepare: Callable[[VirtualBench], object], *arguments: str, motor: str = "lg-400w"
    ) -> tuple[int, dict[str, Any], dict[str, Any]]:
        enter, leave = VirtualBench.__enter__, VirtualBench.close

        def entered(self: VirtualBench) -> VirtualBench:
            prepare(self)
            return enter(self)

        def closed(self: VirtualBench) -> None:
            if not ends:
                ends.append(self.world.truth())
            leave(self)

        monkeypatch.setattr(VirtualBench, "__enter__", entered)
        monkeypatch.setattr(VirtualBench, "close", closed)
        with pytest.raises(SystemExit) as stop:
            main(["run", *arguments, "--station", "virtual", "--motor", motor, "--json"])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        result = json.loads(out)
        events = read_journal(Path(result["run"]) / "journal.jsonl").events
        assert events[-1].kind == "run_finished"
        assert result["status"] == "completed" or result["cause"] in err
        return int(stop.value.code or 0), result, ends[0]

    return call


Run = Callable[..., tuple[int, dict[str, Any], dict[str, Any]]]


@pytest.mark.parametrize(
    ("role", "fault", "procedure", "said"),
    [
        ("supply", Fault.wrong_identity(), "pole-pairs-static", "supply after '*IDN?': ACME MODEL 1 answers, expected"),
        ("lcr_meter", Fault.on(FaultKind.SILENCE, "FETC", times=None), "stator-resistance", "lcr_meter after '"),
        (
            "supply",
            Fault.on(FaultKind.SILENCE, r"MEAS:CURR", times=None),
            "pole-pairs-static",
            "supply after 'MEAS:CURR",
        ),
        (
            "supply",
            Fault.on(FaultKind.GARBAGE, r"MEAS:CURR", times=None),
            "pole-pairs-static",
            "supply after 'MEAS:CURR",
        ),
        (
            "oscilloscope",
            Fault.on(FaultKind.HALF, r"WAV\w*:DATA", times=None),
            "dq-inductance-time-constant",
            "oscilloscope",
        ),
    ],
)
def test_an_instrument_that_misbehaves(run: Run, role: str, fault: Fault, procedure: str, said: str) -> None:
    code, result, truth = run(lambda bench: bench.faults(role).add(fault), procedure)
    assert code == 1
    assert result["status"] == "failed"
    assert said in result["cause"]
    assert not truth["output_on"]
    assert not truth["energised"]


def test_an_open_phase_is_found_and_the_output_switched_off(run: Run) -> None:
    code, result, truth = run(lambda bench: bench.world.set_open_phase("A"), "pole-pairs-static")
    assert code == 1
    assert "A (white) is open" in result["cause"]
    assert not truth["output_on"]


def test_a_supply_that_cannot_give_the_current_is_refused(run: Run, tmp_path: Path) -> None:
    code, result, truth = run(lambda _: None, "pole-pairs-static", "--set", "current_share=0.9")
    assert code == 1
    assert "the supply cannot give 26.1 A, its limit is 10 A" in result["cause"]
    assert not truth["output_on"]
    assert "energising" not in {e.kind for e in read_journal(Path(result["run"]) / "journal.jsonl").events}


@pytest.mark.parametrize("work", ["turn", "lock"])
def test_an_abort_while_energised_switches_off(run: Run, monkeypatch: pytest.MonkeyPatch, work: str) -> None:
    perform = VirtualOperator.perform

    def aborting(self: VirtualOperator, asked: HandWork) -> object:
        locking = isinstance(asked, ChangeSetup) and [change.kind for change in asked.changes] == [ChangeKind.LOCK]
        if locking if work == "lock" else isinstance(asked, TurnToRest):
            raise Interrupted("Ctrl-C")
        return perform(self, asked)

    monkeypatch.setattr(VirtualOperator, "perform", aborting)
    procedure = "pole-pairs-static" if work == "turn" else "dq-inductance-aligned"
    code, result, truth = run(lambda _: None, procedure)
    assert code == 1
    assert result["status"] == "aborted"
    assert not truth["output_on"]
    kinds = [e.kind for e in read_journal(Path(result["run"]) / "journal.jsonl").events]
    assert kinds.index("energised") < kinds.index("de_energised") < kinds.index("made_safe")
    assert result["procedures"][procedure]["steps"][-1]["status"] == "failed"
