"""Calibration entries of a station: read strictly, carried into results, overdue told or refused."""

import io
import json
import re
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from bench.i18n.errors import InputError
from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder
from bench.motor.motor_file import load_motor
from bench.plugins.catalogues import installed
from bench.run.request import RunRequest
from bench.run.run import run
from bench.station.calibration import Calibration
from bench.station.station_file import Station, load_station
from bench.virtual.virtual_station import virtual_station
from drivers.interfaces import Accuracy
from procedures.core.bench import Role
from sim_instruments.bench import ROLES

PAGE = Path(__file__).parents[3] / "docs" / "explanation" / "uncertainty.md"
NOTE = Path(__file__).parents[3] / "docs" / "examples" / "note"
ENTRY = """
[instruments.lcr_meter.calibration]
date = 2026-01-15
due = 2027-01-15
certificate = "K-4711"
"""
MANUAL = '[instruments.lcr_meter]\ndriver = "manual"\n'
BRIDGE = '[instruments.lcr_meter]\ndriver = "keysight-e4980a"\naddress = "TCPIP0::192.0.2.3::inst0::INSTR"\n'
SCOPE = '[instruments.oscilloscope]\ndriver = "keysight-infiniivision"\naddress = "TCPIP0::192.0.2.4::inst0::INSTR"\n'
VALID = Calibration(date(2026, 1, 15), date(2027, 1, 15), "K-4711")


def station(path: Path, *parts: str, overdue: str = "") -> Station:
    file = path / "station.toml"
    file.write_text(f'[station]\nname = "S"\n{overdue}\n' + "".join(parts), encoding="utf-8")
    return load_station(file)


def test_an_entry_is_read_whatever_the_driver(tmp_path: Path) -> None:
    for table in (MANUAL, BRIDGE):
        assert station(tmp_path, table, ENTRY).entries[Role.LCR_METER].calibration == VALID
    assert station(tmp_path, MANUAL).entries[Role.LCR_METER].calibration is None


def test_it_stands_beside_a_drivers_own_accuracies(tmp_path: Path) -> None:
    points = "points = [{ frequency = 20.0, resistance = { gain = 1e-4, source = 'K-4711' } }]\n"
    entry = station(tmp_path, BRIDGE, ENTRY, points).entries[Role.LCR_METER]
    options: Any = entry.options
    assert entry.calibration == VALID
    assert options.calibration[0].resistance == Accuracy(gain=1e-4, source="K-4711")
    channels = "1 = { gain = 1e-3, source = 'K-4711' }\n"
    entry = station(tmp_path, SCOPE, ENTRY.replace("lcr_meter", "oscilloscope"), channels).entries[Role.OSCILLOSCOPE]
    options = entry.options
    assert entry.calibration == VALID
    assert options.calibration == {1: Accuracy(gain=1e-3, source="K-4711")}
    # As before, without an entry.
    alone = "calibration = [{ frequency = 20.0, resistance = { gain = 1e-4 } }]\n"
    entry = station(tmp_path, BRIDGE, alone).entries[Role.LCR_METER]
    options = entry.options
    assert entry.calibration is None
    assert options.calibration[0].frequency == 20.0


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("due = 2027-01-15", "", ["calibration.due is missing", "a date without quotes"]),
        (
            "due = 2027-01-15",
            "duo = 2027-01-15",
            ["unknown key instruments.lcr_meter.calibration.duo", "did you mean due"],
        ),
        ("due = 2027-01-15", 'due = "2027-01-15"', ["calibration.due = '2027-01-15'", "a date without quotes"]),
        ("due = 2027-01-15", "due = 2027-01-15T08:00:00", ["calibration.due =", "a date without quotes"]),
        ("due = 2027-01-15", "due = 2025-01-15", ["due = 2025-01-15 lies before date = 2026-01-15", "on or after"]),
        ('certificate = "K-4711"', 'certificate = ""', ["calibration.certificate = ''", "the certificate's number"]),
        ('certificate = "K-4711"', "certificate = 4711", ["calibration.certificate = 4711", "text in quotes"]),
        ("[instruments", 'overdue = "ignore"\n[instruments', ["station.overdue = 'ignore'", "'warn' or 'refuse'"]),
    ],
)
def test_each_fault_is_named(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    content = MANUAL + ENTRY
    assert old in content
    with pytest.raises(InputError) as error:
        station(tmp_path, content.replace(old, new, 1))
    for part in ["station.toml", *parts]:
        assert part in str(error.value)


def test_an_accuracy_that_no_driver_takes_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"instruments\.lcr_meter\.calibration: manual takes date, due and"):
        station(tmp_path, MANUAL, ENTRY, "1 = { gain = 1e-3 }\n")


def test_the_examples_of_the_page_are_read(tmp_path: Path) -> None:
    entry, expected = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    file = tmp_path / "station.toml"
    file.write_text(entry, encoding="utf-8")
    read = load_station(file)
    assert (read.overdue, read.entries[Role.LCR_METER].calibration) == ("refuse", VALID)
    motor = tmp_path / "motor.toml"
    motor.write_text((NOTE / "lg-400w.toml").read_text(encoding="utf-8") + expected, encoding="utf-8")
    assert load_motor(str(motor)).nameplate.expected == {"stator_resistance": 0.016, "d_axis_inductance": 73e-6}


@pytest.mark.parametrize(
    ("today", "overdue"), [(date(2026, 1, 15), False), (date(2027, 1, 15), False), (date(2027, 1, 16), True)]
)
def test_the_due_day_still_counts(tmp_path: Path, today: date, overdue: bool) -> None:
    read = station(tmp_path, MANUAL, ENTRY)
    found = read.check_calibrations(today, [Role.LCR_METER])
    assert [notice.identifier for notice in found] == ["calibration-overdue"] * overdue
    for part in ("lcr_meter", "K-4711", "2027-01-15") if overdue else ():
        assert part in str(found[0].message)
    assert read.check_calibrations(today, [Role.SUPPLY]) == ()


def test_a_calibration_of_tomorrow_is_refused(tmp_path: Path) -> None:
    read = station(tmp_path, MANUAL, ENTRY)
    with pytest.raises(InputError, match=r"calibration.date = 2026-01-15 lies in the future; allowed .* 2026-01-14"):
        read.check_calibrations(date(2026, 1, 14), [])


def test_the_virtual_bench_claims_no_certificate() -> None:
    made = virtual_station(dict.fromkeys(ROLES, "somewhere"))
    assert all(entry.calibration is None for entry in made.entries.values())
    assert made.check_calibrations(date(2100, 1, 1), made.entries) == ()


def wishes(tmp_path: Path, *, overdue: str = "", resume: RunFolder | None = None) -> RunRequest:
    file = tmp_path / "station.toml"
    content = (NOTE / "station.toml").read_text(encoding="utf-8") + ENTRY
    file.write_text(content.replace("[station]\n", f"[station]\n{overdue}\n"), encoding="utf-8")
    return RunRequest(
        ["stator-resistance"],
        load_motor(str(NOTE / "lg-400w.toml")),
        str(file),
        "en",
        tmp_path / "runs",
        operator="answers",
        answers=NOTE / "answers.toml",
        assignments=["repeats=1", "short_correction=false"],
        resume=resume,
    )


def run_on(day: date, wished: RunRequest) -> tuple[dict[str, Any], RunFolder, str]:
    shown = io.StringIO()
    done = run(wished, installed().procedures, Console(file=shown, width=200), lambda: day)
    return json.loads(done.folder.result.read_text(encoding="utf-8")), done.folder, shown.getvalue()


def test_a_result_carries_the_entries(tmp_path: Path) -> None:
    result, folder, _ = run_on(date(2026, 6, 1), wishes(tmp_path))
    entry = {"date": "2026-01-15", "due": "2027-01-15", "certificate": "K-4711"}
    assert result["station"]["instruments"]["lcr_meter"]["calibration"] == entry
    assert result["station"]["instruments"]["tachometer"]["calibration"] is None
    began = read_journal(folder.journal).events[0].data
    assert began["station"]["instruments"]["lcr_meter"]["calibration"] == entry
    assert "calibration-overdue" not in {warning["id"] for warning in result["warnings"]}


def test_overdue_is_said_first_and_stands_in_the_result(tmp_path: Path) -> None:
    result, folder, shown = run_on(date(2027, 2, 1), wishes(tmp_path))
    assert result["status"] == "completed"
    warning = result["warnings"][0]
    assert (warning["id"], warning["procedure"]) == ("calibration-overdue", None)
    assert "certificate K-4711 of 2026-01-15 was due on 2027-01-15" in warning["message"]
    assert shown.index("calibration-overdue: lcr_meter") < shown.index("§3.2.2/1")
    # Said again by a resumed run, it stands once.
    result, _, _ = run_on(date(2027, 2, 1), wishes(tmp_path, resume=folder))
    assert [warning["id"] for warning in result["warnings"]].count("calibration-overdue") == 1


def test_a_station_may_refuse_what_is_overdue(tmp_path: Path) -> None:
    refusing = wishes(tmp_path, overdue='overdue = "refuse"')
    with pytest.raises(InputError, match=r"lcr_meter.*K-4711 was due on 2027-01-15 and today is 2027-02-01"):
        run_on(date(2027, 2, 1), refusing)
    assert not (tmp_path / "runs").exists()
    assert run_on(date(2027, 1, 15), refusing)[0]["status"] == "completed"
