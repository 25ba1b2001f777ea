"""An earlier typed reading is corrected while its procedure goes on, with an output on between the readings."""

import io
import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
from rich.console import Console

from bench.i18n.language import translator
from bench.journal.events.run import RunStarted
from bench.journal.journal import Journal
from bench.journal.run_view import RunView
from bench.operators.terminal import TerminalOperator
from bench.run.plan import make_plan
from bench.run.sequencer import Runner
from bench.run.tape import Tape
from drivers.interfaces.text import text
from procedures.core.actions import ALIGN_D, EnterReading
from procedures.core.bench import Role
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step


class Typed(Procedure[Settings]):
    """Two readings are typed while the supply is on, and one after; the second decides the current."""

    name: ClassVar[str] = "typed"
    title: ClassVar[str] = "Typed"
    section: ClassVar[str] = "9.8"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.SUPPLY})
    gives: ClassVar[tuple[str, ...]] = ("stator_resistance",)

    def measure(self) -> None:
        self.bench.perform(ALIGN_D)
        self.hold()
        self.again()

    @step("9.8/1", "Hold")
    def hold(self) -> None:
        with self.bench.supply.energised(1.0, 2.0):
            self.bench.clock.sleep(1.0)
            self.first = self.typed("first")
            self.second = self.typed("second")

    @step("9.8/2", "Hold again")
    def again(self) -> None:
        with self.bench.supply.energised(1.0, self.second):
            self.findings["sum"] = self.first + self.second + self.typed("third")
        quantity = self.bench.uncertainties.statistical("repeats", 1e-3 * self.findings["sum"], 1e-5, 9.0)
        self.report("stator_resistance", quantity, section="9.8", estimator="none")

    def typed(self, name: str) -> float:
        return self.bench.reading(EnterReading(name, text("{name} value", name=name), "A", 0.0, 9.0))


class Bench:
    """A run of `Typed` by a person at a terminal."""

    def __init__(self, runner: Runner, trace: list[str], said: io.StringIO, questions: list[str], path: Path) -> None:
        self.runner, self.trace, self.said, self.questions, self.path = runner, trace, said, questions, path

    def run(self, about: dict[str, Any]) -> RunView:
        self.runner.run(make_plan(["typed"], [], {"typed": Typed}), RunStarted(**about))
        return self.runner.view

    def events(self, kind: str) -> list[dict[str, Any]]:
        lines = [json.loads(line) for line in self.path.read_text(encoding="utf-8").splitlines()]
        return [line["data"] for line in lines if line["kind"] == kind]


@pytest.fixture
def bench_of(
    tmp_path: Path, clock: Any, fakes: Any, kit: SimpleNamespace, nameplate: Any, trace: list[str]
) -> Callable[..., Bench]:
    def make(*typed: str) -> Bench:
        lines, questions, said = iter(typed), list[str](), io.StringIO()

        def ask(question: str) -> str:
            questions.append(question)
            return next(lines)

        console = Console(file=said, width=200)
        person = TerminalOperator(console, translator("en"), {}, ask)
        journal, view = Journal(tmp_path / "journal.jsonl", clock.now), RunView()
        journal.listen(view.apply)
        journal.listen(person.entry.hear)
        person.entry.recorder = journal
        instruments = kit.FakeInstruments(fakes)
        runner = Runner(
            instruments=instruments, operator=person, clock=clock, journal=journal, view=view, nameplate=nameplate,
            translate=translator("en"), tape=Tape(journal, person.entry),
        )  # fmt: skip
        return Bench(runner, trace, said, questions, tmp_path / "journal.jsonl")

    return make


def ons(trace: list[str]) -> list[str]:
    return [what for what in trace if what in ("supply.on", "supply.off")]


def test_what_is_on_stays_on_and_nothing_is_asked_twice(bench_of: Callable[..., Bench], about: dict[str, Any]) -> None:
    bench = bench_of("", "1.5", "<", "1", "1.25 A", "2.0", "3.0")
    view = bench.run(about | {"person": "Li Na"})
    assert view.status == "completed", view.cause
    assert view.finished["typed"].findings["sum"] == 6.25
    assert ons(bench.trace) == ["supply.on", "supply.off"] * 2
    (corrected,) = bench.events("reading_corrected")
    assert corrected == {
        "quantity": "first value",
        "unit": "A",
        "was": 1.5,
        "typed": "1.25 A",
        "value": 1.25,
        "by": "Li Na",
        "before": 1.5,
        "after": 1.25,
    }
    assert [event["value"] for event in bench.events("reading_typed")] == [1.5, 2.0, 3.0]
    assert [event["step"] for event in bench.events("step_started")] == ["9.8/1", "9.8/2"]


def test_one_that_has_decided_a_set_point_is_left_or_measured_anew(
    bench_of: Callable[..., Bench], about: dict[str, Any]
) -> None:
    bench = bench_of("", "1.5", "2.0", "<", "2", "2.5", "", "<", "2", "2.5", "y", "", "1.5", "2.5", "3.0")
    view = bench.run(about)
    said = " ".join(bench.said.getvalue().split())
    assert "has already decided what followed: DC supply: output on, voltage 1 V, current limit 2 A" in said
    assert (view.status, view.finished["typed"].findings["sum"]) == ("completed", 7.0)
    assert bench.events("reading_corrected") == []
    (failed,) = bench.events("procedure_failed")
    assert "wants to repeat the procedure from its beginning" in failed["cause"]
    assert ons(bench.trace)[-1] == "supply.off"


def test_what_no_reading_can_be_is_asked_again(bench_of: Callable[..., Bench], about: dict[str, Any]) -> None:
    bench = bench_of("", "1.5", "<", "7", "<", "1", "1.25 V", "99", "", "<", "", "2.0", "3.0")
    view = bench.run(about)
    said = " ".join(bench.said.getvalue().split())
    assert view.finished["typed"].findings["sum"] == 6.5
    assert "'7' is none of the numbers 1 … 1" in said
    assert "'1.25 V' is in V, and A is asked for" in said
    assert "99 A is outside 0 … 9 A" in said
    assert "<" not in bench.questions[1]
