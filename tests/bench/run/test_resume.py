"""A run goes on only where motor, station, instruments and software are as they were."""

import dataclasses
import errno
import json
import os
from pathlib import Path
from typing import Any

import pytest

from bench.i18n.errors import InputError
from bench.journal.codec import RecordedEvent
from bench.journal.events.run import RunStarted
from bench.journal.journal import Journal
from bench.journal.run_folder import RunFolder
from bench.motor.motor_file import MotorFile, load_motor
from bench.run.resume import begun, check_identities, check_unchanged, left_unsafe
from bench.station.station_file import Station, load_station
from drivers.interfaces import Identity
from procedures.core.bench import Role
from tests.command_line import Call
from tests.journals import event, recorded

STATION = """
# the bench at the window
[station]
name = "Bench 1"
control = "http://127.0.0.1:8000"
[instruments.lcr_meter]
driver = "keysight-e4980a"
address = "TCPIP0::127.0.0.1::hislip0,4880::INSTR"
[instruments.lcr_meter.calibration]
date = 2026-01-01
due = 2027-01-01
certificate = "K-1"
[instruments.tachometer]
driver = "manual"
accuracy = { offset = 0.1, source = "assumed" }
"""
SOFTWARE = {"motorbench": "0.1.0", "numpy": "2.4.6", "python": "3.11.7", "code": "ab" * 32}
RUN = RunFolder(Path("runs/one"))


def station(tmp_path: Path, content: str) -> Station:
    path = tmp_path / "station.toml"
    path.write_text(content, encoding="utf-8")
    return load_station(path)


@pytest.fixture
def motor() -> MotorFile:
    return load_motor("lg-400w")


@pytest.fixture
def began(tmp_path: Path, motor: MotorFile) -> RunStarted:
    before = station(tmp_path, STATION)
    return event(
        "run_started",
        motor={"sha256": motor.sha256, "source": motor.source},
        motor_file=motor.content,
        station={"sha256": before.sha256, "source": before.source},
        station_file=before.content,
        software=SOFTWARE,
    )


def test_a_comment_may_change(tmp_path: Path, began: RunStarted, motor: MotorFile) -> None:
    check_unchanged(RUN, began, motor, station(tmp_path, STATION.replace("window", "door")), SOFTWARE)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "K-1",
            "K-2",
            "instruments.lcr_meter.calibration.certificate was K-1 and is K-2. Restore it, or start a new run",
        ),
        ("due = 2027", "due = 2028", "calibration.due was 2027-01-01 and is 2028-01-01"),
        ("offset = 0.1", "offset = 0.2", "instruments.tachometer.accuracy.offset was 0.1 and is 0.2"),
        (
            STATION[STATION.index("[instruments.tach") :],
            "",
            "instruments.tachometer.driver was manual and is not there",
        ),
        (
            ":8000",
            ":8001",
            "station.control was http://127.0.0.1:8000 .* A bench that was started again has other ports",
        ),
    ],
)
def test_a_station_that_changed_is_refused_with_what_changed(
    tmp_path: Path, began: RunStarted, motor: MotorFile, old: str, new: str, said: str
) -> None:
    with pytest.raises(InputError, match=rf"the station file .* is not the one this run began with .*{said}"):
        check_unchanged(RUN, began, motor, station(tmp_path, STATION.replace(old, new)), SOFTWARE)


def test_a_motor_that_changed_is_refused_with_what_changed(tmp_path: Path, began: RunStarted, motor: MotorFile) -> None:
    content = motor.content.replace("rated_current = 29.0", "rated_current = 30.0")
    other = dataclasses.replace(motor, content=content, sha256="00")
    with pytest.raises(InputError, match=r"the motor file .* nameplate\.rated_current was 29\.0 and is 30\.0"):
        check_unchanged(RUN, began, other, station(tmp_path, STATION), SOFTWARE)
    with pytest.raises(InputError, match="its content"):
        check_unchanged(RUN, dataclasses.replace(began, motor_file="["), other, station(tmp_path, STATION), SOFTWARE)


@pytest.mark.parametrize(
    ("now", "said"),
    [
        ({**SOFTWARE, "numpy": "2.5.0"}, r"numpy was 2\.4\.6 and is 2\.5\.0"),
        ({**SOFTWARE, "code": "cd" * 32}, "code was abababababab… and is cdcdcdcdcdcd…"),
        ({**SOFTWARE, "GTC": "1.5.1"}, r"GTC was not recorded and is 1\.5\.1"),
    ],
)
def test_software_that_changed_is_refused_with_what_changed(
    tmp_path: Path, began: RunStarted, motor: MotorFile, now: dict[str, str], said: str
) -> None:
    with pytest.raises(InputError, match=rf"the software is not the one this run began with: {said}"):
        check_unchanged(RUN, began, motor, station(tmp_path, STATION), now)


def opened(role: str, serial: str) -> RecordedEvent:
    identity = {"manufacturer": "Maker", "model": "M1", "serial_number": serial, "firmware": "2"}
    return recorded("instrument_opened", instrument=role, identity=identity)


@pytest.mark.parametrize(
    ("kinds", "unsafe"),
    [
        ("run_started energising", True),
        ("run_started energising safe run_finished", False),
        ("run_started failed run_finished", True),
        ("run_started energising run_resumed safe run_finished", False),
        ("run_started safe run_finished run_resumed", True),
    ],
)
def test_it_is_known_what_a_session_may_have_left_on(kinds: str, unsafe: bool) -> None:
    def of(kind: str) -> RecordedEvent:
        return recorded("made_safe", outcome=kind) if kind in ("safe", "failed") else recorded(kind)

    assert left_unsafe([of(kind) for kind in kinds.split()]) is unsafe


class Named:
    def __init__(self, serial: str) -> None:
        self.identity = Identity("Maker", "M1", serial, "2")


def test_another_instrument_is_refused(fakes: Any) -> None:
    events = [opened("supply", "7"), opened("supply", "8"), opened("lcr_meter", "1")]
    now: dict[Role, Any] = {Role.SUPPLY: Named("8"), Role.LCR_METER: Named("1"), Role.TACHOMETER: Named("5")}
    check_identities(RUN, events, now)
    now[Role.SUPPLY] = Named("7")
    with pytest.raises(InputError, match="answers as supply than before: it was Maker M1 8 2 and is Maker M1 7 2"):
        check_identities(RUN, events, now)


def test_a_journal_without_a_beginning_is_no_run_to_go_on_with(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)
    with pytest.raises(InputError, match="first event is missing"):
        begun(RunFolder(tmp_path))
    journal.record(event("reading"))
    journal.close()
    with pytest.raises(InputError, match="first event is missing"):
        begun(RunFolder(tmp_path))


def test_a_run_whose_disk_fills_up_ends_safely_and_goes_on_later(
    call: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    real, left = os.write, [15_000]

    def write(file: int, content: Any) -> int:
        if bytes(content[:5]) == b'{"n":':
            left[0] -= len(content)
            if left[0] < 0 and list(tmp_path.glob("runs/*/.reserve")):
                raise OSError(errno.ENOSPC, "No space left on device")
        return real(file, content)

    arguments = ["run", "nameplate", "stator-resistance", "--station", "virtual", "--motor", "lg-400w"]
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", write)
        code, out, err = call(*arguments, "--json")
    told = json.loads(out)
    assert (code, told["status"]) == (1, "failed")
    assert "journal.jsonl cannot be written: no space is left on the disk" in told["cause"]
    assert "continue with --resume" in err
    kinds = [json.loads(line)["kind"] for line in (Path(told["run"]) / "journal.jsonl").read_bytes().splitlines()]
    assert kinds[-1] == "run_finished"
    assert {"record_failed", "made_safe"} <= set(kinds)
    assert call("results", "verify", "latest")[0] == 0
    code, out, _ = call("run", "--resume", "latest", "--json")
    again = json.loads(out)
    assert (code, again["status"], set(again["procedures"])) == (0, "completed", {"nameplate", "stator-resistance"})
    assert call("results", "verify", "latest")[0] == 0


def test_the_wrong_name_of_a_run_gets_a_hint(call: Call, tmp_path: Path) -> None:
    assert "no run was found here" in call("run", "--resume", "latest")[2]
    call("run", "nameplate", "--station", "virtual", "--motor", "lg-400w")
    (folder,) = (tmp_path / "runs").iterdir()
    code, _, err = call("results", folder.name[:-1])
    assert code == 2
    assert f"did you mean {folder.name}?" in err
    assert "motorbench results list --runs runs lists the runs" in err
    assert call("results", "a\0b")[0] == 2


def test_another_virtual_instrument_is_refused_and_nothing_is_written(
    call: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    call("run", "nameplate", "stator-resistance", "--station", "virtual", "--motor", "lg-400w", "--set", "repeats=1")
    (folder,) = (tmp_path / "runs").iterdir()
    journal = folder / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    at = next(number for number, line in enumerate(lines) if b'"procedure_finished"' in line and b"stator" in line)
    journal.write_bytes(b"".join(lines[:at]))
    before = journal.read_bytes()
    monkeypatch.setattr("bench.run.run.check_identities", refuse)
    code, _, err = call("run", "--resume", str(folder))
    assert code == 1
    assert "lcr_meter" in err
    assert journal.read_bytes() == before
    assert not (folder / ".reserve").exists()


def refuse(folder: RunFolder, events: Any, opened: Any) -> None:
    raise InputError(", ".join(role.value for role in opened))
