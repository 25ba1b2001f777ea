"""A batch's own log and the folders of its motors: what was cut off is found again."""

from pathlib import Path

import pytest

from bench.eol.line.batch_log import FILE, BatchLog, BatchMotor, held_batch
from bench.eol.line.motor_record import new_folder, run_folders
from bench.eol.line.workers.messages import Task
from bench.i18n.errors import InputError

IDENTITY = {"name": "b", "plan": "1", "motor": "2", "line": "3", "seed": 0}


def test_a_batch_log_tells_what_was_cut_off_and_holds_to_its_plan(tmp_path: Path) -> None:
    log = BatchLog(tmp_path, IDENTITY)
    log.begin(BatchMotor(1, "A1"), "1")
    log.begin(BatchMotor(2, "ü\ud800"), "2")
    uid = log.uid
    log.close()
    with (tmp_path / FILE).open("ab") as file:
        file.write(b'{"number": 3, "serial_')
    again = BatchLog(tmp_path, IDENTITY)
    assert (again.uid, again.last, again.resumed) == (uid, 2, True)
    again.begin(BatchMotor(3, "A3"), "1")
    again.close()
    last = BatchLog(tmp_path, IDENTITY)
    assert [motor.number for motor in last.begun()] == [1, 2, 3]
    last.begin(BatchMotor(4, "A1", 2, "Wang"), "1")
    last.begin(BatchMotor(5, "G-1", golden=True), "2")
    assert list(last.begun())[3:] == [BatchMotor(4, "A1", 2, "Wang"), BatchMotor(5, "G-1", golden=True)]
    last.close()
    with pytest.raises(InputError, match="the plan is not the one"):
        BatchLog(tmp_path, {**IDENTITY, "plan": "other"})


def test_no_two_processes_number_the_motors_of_one_batch(tmp_path: Path) -> None:
    log = BatchLog(tmp_path, IDENTITY)
    with pytest.raises(InputError, match="another process is measuring this batch"):
        BatchLog(tmp_path, IDENTITY)
    with pytest.raises(InputError, match="another process is measuring this batch"), held_batch(tmp_path):
        pass
    log.close()
    with held_batch(tmp_path), pytest.raises(InputError, match="another process is measuring this batch"):
        BatchLog(tmp_path, IDENTITY)
    BatchLog(tmp_path, IDENTITY).close()


def test_a_log_that_was_cut_off_in_its_first_line_begins_anew(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text('{"batch": "4f', encoding="utf-8")
    log = BatchLog(tmp_path, IDENTITY)
    uid = log.uid
    log.begin(BatchMotor(1, "A1"), "1")
    log.close()
    again = BatchLog(tmp_path, IDENTITY)
    assert (again.uid, [motor.serial_number for motor in again.begun()]) == (uid, ["A1"])
    again.close()
    (tmp_path / FILE).write_text("something else\n", encoding="utf-8")
    with pytest.raises(InputError, match="this is not a batch's file"):
        BatchLog(tmp_path, IDENTITY)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="the batch's folder cannot be made"):
        BatchLog(tmp_path / "file" / "b", IDENTITY)


def test_a_motor_begun_anew_keeps_what_was_cut_off(tmp_path: Path) -> None:
    task = Task(1234, "A/../1", (), 0.0)
    paths = [new_folder(tmp_path, task).path for _ in range(2)]
    assert run_folders(tmp_path, task) == paths
    assert [path.relative_to(tmp_path).as_posix() for path in paths] == [
        "001/001234-A-..-1",
        "001/001234-A-..-1-2",
    ]


def test_what_is_damaged_in_a_log_holds_nothing_and_keeps_no_batch_from_going_on(tmp_path: Path) -> None:
    log = BatchLog(tmp_path, IDENTITY)
    log.begin(BatchMotor(1, "A1"), "1")
    log.close()
    with (tmp_path / FILE).open("ab") as file:
        file.write(b'{"number": 2, "serial_number": "A\xff"}\n{"number": -5, "serial_number": "A2"}\n' + 512 * b"\0")
    again = BatchLog(tmp_path, IDENTITY)
    assert (again.last, [motor.serial_number for motor in again.begun()]) == (1, ["A1"])
    again.begin(BatchMotor(2, "A3"), "1")
    assert [motor.serial_number for motor in again.begun()] == ["A1", "A3"]
    again.close()
