"""Why a motor did not pass is said in the reader's language, whatever the batch was run in."""

import json
from dataclasses import replace
from typing import Any

import pytest

from bench.eol.record import CheckRecord, MotorRecord
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.store.spooled_form import record_content, record_of_content
from bench.eol.told_causes import cause_of, diagnosis_of, last_causes, told_causes
from bench.eol.verdict import Verdict
from bench.i18n.language import translator
from drivers.interfaces.text import lines, text
from tests.bench.eol.motor_records import motor_record
from tests.command_line import called

CHINESE = translator("zh")
NOT_FOUND = text("{parameter} was not found", parameter=text("Stator resistance"))


def of_a_batch(bench: Any, language: str) -> MotorRecord:
    """The record of a motor whose resistance is far outside, and which has a part at fault."""
    plan = bench.folder / "plan.toml"
    plan.write_text(plan.read_text(encoding="utf-8").replace("percent = 60.0", "low = 1.0\nhigh = 2.0"))
    counts, _ = bench.run(motors=1, language=language)
    assert counts.verdicts["fail"] == 1
    (record,) = bench.listener.records
    assert isinstance(record, MotorRecord)
    return record


@pytest.mark.parametrize("language", ["en", "zh"])
def test_a_batch_of_either_language_is_read_in_both(
    bench: Any, capsys: pytest.CaptureFixture[str], language: str
) -> None:
    record = of_a_batch(bench, language)
    engine = open_database(bench.request.records)
    (kept,) = Records(engine).read()
    engine.dispose()
    assert kept.told == record.told
    said = {"en": cause_of(kept).render(translator("en")), "zh": cause_of(kept).render(CHINESE)}
    assert said[language] == kept.cause
    assert said["en"].startswith("Stator resistance: Stator resistance = ")
    assert "限值" in said["zh"]
    (cause,) = last_causes(kept).values()
    assert cause.render(translator(language)) == next(each.cause for each in kept.checks if each.cause)
    command = ("eol", "motor", kept.serial_number, "--records", bench.request.records)
    for reader, words in said.items():
        faults = lines(diagnosis_of(kept), "; ").render(translator(reader)) if kept.diagnosis else ""
        out = called(capsys, *command, "--language", reader)[1]
        assert f"    {faults or words}" in out.splitlines()
    assert json.loads(called(capsys, *command, "--json")[1])["tests"][0]["cause"] == said["en"]


def test_a_worker_that_died_and_a_brake_are_told_of_in_the_reader_s_language() -> None:
    dead = text("the process of socket {name} {how}", name="1", how=text("was ended by {signal}", signal="SIGKILL"))
    record = motor_record(cause=dead.render(), told=told_causes(dead, (), {}))
    assert cause_of(record) == dead
    assert cause_of(record).render(CHINESE) != record.cause


def test_an_older_record_is_read_in_the_language_of_its_batch() -> None:
    attempts = (CheckRecord("p", 1, Verdict.ERROR, 1.0, "zuerst"), CheckRecord("p", 2, Verdict.ERROR, 1.0, "nochmal"))
    older = motor_record(cause="{warum}", diagnosis="ein Teil; noch eines", checks=attempts)
    assert str(cause_of(older)) == "{warum}"
    assert [str(each) for each in diagnosis_of(older)] == ["ein Teil", "noch eines"]
    assert {name: str(each) for name, each in last_causes(older).items()} == {"p": "nochmal"}
    # And its form in files is what it was.
    content = record_content(older)
    assert "told" not in content["record"]
    assert record_of_content(content) == older
    newer = replace(older, told=told_causes(NOT_FOUND, [NOT_FOUND], {("p", 2): NOT_FOUND}))
    assert record_of_content(json.loads(json.dumps(record_content(newer)))) == newer
    assert {str(cause_of(newer)), *map(str, diagnosis_of(newer)), str(last_causes(newer)["p"])} == {str(NOT_FOUND)}


@pytest.mark.parametrize(
    "told",
    ["{", "[]", '"x"', '{"cause":{"template":"{a.b}","values":{}}}', '{"cause":{"template":"{a}"}}', '{"cause":"x"}'],
)
def test_what_cannot_be_said_is_read_as_it_was_written(told: str) -> None:
    assert str(cause_of(motor_record(cause="why", told=told))) == "why"


def test_a_motor_that_passed_has_nothing_to_tell() -> None:
    assert told_causes(text(""), (), {}) == ""
