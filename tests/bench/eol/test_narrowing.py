"""Several batches of one name: what is said of them, and how one of them is chosen, in every command alike."""

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import Engine

from bench.eol.line.batch_log import BatchLog
from bench.eol.record import CheckRecord, MeasuredFigure, MotorRecord
from bench.eol.store import summing
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from tests.bench.eol.motor_records import NOON, motor_record
from tests.command_line import called

Call = Callable[..., tuple[int, str, str]]


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str], reference: str) -> Call:
    return lambda *arguments: called(capsys, "eol", *arguments, "--records", reference)


def drawn(logs: dict[str, BatchLog]) -> Iterator[MotorRecord]:
    """Two stations' batches of one name, interleaved, with motors that both have tested, golden motors and retests."""
    random = np.random.default_rng(7)
    numbers = dict.fromkeys("AB", 0)
    for count in range(240):
        station = "AB"[int(random.integers(2))]
        numbers[station] += 1
        golden = bool(random.random() < 0.05)
        verdict = random.choice([Verdict.PASS, Verdict.PASS, Verdict.PASS, Verdict.FAIL, Verdict.ERROR])
        value = float(random.normal(10.0, 0.1))
        figure = MeasuredFigure("stator_resistance", value, "Ω", 0.01, 0.02, 9.5, 10.5, verdict)
        yield motor_record(
            numbers[station],
            identifier=logs[station].identifier(numbers[station]),
            batch="pump",
            station=station,
            serial_number="G-1" if golden else f"P-{int(random.integers(150)):04d}",
            golden=golden,
            test_number=1 if golden else count + 1,
            started=NOON + timedelta(hours=count),
            verdict=verdict,
            first_pass=verdict is Verdict.PASS and bool(random.random() < 0.9),
            measured=(figure,),
            checks=(CheckRecord("stator-resistance", 1, verdict, 1.0, ""),),
        )


@pytest.fixture
def stations(records: Records, engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """The folders of runs of two stations whose batches have one name; their records are summed up in part."""
    monkeypatch.setattr(summing, "STRETCH", 50)
    monkeypatch.setattr(summing, "GROWTH", 30)
    logs = {station: BatchLog(tmp_path / station / "pump", {}) for station in "AB"}
    for record in drawn(logs):
        records.save(record)
    assert summing.sum_up(engine) > 2
    for log in logs.values():
        log.close()
    return {station: tmp_path / station for station in "AB"}


@pytest.mark.parametrize("chosen", ["station", "days", "runs"])
def test_one_of_them_has_the_statistics_it_would_have_by_a_name_of_its_own(
    call: Call, records: Records, stations: dict[str, Path], tmp_path: Path, chosen: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    from_day, to_day = NOON.date() + timedelta(days=2), NOON.date() + timedelta(days=5)

    def wanted(record: MotorRecord) -> bool:
        if chosen == "days":
            return from_day <= record.started.astimezone().date() <= to_day
        return record.station == "B"

    how = {
        "station": ("--station", "B"),
        "days": ("--since", from_day.isoformat(), "--until", to_day.isoformat()),
        "runs": ("--runs", str(stations["B"])),
    }[chosen]
    apart = open_database(str(tmp_path / "apart.sqlite"))
    for record in records.read():
        Records(apart).save(record if wanted(record) else replace(record, batch="another"))
    apart.dispose()
    by = ("pump", "--by", "station", "date", "--json")
    code, expected, _ = called(capsys, "eol", "stats", *by, "--records", str(tmp_path / "apart.sqlite"))
    assert code == 0
    code, said, err = call("stats", *by, *how)
    assert code == 0, err
    found, reference = json.loads(said), json.loads(expected)
    assert 30 < found["tests"] < 200
    assert found["yield"] == reference["yield"]
    assert found["verdicts"] == reference["verdicts"]
    figures = [each["parameters"]["stator_resistance"] for each in (found, reference)]
    assert figures[0].pop("sums", None) == figures[1].pop("sums", None)
    for name in ("count", "least", "most", "chart", "outside"):
        assert figures[0].get(name) == figures[1].get(name), name
    lines = call("export", "pump", "--format", "jsonl", *how)[1].splitlines()
    kept = [record.identifier for record in records.read() if wanted(record)]
    assert [json.loads(line)["identifier"] for line in lines] == kept
    assert len(call("labels", "--batch", "pump", *how)[1].splitlines()) == len(kept)
    motors = json.loads(call("motors", "pump", "--parameter", "stator_resistance", "--most", "500", *how, "--json")[1])
    assert len(motors["motors"]) == sum(wanted(record) and not record.golden for record in records.read())


def test_every_command_says_that_several_are_taken_together(call: Call, stations: dict[str, Path]) -> None:
    for typed in (
        ("stats", "pump", "--json"),
        ("export", "pump", "--format", "csv"),
        ("labels", "--batch", "pump"),
        ("motors", "pump"),
        ("stats", "pump", "--gauge", "socket"),
    ):
        _, _, err = call(*typed)
        assert (
            "several batches have the name pump and are taken together: station B, plan 00000000, 2026-11-2" in err
        ), typed
        assert "; station A, plan 00000000, 2026-11-2" in err
        assert "To choose one: --station NAME" in err
        _, _, err = call(*typed, "--station", "A")
        assert "several batches" not in err, typed


def test_a_batch_begun_anew_by_its_name_is_told_by_its_numbers(call: Call, records: Records, tmp_path: Path) -> None:
    """Its folder was removed and its records were not: one station, one plan, one name."""
    for number in (1, 2):
        records.save(motor_record(number, identifier=f"first {number}"))
        records.save(motor_record(number, identifier=f"second {number}", started=NOON + timedelta(days=3)))
    _, _, err = call("labels", "--batch", "B1")
    assert "tests: 4 (several batches: their motors' numbers repeat)" in err
    code, said, err = call("labels", "--batch", "B1", "--since", "2026-11-23")
    assert (code, len(said.splitlines()), err) == (0, 2, "")


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        (("--station", "C"), "it has: station B, plan 00000000, 2026-11-21 to"),
        (("--since", "24.11.2026"), "give a day as YYYY-MM-DD"),
        (("--since", "2026-12-02", "--until", "2026-12-01"), "no day lies there"),
        (("--until", "2026-11-01"), "no record that --station, --since, --until and --runs leave"),
        (("--runs", "/nowhere"), "it has no folder of a batch pump"),
    ],
)
def test_what_leaves_nothing_says_what_there_is(
    call: Call, stations: dict[str, Path], typed: tuple[str, ...], said: str
) -> None:
    for command in (
        ("stats", "pump"),
        ("export", "pump", "--format", "csv"),
        ("labels", "--batch", "pump"),
        ("motors", "pump"),
    ):
        code, out, err = call(*command, *typed)
        assert (code, out) == (2, "")
        assert said in err
