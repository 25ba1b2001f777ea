"""Readings that are repeated, from what a person types or an instrument gives to the result that tells of it."""

import io
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from bench.journal.corrected import corrected
from bench.journal.events.instruments import ReadingTaken
from bench.journal.journal_file import read_journal
from bench.journal.stored_result import restore_text
from bench.operators.entry import TypedReading
from bench.operators.panel_operator import DistantOperator
from bench.operators.person_prompt import PersonPrompt
from bench.safety.interrupts import Interrupts
from bench.testing import MeasuredRun, run_procedures, virtual_motor
from drivers.interfaces import ImpedanceReading, Wanted
from drivers.interfaces.text import Text, lines, text
from drivers.keysight.e4980a import KeysightE4980A
from procedures.core.actions import DoubtReading
from procedures.core.events import RepeatStarted
from procedures.core.procedure_error import CorrectedError, RepeatRequestedError
from tests.bench.operators.test_distant import Panel, asked
from tests.command_line import Call

NOTE = Path(__file__).parents[3] / "docs" / "examples" / "note"

Typed = Callable[..., tuple[int, dict[str, Any], str, list[dict[str, Any]]]]


@pytest.fixture
def typed(call: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Typed:
    """Measures resistances that are typed: returns exit status, result, what the terminal said, and the journal's events."""

    def run(*lines: str, language: str = "en") -> tuple[int, dict[str, Any], str, list[dict[str, Any]]]:
        monkeypatch.setattr(sys, "stdin", io.StringIO("\n".join(lines) + "\n"))
        words = ("--station", str(NOTE / "station.toml"), "--motor", str(NOTE / "lg-400w.toml"), "--language", language)
        settings = ("--set", "short_correction=false", "--set", "winding_temperature=25.0", "--json")
        status, out, err = call("run", "stator-resistance", *words, *settings)
        (folder,) = (tmp_path / "runs").iterdir()
        events = [json.loads(line) for line in (folder / "journal.jsonl").read_text(encoding="utf-8").splitlines()]
        return status, json.loads(out), " ".join(err.split()), events

    return run


def of(events: list[dict[str, Any]], kind: str) -> list[dict[str, Any]]:
    return [event["data"] for event in events if event["kind"] == kind]


@pytest.fixture
def warm(call: Call, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[int, dict[str, Any], str]]:
    """Measures one reading a line; the winding's temperature is typed: returns exit status, result, and what the terminal said."""

    def run(*typed: str) -> tuple[int, dict[str, Any], str]:
        lines = ("", *("", "32 mΩ") * 3, *typed)
        monkeypatch.setattr(sys, "stdin", io.StringIO("\n".join(lines) + "\n"))
        words = ("--station", str(NOTE / "station.toml"), "--motor", str(NOTE / "lg-400w.toml"), "--language", "en")
        settings = ("--set", "short_correction=false", "--set", "repeats=1", "--json")
        status, out, err = call("run", "stator-resistance", *words, *settings)
        return status, json.loads(out), " ".join(err.split())

    return run


def test_a_temperature_unlike_a_rooms_is_typed_again(warm: Callable[..., tuple[int, dict[str, Any], str]]) -> None:
    status, result, said = warm("215", "21.5")
    assert status == 0
    assert "the winding's temperature once more (215 °C is unlike what is usual here, 5 … 45 °C" in said
    assert result["procedures"]["stator-resistance"]["findings"]["winding_temperature"] == 21.5
    assert "winding-temperature" not in {warning["id"] for warning in result["warnings"]}


def test_one_that_is_confirmed_twice_is_taken_and_told(warm: Callable[..., tuple[int, dict[str, Any], str]]) -> None:
    status, result, _ = warm("-12", "-12", "-12.4")
    assert status == 0
    assert result["procedures"]["stator-resistance"]["findings"]["winding_temperature"] == -12.4
    assert "winding-temperature" in {warning["id"] for warning in result["warnings"]}


def test_temperatures_that_contradict_each_other_end_the_run(
    warm: Callable[..., tuple[int, dict[str, Any], str]],
) -> None:
    status, result, _ = warm(*("2.15", "215") * 3)
    assert status != 0
    assert "was read as 2.15, 215, 2.15, 215, 2.15, 215 °C, which contradict each other" in result["cause"]


#: The bridge is set, then A–B connected.
BEGIN, CONNECT = "", ""
GOOD = ("32 mΩ", "31.9 mOhm", "0,0321")


def test_a_slip_is_asked_about_and_typed_again(typed: Typed) -> None:
    slip = ("32 mΩ", "3.2 mΩ", "0,0321", "", "31.9 mOhm")
    status, result, said, events = typed(BEGIN, CONNECT, *slip, *(CONNECT, *GOOD) * 3)
    assert status == 0
    assert (
        "resistance A–B, reading 2 of 3: it is a tenth of the other readings, 0.0032 Ω against 0.032, 0.0321 Ω" in said
    )
    assert "LCR meter, resistance Rs at 20 Hz, A–B, reading 3 of 3" in said
    first = of(events, "repeats_taken")[0]
    assert (first["taken"], first["left_out"]) == ([0.032, 0.0319, 0.0321], [0.0032])
    assert result["parameters"]["stator_resistance"]["value"] == pytest.approx(0.016, rel=1e-3)
    assert result["misfit"] == []
    # What was typed and what was taken of it.
    entries = of(events, "reading_typed")
    assert (entries[0]["typed"], entries[0]["unit"], entries[0]["value"]) == ("32 mΩ", "Ω", 0.032)
    assert "A–B, reading 1 of 3" in entries[0]["quantity"]


@pytest.mark.parametrize(
    ("slip", "said"),
    [
        ("32 微欧", "第 2 次读数（共 3 次）是其余读数的千分之一：3.2e-05 Ω，其余为 0.032、0.0321 Ω"),
        ("３２ 欧", "第 2 次读数（共 3 次）是其余读数的一千倍：32 Ω，其余为 0.032、0.0321 Ω"),
        ("20 毫欧", "第 2 次读数（共 3 次）与其余读数不符：0.02 Ω，其余为 0.032、0.0321 Ω"),
    ],
)
def test_a_slip_is_told_and_typed_again_in_chinese(typed: Typed, slip: str, said: str) -> None:
    lines = ("32 毫欧", slip, "0,0321", "", "３１．９ｍΩ")
    status, _, told, events = typed(BEGIN, CONNECT, *lines, *(CONNECT, *GOOD) * 3, language="zh")
    assert status == 0
    # Lines are broken anywhere in Chinese.
    assert "".join(said.split()) in "".join(told.split())
    assert of(events, "repeats_taken")[0]["taken"] == [0.032, 0.0319, 0.0321]


def test_a_confirmed_one_is_kept_and_told(typed: Typed) -> None:
    odd = ("32 mΩ", "34 mΩ", "0,0321", "y")
    status, result, _, events = typed(BEGIN, CONNECT, *odd, *(CONNECT, *GOOD) * 3)
    assert status == 0
    assert of(events, "repeats_taken")[0]["taken"] == [0.032, 0.034, 0.0321]
    (row,) = result["misfit"]
    assert (row["cause"], row["answer"], row["figures"]["terminals"]) == ("repeats-differ", "widened", "A–B")
    assert "contradict each other: 0.032 … 0.034 Ω" in row["message"]
    assert "repeats-differ" in {warning["id"] for warning in result["warnings"]}
    low, high = result["parameters"]["stator_resistance"]["coverage_interval"]
    assert low < 0.016 < high


def test_any_reading_is_corrected_and_a_wrong_unit_refused(typed: Typed, call: Call, tmp_path: Path) -> None:
    begin = ("<", "31 mH", "32.6 mΩ", "31.9 mOhm", "0,0321")
    # At the second pair, the first reading of the first one is corrected.
    status, result, said, events = typed(
        BEGIN, CONNECT, *begin, CONNECT, "32 mΩ", "<", "1", "32 mΩ", *GOOD[1:], *(CONNECT, *GOOD) * 2
    )
    assert status == 0
    assert "'31 mH' is in mH, and Ω is asked for" in said
    assert "1. LCR meter, resistance Rs at 20 Hz, A–B, reading 1 of 3: 0.0326 Ω" in said
    taken = of(events, "repeats_taken")
    assert [group["taken"] for group in taken[:3]] == [
        [0.0326, 0.0319, 0.0321],
        [0.032, 0.0319, 0.0321],
        [0.032, 0.0319, 0.0321],
    ]
    (one,) = of(events, "reading_corrected")
    assert (one["was"], one["value"], one["typed"]) == (0.0326, 0.032, "32 mΩ")
    assert result["procedures"]["stator-resistance"]["findings"]["line_resistances"]["AB"] == pytest.approx(0.032)
    # Before the first entry there is none to correct.
    values = [(entry["typed"], entry["value"]) for entry in of(events, "reading_typed")[:3]]
    assert values == [("<", None), ("31 mH", None), ("32.6 mΩ", 0.0326)]
    assert of(events, "instrument_error") == []
    (folder,) = (tmp_path / "runs").iterdir()
    assert call("results", "verify", str(folder))[0] == 0
    # A report shows what counts.
    shown = [each.event for each in corrected(read_journal(folder / "journal.jsonl").events)]
    values = [each.value["resistance"] for each in shown if isinstance(each, ReadingTaken)]
    assert values[:3] == [0.032, 0.0319, 0.0321]


BY_HAND = """
[station]
name = "a supply read by hand"
[instruments.supply]
driver = "manual"
maximum_voltage = 30.0
maximum_current = 30.0
current_accuracy = { gain = 0.01, source = "assumed for the example" }
voltage_accuracy = { gain = 0.01, source = "assumed for the example" }
"""


def test_a_reading_is_corrected_where_angles_are_asked_for(
    call: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "station.toml").write_text(BY_HAND, encoding="utf-8")
    typed = ("", "", "", "2.8", "cc", "1.2", "", "<", "1", "2.85", "", "0 90 180 270 360", "")
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n".join(typed) + "\n"))
    words = ("--station", "station.toml", "--motor", str(NOTE / "lg-400w.toml"), "--language", "en", "--json")
    status, out, err = call("run", "pole-pairs-static", *words)
    assert status == 0, err
    assert "angles in degrees, separated by spaces; < corrects an earlier reading" in " ".join(err.split())
    result = json.loads(out)
    assert result["parameters"]["pole_pairs"]["value"] == 4.0
    assert len(result["procedures"]["pole-pairs-static"]["findings"]["marked_angles"]) == 4
    (folder,) = (tmp_path / "runs").iterdir()
    (one,) = [each.event for each in read_journal(folder / "journal.jsonl").events if each.kind == "reading_corrected"]
    assert (one.was, one.value, one.typed) == (2.8, 2.85, "2.85")


def test_a_corrected_one_that_contradicts_its_siblings_is_asked_for_again(typed: Typed) -> None:
    lines = (CONNECT, "32 mΩ", "<", "2", "3.19 mΩ", "", "31.9 mΩ", *GOOD[1:])
    status, result, said, events = typed(BEGIN, CONNECT, *GOOD, *lines, *(CONNECT, *GOOD) * 2)
    assert status == 0
    assert "resistance A–B, reading 2 of 3: it is a tenth of the other readings" in said
    assert (result["misfit"], len(of(events, "reading_corrected"))) == ([], 1)
    assert of(events, "repeats_taken")[1]["taken"] == [0.032, 0.0319, 0.0321]
    # What was asked after it is still asked for where it belongs.
    assert "LCR meter, resistance Rs at 20 Hz, B–C, reading 2 of 3" in said


def test_of_two_that_contradict_each_other_both_are_typed_again(
    typed: Typed, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = (BEGIN, *((CONNECT, "32 mΩ", "31.9 mΩ") * 2), CONNECT, "3.2 mΩ", "32 mΩ", "", "32 mΩ", "32.1 mΩ")
    lines = (*lines, CONNECT, "32 mΩ", "32.1 mΩ")
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n".join(lines) + "\n"))
    words = ("--station", str(NOTE / "station.toml"), "--motor", str(NOTE / "lg-400w.toml"), "--language", "zh")
    settings = ("short_correction=false", "winding_temperature=25.0", "repeats=2")
    status, out, err = call(
        "run", "stator-resistance", *words, *(word for one in settings for word in ("--set", one)), "--json"
    )
    assert status == 0
    assert "是其余读数的十倍" in "".join(err.split())
    assert json.loads(out)["misfit"] == []


class Spoilt:
    """A bridge's `measure` whose `odd` readings of the resistance, counted from 1, are ten times too small."""

    def __init__(self, odd: frozenset[int]) -> None:
        self._odd = odd
        self._count = 0
        self._measure = KeysightE4980A.measure

    def __call__(self, bridge: KeysightE4980A, wanted: Wanted = Wanted.BOTH) -> ImpedanceReading:
        reading = self._measure(bridge, wanted)
        if wanted is not Wanted.RESISTANCE:
            return reading
        self._count += 1
        factor = 0.1 if self._count in self._odd else 1.0
        spoilt = vars(reading) | {"resistance": factor * reading.resistance}
        return ImpedanceReading(**spoilt)


@pytest.fixture
def spoilt(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., MeasuredRun]:
    def run(*odd: int) -> MeasuredRun:
        spoil = Spoilt(frozenset(odd))
        monkeypatch.setattr(KeysightE4980A, "measure", lambda self, wanted=Wanted.BOTH: spoil(self, wanted))
        return run_procedures(["stator-resistance"], virtual_motor(), tmp_path, seed=1, settings={}, faults=())

    return run


def events_of(ran: MeasuredRun) -> list[dict[str, Any]]:
    return [json.loads(line) for line in ran.folder.journal.read_text(encoding="utf-8").splitlines()]


def test_an_instrument_s_reading_is_read_once_more_and_left_out(spoilt: Callable[..., MeasuredRun]) -> None:
    ran = spoilt(2)
    taken = of(events_of(ran), "repeats_taken")
    assert [(len(group["taken"]), len(group["left_out"])) for group in taken] == [(3, 1), (3, 0), (3, 0), (3, 0)]
    assert ran.warnings.count("repeats-differ") == 1
    low, high = ran.parameters["stator_resistance"].coverage_interval
    assert low < ran.truth["stator_resistance"] < high


def test_one_that_is_not_borne_out_is_kept_and_told(spoilt: Callable[..., MeasuredRun]) -> None:
    ran = spoilt(2, 4)
    first = of(events_of(ran), "repeats_taken")[0]
    assert (len(first["taken"]), first["left_out"]) == (4, [])
    assert ran.warnings.count("repeats-differ") == 1


@pytest.fixture
def operator(tmp_path: Path) -> Iterator[DistantOperator]:
    with closing(DistantOperator(Interrupts())) as made:
        made.line.announce(tmp_path)
        yield made


def test_at_a_panel_the_same_is_asked_in_words_to_be_translated(operator: DistantOperator, tmp_path: Path) -> None:
    thread, given = asked(lambda: operator.perform(DoubtReading(text("it is a tenth of the other readings"))))
    with Panel(tmp_path) as panel:
        question = panel.question()
        assert (question["kind"], question["lines"][0]["template"]) == ("doubt", "it is a tenth of the other readings")
        assert "yes or no" in panel.answer(question, "perhaps")["refused"]
        panel.answer(question, True)
    thread.join()
    assert given == [True]


def test_a_question_reaches_a_panel_whole(operator: DistantOperator, tmp_path: Path) -> None:
    operator.entry.hear(RepeatStarted(terminals="B–C", number=2, count=3))
    prompt = PersonPrompt(operator, "lcr_meter")
    context = lines((text("at {frequency:g} Hz", frequency=20.0), text("({value:g} Ω is outside)", value=3.0)), " ")
    thread, _ = asked(lambda: prompt.ask(text("resistance Rs"), "Ω", 0.0, 10.0, context))
    with Panel(tmp_path) as panel:
        question = panel.question()
        said = restore_text(question["quantity"]).render()
        assert said == "LCR meter, resistance Rs at 20 Hz (3 Ω is outside), B–C, reading 2 of 3"
        panel.answer(question, "1")
    thread.join()


class Corrected:
    """What was typed in a procedure that goes on; a value of 9 has decided what followed."""

    def __init__(self) -> None:
        self.asked: object = None
        self.values = [TypedReading(1, text("resistance"), "Ω", 0.0, 10.0, 0.3)]

    def readings(self) -> list[TypedReading]:
        return self.values

    def correct(self, reading: TypedReading, value: float, typed: str, by: str) -> Text | None:
        self.asked = (reading.number, value, typed, by)
        return text("it has decided the current") if value == 9.0 else None


def test_at_a_panel_units_are_typed_and_an_earlier_reading_corrected(operator: DistantOperator, tmp_path: Path) -> None:
    typed = operator.entry.corrections = Corrected()
    prompt = PersonPrompt(operator, "lcr_meter")

    def ask() -> object:
        try:
            return prompt.ask(text("resistance Rs"), "Ω", 0.0, 10.0, None)
        except (CorrectedError, RepeatRequestedError) as other:
            return other

    with Panel(tmp_path) as panel:
        operator.entry.hear(RepeatStarted(terminals="B–C", number=1, count=3))
        thread, given = asked(ask)
        question = panel.question()
        assert [(one["number"], one["value"], one["unit"]) for one in question["readings"]] == [(1, 0.3, "Ω")]
        assert question["quantity"]["template"] == "{quantity}, {terminals}, reading {number} of {count}"
        assert "is in V" in panel.answer(question, "31 V")["refused"]
        assert "outside" in panel.correct(question, 1, "11")["refused"]
        assert "is no longer used" in panel.correct(question, 2, "1")["refused"]
        panel.correct(question, 1, "9")
        question = panel.question()
        assert question["uncorrected"]["why"]["template"] == "it has decided the current"
        panel.correct(question, 1, "31 mOhm")
        thread.join()
        assert isinstance(given[0], CorrectedError)
        thread, given = asked(ask)
        panel.send({"id": panel.question()["id"], "repeat": True, "by": "Li Na"})
        thread.join()
        assert "Li Na wants to repeat the procedure from its beginning" in str(given[0])
    assert typed.asked == (1, 0.031, "31 mOhm", "Li Na")
