import json
import math
import signal
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from bench.i18n.errors import message
from bench.i18n.language import translator
from bench.operators.operator_channel import FILE
from bench.operators.panel_operator import DistantOperator
from bench.operators.person_prompt import PersonPrompt
from bench.safety.interrupts import Interrupted, Interrupts
from drivers.interfaces.text import text
from drivers.manual.supply import MODES, REGULATION
from procedures.core.actions import ALIGN_D, EnterReading, LockRotor, MarkRestPositions, Mend
from procedures.core.setup import BenchSetup
from procedures.core.setup_change import Change, ChangeKind, ChangeSetup
from tests.studies.forked import Forked, motorbench

#: Whatever is waited for comes within this time (s), however busy the machine.
PATIENCE = 60.0
READING = EnterReading("winding_temperature", text("the winding's temperature"), "°C", -60.0, 250.0)


class Panel:
    """As much of a panel as a test needs."""

    def __init__(self, folder: Path) -> None:
        where = json.loads((folder / FILE).read_text())
        self._socket = socket.create_connection(("127.0.0.1", where["port"]), timeout=PATIENCE)
        self._lines = self._socket.makefile("rb")
        self._questions = deque[dict[str, Any]]()
        self.send({"token": where["token"]})

    def __enter__(self) -> "Panel":
        return self

    def __exit__(self, *_: object) -> None:
        self._lines.close()
        self._socket.close()

    def send(self, message: dict[str, Any]) -> None:
        self._socket.sendall(json.dumps(message).encode() + b"\n")

    def read(self) -> dict[str, Any] | None:
        line = self._lines.readline()
        return json.loads(line) if line else None

    def question(self) -> dict[str, Any]:
        if self._questions:
            return self._questions.popleft()
        while (message := self.read()) is not None:
            if message.get("question"):
                return dict(message["question"])
        raise AssertionError("the line ended without a question")

    def answer(self, question: dict[str, Any], value: object = None) -> dict[str, Any]:
        return self._said({"id": question["id"], "answer": value})

    def correct(self, question: dict[str, Any], number: int, typed: str) -> dict[str, Any]:
        return self._said({"id": question["id"], "correct": {"number": number, "typed": typed}, "by": "Li Na"})

    def _said(self, message: dict[str, Any]) -> dict[str, Any]:
        self.send(message)
        while (message := self.read()) is not None:
            if "heard" in message or "refused" in message:
                return message
            # The next question may be asked before this answer is acknowledged.
            if message.get("question"):
                self._questions.append(dict(message["question"]))
        raise AssertionError("the line ended without an answer")


@pytest.fixture
def interrupts() -> Interrupts:
    return Interrupts()


@pytest.fixture
def operator(tmp_path: Path, interrupts: Interrupts) -> Iterator[DistantOperator]:
    with closing(DistantOperator(interrupts)) as made:
        made.line.announce(tmp_path)
        yield made


def asked(work: Callable[[], object]) -> tuple[threading.Thread, list[object]]:
    given: list[object] = []
    thread = threading.Thread(target=lambda: given.append(work()))
    thread.start()
    return thread, given


def test_an_action_is_asked_with_its_data_and_waits_for_its_answer(operator: DistantOperator, tmp_path: Path) -> None:
    thread, given = asked(lambda: operator.perform(ALIGN_D))
    with Panel(tmp_path) as panel, Panel(tmp_path) as second:
        question = panel.question()
        assert second.question() == question
        assert question["action"] == "Connect"
        assert question["details"]["terminals"] == {"A": "supply+", "B": "supply-", "C": "supply-"}
        assert given == []
        assert panel.answer(question) == {"heard": question["id"]}
        thread.join(PATIENCE)
        assert given == [None]
        assert second.answer(question)["refused"] == "this is not asked any more"


@pytest.mark.parametrize(
    ("kind", "at_shaft"), [(ChangeKind.LOCK, True), (ChangeKind.FREE, True), (ChangeKind.UNCOUPLE, False)]
)
def test_only_locking_and_freeing_the_shaft_is_work_at_an_energised_motor(
    operator: DistantOperator, tmp_path: Path, kind: ChangeKind, at_shaft: bool
) -> None:
    thread, _ = asked(lambda: operator.perform(ChangeSetup((Change(kind, number=1),), BenchSetup(), BenchSetup())))
    with Panel(tmp_path) as panel:
        question = panel.question()
        assert question["at_shaft"] is at_shaft
        panel.answer(question)
        thread.join(PATIENCE)


@pytest.mark.parametrize(
    ("answer", "refusal"),
    [
        (300.0, "300 °C is outside -60 … 250 °C; read again"),
        ("warm", "'warm' is not a number; type it like 12.3 / 12,3 °C"),
        (True, "True is not a number"),
        (None, "None is not a number"),
    ],
)
def test_what_makes_no_sense_is_refused_and_asked_on(
    operator: DistantOperator, tmp_path: Path, answer: object, refusal: str
) -> None:
    thread, given = asked(lambda: operator.perform(READING))
    with Panel(tmp_path) as panel:
        question = panel.question()
        assert panel.answer(question, answer)["refused"] == refusal
        assert panel.answer(question, 25.5) == {"heard": question["id"]}
        thread.join(PATIENCE)
    assert given == [25.5]


def test_marked_angles_come_in_degrees(operator: DistantOperator, tmp_path: Path) -> None:
    thread, given = asked(lambda: operator.perform(MarkRestPositions()))
    with Panel(tmp_path) as panel:
        question = panel.question()
        assert "refused" in panel.answer(question, [])
        panel.answer(question, [0, 90.0, 180])
        thread.join(PATIENCE)
    assert given == [pytest.approx([0.0, math.pi / 2, math.pi])]


def test_instruments_set_by_hand_ask_the_same_person(operator: DistantOperator, tmp_path: Path) -> None:
    prompt = PersonPrompt(operator, "supply")
    thread, given = asked(
        lambda: (prompt.confirm(text("Set {v} V", v=5)), prompt.ask(text("current"), "A", 0.0, 2.0, text("at 5 V")))
    )
    with Panel(tmp_path) as panel:
        first = panel.question()
        assert (first["instrument"], first["task"]) == ("supply", {"template": "Set {v} V", "values": {"v": 5}})
        panel.answer(first)
        second = panel.question()
        assert second["unit"] == "A"
        panel.answer(second, 1.25)
        thread.join(PATIENCE)
    assert given == [(None, 1.25)]


def test_what_a_person_puts_right_at_the_panel_is_measured_again(operator: DistantOperator, tmp_path: Path) -> None:
    mend = Mend(text("{wire} is connected, and should be open", wire="C (black)"), tuple(ALIGN_D.lines({})))
    thread, given = asked(lambda: operator.perform(mend))
    with Panel(tmp_path) as panel:
        question = panel.question()
        assert question["action"] == "Mend"
        assert question["lines"][0]["template"] == "Correct the wiring: {finding}"
        panel.answer(question)
        thread.join(PATIENCE)
    assert given == [True]


def test_virtual_hands_do_what_is_confirmed_and_read_what_is_proposed(tmp_path: Path) -> None:
    done: list[object] = []

    class Hands:
        def perform(self, action: object) -> object:
            done.append(action)
            return 24.5 if isinstance(action, EnterReading) else None

        def wait(self, seconds: float) -> None:
            raise AssertionError("nothing runs down")

    with closing(DistantOperator(Interrupts(), Hands())) as operator:
        operator.line.announce(tmp_path)
        thread, given = asked(lambda: (operator.perform(LockRotor()), operator.perform(READING)))
        with Panel(tmp_path) as panel:
            question = panel.question()
            assert done == []
            panel.answer(question)
            reading = panel.question()
            assert reading["proposed"] == 24.5
            panel.answer(reading, reading["proposed"])
            thread.join(PATIENCE)
    assert done == [LockRotor(), READING]
    assert given == [(None, 24.5)]


def test_a_stranger_is_turned_away(operator: DistantOperator, tmp_path: Path) -> None:
    port = json.loads((tmp_path / FILE).read_text())["port"]
    for first in (b'{"token": "guess"}\n', b'{"answer": null}\n', b"GET / HTTP/1.1\r\n\r\n", b"\xff\n", b"[]\n"):
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as stranger:
            stranger.sendall(first)
            assert "refused" in json.loads(stranger.makefile("rb").readline())
            assert stranger.makefile("rb").readline() == b""


def test_only_its_owner_may_read_where_the_line_is(operator: DistantOperator, tmp_path: Path) -> None:
    assert (tmp_path / FILE).stat().st_mode & 0o777 == 0o600
    operator.line.close()
    assert not (tmp_path / FILE).exists()


def test_abort_says_who(operator: DistantOperator, tmp_path: Path, interrupts: Interrupts) -> None:
    with Panel(tmp_path) as panel:
        panel.send({"abort": "J. Doe"})
        while "heard" not in (panel.read() or {"heard": None}):
            pass
    assert str(interrupts.requested_by) == "J. Doe at the panel"
    assert message(Interrupted(interrupts.requested_by), translator("zh")) == "由操作面板上的 J. Doe中断"


def test_an_empty_chair_ends_the_run(interrupts: Interrupts) -> None:
    with closing(DistantOperator(interrupts, patience=0.05)):
        deadline = time.monotonic() + PATIENCE
        while not interrupts.requested_by and time.monotonic() < deadline:
            threading.Event().wait(0.01)
    assert "no panel has been open" in str(interrupts.requested_by)


def start(runs: Path, *procedures: str) -> "closing[Forked]":
    words = ("run", *procedures, "--station", "virtual", "--motor", "lg-400w", "--operator", "panel")
    return closing(Forked(motorbench, *words, "--person", "J. Doe", "--runs", str(runs), "--json"))


def folder_of(runs: Path) -> Path:
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        for path in runs.glob(f"*/{FILE}"):
            return path.parent
        threading.Event().wait(0.02)
    raise AssertionError("no run announced itself")


def test_a_run_is_led_from_another_process(tmp_path: Path) -> None:
    with start(tmp_path, "stator-resistance") as process:
        with Panel(folder_of(tmp_path)) as panel:
            while (message := panel.read()) is not None:
                if message.get("question"):
                    question = message["question"]
                    panel.send({"id": question["id"], "answer": question.get("proposed")})
        out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, err
    result = json.loads(out)
    resistance = result["parameters"]["stator_resistance"]
    low, high = resistance["coverage_interval"]
    assert low <= resistance["truth"] <= high
    assert not list(tmp_path.glob(f"*/{FILE}"))


def test_an_abort_from_another_process_takes_the_way_down(tmp_path: Path) -> None:
    with start(tmp_path, "pole-pairs-static") as process:
        folder = folder_of(tmp_path)
        with Panel(folder) as panel:
            panel.answer(panel.question())
            panel.question()
            panel.send({"abort": "J. Doe"})
            out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 1, err
    result = json.loads(out)
    assert result["status"] == "aborted"
    assert "J. Doe at the panel" in result["cause"]
    assert '"kind":"made_safe"' in (folder / "journal.jsonl").read_text()


def test_ctrl_c_ends_a_run_that_waits_for_its_panel(tmp_path: Path) -> None:
    with start(tmp_path, "stator-resistance") as process, Panel(folder_of(tmp_path)) as panel:
        panel.question()
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=PATIENCE)
    assert json.loads(out)["status"] == "aborted"


def test_one_of_fixed_answers_is_chosen_and_told_with_its_words(operator: DistantOperator, tmp_path: Path) -> None:
    prompt = PersonPrompt(operator, "supply")
    thread, given = asked(lambda: prompt.choose(REGULATION, [*MODES.values()]))
    with Panel(tmp_path) as panel:
        question = panel.question()
        assert [(one["number"], one["sign"]) for one in question["options"]] == [(0, ""), (1, "CC"), (2, "CV"), (3, "")]
        assert "Choose one of the answers first" in panel.answer(question, "")["refused"]
        for none in ("4", "0.5", "regulation"):
            assert f"'{none}' is not one of the answers" in panel.answer(question, none)["refused"]
        assert panel.answer(question, "CV") == {"heard": question["id"]}
        thread.join(PATIENCE)
    assert given == [2.0]
    assert [(reading.value, len(reading.options)) for reading in operator.entry.taken] == [(2.0, 4)]
