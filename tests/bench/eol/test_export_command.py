"""Records that go to other programs and come back."""

import csv
import io
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from junitparser import Error, Failure, JUnitXml

from bench.cli.main import main
from bench.eol.exports.csv_file import harmless, write_csv
from bench.eol.exports.json_lines import write_json_lines
from bench.eol.exports.junit import write_junit
from bench.eol.exports.parquet import write_parquet
from bench.eol.record import CheckRecord, MeasuredFigure, MotorRecord
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from tests.bench.eol.motor_records import NOON, motor_record
from tests.command_line import called

WRITERS = {"csv": write_csv, "jsonl": write_json_lines, "junit": write_junit, "parquet": write_parquet}


def original(cell: str) -> str:
    """Return the words of a cell."""
    return cell[1:] if cell.startswith("'") else cell


def read_json_line(line: str | bytes) -> MotorRecord:
    """Return the record of a line."""
    content = json.loads(line)
    missing = {
        "value": math.nan,
        "standard_uncertainty": math.nan,
        "expanded": math.nan,
        "low": -math.inf,
        "high": math.inf,
    }
    measured = tuple(
        MeasuredFigure(
            **{**figure, **{name: none for name, none in missing.items() if figure[name] is None}}
            | {"verdict": Verdict(figure["verdict"])}
        )
        for figure in content["measured"]
    )
    checks = tuple(CheckRecord(**{**check, "verdict": Verdict(check["verdict"])}) for check in content["checks"])
    times = {name: datetime.fromisoformat(content[name]) for name in ("started", "ended")}
    return MotorRecord(
        **{**content, **times, "verdict": Verdict(content["verdict"]), "measured": measured, "checks": checks}
    )


def record(number: int = 1, **changes: Any) -> MotorRecord:
    created = motor_record(
        number,
        measured=(
            MeasuredFigure("flux_linkage", math.nan, "V·s/rad", math.nan, math.nan, -math.inf, math.inf, Verdict.ERROR),
            MeasuredFigure("inertia", 7.1e-5, "kg·m²", 1e-7, 2e-7, 5e-5, 7e-5, Verdict.FAIL),
            MeasuredFigure("stator_resistance", 0.016, "Ω", 1e-5, 2e-5, 0.014, math.inf, Verdict.PASS),
        ),
        checks=(
            CheckRecord("inertia", 1, Verdict.ERROR, 2.5, "no reply"),
            CheckRecord("inertia", 2, Verdict.FAIL, 2.0),
        ),
        cause="inertia",
        waveforms={"waveforms/0001.h5": "a" * 64},
    )
    return replace(created, **changes)


@pytest.fixture
def export(
    records: Records, reference: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, Path, str]]:
    def run(form: str, *batches: str, out: str = "out.file") -> tuple[int, Path, str]:
        wanted = ("--records", reference, "--format", form, "--out", str(tmp_path / out))
        code, shown, err = called(capsys, "eol", "export", *batches, *wanted)
        return code, tmp_path / out, shown + err

    return run


def test_json_lines_come_back_as_they_were(records: Records, export) -> None:
    created = [record(n, batch="B1" if n % 2 else "B2") for n in range(1, 6)]
    for each in created:
        records.save(each)
    code, path, printed = export("jsonl", "B1")
    assert (code, printed) == (0, f"{path}: motors: 3\n")
    with path.open("rb") as file:
        assert [repr(read_json_line(line)) for line in file] == [repr(each) for each in created if each.batch == "B1"]


def test_batches_longer_than_what_is_read_at_once(records: Records, export, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.eol.store.records._AT_ONCE", 3)
    for n in range(1, 11):
        records.save(record(n, batch="B1" if n != 4 else "B2"))
    lines = export("jsonl", "B1")[1].read_text(encoding="utf-8").splitlines()
    assert [json.loads(line)["number"] for line in lines] == [1, 2, 3, 5, 6, 7, 8, 9, 10]


def test_parquet_keeps_types_and_figures(records: Records, export) -> None:
    records.save(record())
    records.save(record(2, measured=(), verdict=Verdict.ABORTED))
    table = pq.read_table(export("parquet")[1]).to_pylist()
    assert [row["parameter"] for row in table] == ["flux_linkage", "inertia", "stator_resistance", None]
    assert table[0]["started"] == NOON
    assert (table[0]["value"], table[1]["value"], table[2]["high"]) == (None, 7.1e-5, None)
    assert (table[3]["motor_verdict"], table[3]["first_pass"], table[3]["person"]) == ("aborted", False, "王工")


def test_csv_keeps_every_digit(records: Records, export) -> None:
    records.save(record(measured=(MeasuredFigure("r", 0.1 + 0.2, "Ω", 1e-300, 0.0, 0.0, math.inf, Verdict.PASS),)))
    with export("csv")[1].open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    assert (float(row["value"]), float(row["standard_uncertainty"]), row["high"]) == (0.1 + 0.2, 1e-300, "")
    assert datetime.fromisoformat(row["started"]) == NOON


@pytest.mark.parametrize(
    "words",
    ['=HYPERLINK("http://x")', "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "\n=1", "＝1", "－1", "'=1", "plain", ""],
)
def test_no_cell_is_a_formula(words: str) -> None:
    file = io.BytesIO()
    write_csv([record(person=words, cause=words)], file)
    rows = list(csv.DictReader(io.StringIO(file.getvalue().decode("utf-8"), newline="")))
    assert original(rows[0]["person"]) == words
    for row in rows:
        assert not any(cell.startswith(("=", "+", "@", "\t", "\r", "\n", "＝", "－")) for cell in row.values())
        assert not row["person"].startswith("-")


@given(st.text(st.characters(codec="utf-8")))
def test_words_come_back_from_a_cell(words: str) -> None:
    assert original(harmless(words)) == words


def test_junit_says_what_failed_and_by_which_limits(records: Records, export) -> None:
    records.save(record())
    records.save(record(2, measured=record().measured[2:], checks=(), verdict=Verdict.PASS, first_pass=True, cause=""))
    records.save(record(3, measured=(), verdict=Verdict.ERROR))
    records.save(record(4, measured=(), checks=(), verdict=Verdict.ABORTED, cause="stopped by Wang"))
    suites = list(JUnitXml.fromfile(str(export("junit")[1])))
    assert [(s.name, s.tests, s.failures, s.errors) for s in suites] == [
        ("B1 P-0001", 3, 1, 1),
        ("B1 P-0002", 1, 0, 0),
        ("B1 P-0003", 1, 1, 0),
        ("B1 P-0004", 1, 0, 1),
    ]
    cases = {case.name: case for case in suites[0]}
    assert isinstance(cases["flux_linkage"].result[0], Error)
    (failure,) = cases["inertia"].result
    assert isinstance(failure, Failure)
    assert failure.message == "inertia fail: 7.1e-05 kg·m² ± 2e-07 (95 %); limits 5e-05 … 7e-05 kg·m²"
    assert cases["stator_resistance"].is_passed
    assert {p.name: p.value for p in suites[0].properties()}["serial_number"] == "P-0001"
    assert [case.result[0].message for case in suites[3]] == ["stopped by Wang"]


@given(st.text())
def test_any_words_make_well_formed_xml(words: str) -> None:
    file = io.BytesIO()
    write_junit(
        [record(person=words, cause=words, measured=(), checks=(CheckRecord("r", 1, Verdict.FAIL, 1.0, words),))], file
    )
    (suite,) = JUnitXml.fromstring(file.getvalue())
    assert (suite.tests, suite.failures) == (1, 1)


@pytest.mark.parametrize("form", WRITERS)
def test_what_is_read_is_written_before_more_is_read(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.eol.exports.parquet._GROUP", 30)
    given_out = 0

    def many() -> Iterator[MotorRecord]:
        nonlocal given_out
        for n in range(1, 101):
            given_out = n
            yield record(n)

    class Watching(io.BytesIO):
        seen: tuple[int, ...] = ()

        def write(self, data: Any) -> int:
            self.seen = (*self.seen, given_out)
            return super().write(data)

    file = Watching()
    assert WRITERS[form](many(), file) == 100
    assert any(0 < seen < 50 for seen in file.seen)


def test_a_file_is_whole_or_not_there(records: Records, export, tmp_path: Path) -> None:
    records.save(record())
    before = sorted(tmp_path.iterdir())
    assert export("csv", "B9")[2] == "motorbench: no batch is named 'B9'; the batches are: B1\n"
    assert "cannot be written: there is no such file" in export("csv", out="no/such/x.csv")[2]
    assert sorted(tmp_path.iterdir()) == before


def test_without_a_file_the_records_go_to_standard_output(records: Records, reference: str, capfdbinary) -> None:
    records.save(record())
    with pytest.raises(SystemExit):
        main(["eol", "export", "--records", reference, "--format", "jsonl"])
    (line,) = capfdbinary.readouterr().out.splitlines()
    assert repr(read_json_line(line)) == repr(record())
    with pytest.raises(SystemExit) as stop:
        main(["eol", "export", "--records", reference, "--format", "parquet"])
    assert stop.value.code == 2
