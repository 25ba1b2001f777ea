"""`motorbench eol motor`: one motor's tests, and what changed from each to the next."""

import json
import math
from datetime import timedelta

import pytest
from sqlalchemy import Engine, update

from bench.eol.record import MeasuredFigure
from bench.eol.store.earlier_tests import earlier_tests
from bench.eol.store.records import Records
from bench.eol.store.schema import MOTOR
from bench.eol.verdict import Verdict
from tests.bench.eol.motor_records import NOON, motor_record
from tests.command_line import called


def figure(name: str, value: float, verdict: Verdict) -> MeasuredFigure:
    return MeasuredFigure(name, value, "Ω", 0.0001, 0.0002, 0.0, 0.017, verdict)


def test_what_changed_since_is_said_in_the_reader_s_language(
    records: Records, reference: str, capsys: pytest.CaptureFixture[str]
) -> None:
    tests = (
        (0.02, Verdict.FAIL),
        (0.016, Verdict.PASS),
        (0.0165, Verdict.PASS),
        (math.nan, Verdict.NOT_JUDGED),
        (math.nan, Verdict.NOT_JUDGED),
    )
    # Kept in another order, for an archive put them back, and the clock was put back.
    for number, (value, verdict) in reversed(list(enumerate(tests))):
        began = NOON - timedelta(hours=number)
        measured = (figure("stator_resistance", value, verdict),)
        records.save(
            motor_record(
                number, serial_number="R-1", test_number=number + 1, started=began, ended=began, measured=measured
            )
        )
    code, out, _ = called(capsys, "eol", "motor", "R-1", "--records", reference, "--language", "en")
    assert code == 0
    changed = [line.strip() for line in out.splitlines() if line.startswith("    ")]
    assert changed == [
        "Stator resistance: 20 → 16 mΩ, fail → pass",
        "Stator resistance: 16 → 16.5 mΩ, pass",
        "Stator resistance: 16.5 → – mΩ, pass → not judged",
    ], "what was withheld twice has not changed"
    chinese = called(capsys, "eol", "motor", "R-1", "--records", reference, "--language", "zh")[1]
    assert "不合格 → 合格" in chinese
    assert "→ pass" not in chinese


def test_a_motor_is_found_however_its_letters_are_sent(
    records: Records, engine: Engine, reference: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Records of earlier versions have serial numbers as they were sent."""
    one, two = "RU\u0308-1", "R\u00dc-1"
    records.save(motor_record(1, serial_number=two))
    with engine.begin() as connection:
        connection.execute(update(MOTOR).values(serial_number=one))
    for typed in (one, two):
        assert [test.number for test in earlier_tests(engine, typed)] == [1]
        code, out, _ = called(capsys, "eol", "motor", typed, "--records", reference)
        assert (code, len(out.splitlines())) == (0, 1)
        code, out, _ = called(capsys, "eol", "motors", "--serial", typed, "--records", reference, "--json")
        assert (code, [each["serial_number"] for each in json.loads(out)["motors"]]) == (0, [one])


def test_a_serial_number_in_other_capitals_is_told(
    records: Records, reference: str, capsys: pytest.CaptureFixture[str]
) -> None:
    records.save(motor_record(1, serial_number="R-1a"))
    code, _, err = called(capsys, "eol", "motor", "r-1A", "--records", reference)
    assert code == 2
    assert "but of 'R-1a', which differs in capitals only" in err


def test_motors_that_all_passed_are_not_said_to_be_none(
    records: Records, reference: str, capsys: pytest.CaptureFixture[str]
) -> None:
    records.save(motor_record(1, verdict=Verdict.PASS))
    code, _, err = called(capsys, "eol", "motors", "--records", reference)
    assert code == 0
    assert "every motor of these records passed" in err
