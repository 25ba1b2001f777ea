"""Serial numbers out of a file, off a scanner and made up: which are admitted, refused and passed over."""

from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from bench.eol.line.admission.admission_desk import AdmissionDesk
from bench.eol.line.admission.next_motor import Admission, RefusedSerial
from bench.eol.line.admission.serial_numbers import generated_serials, serials_of_file
from bench.eol.line.batch_log import BatchMotor
from bench.eol.line.record_writer import RecordWriter
from bench.eol.plan import load_plan
from bench.eol.plans_beside import check_serial
from bench.eol.record import MotorRecord
from bench.eol.store.database import open_database
from bench.eol.store.spool import Spool
from bench.i18n.errors import FileError, InputError, UsageError
from tests.bench.eol.line.golden import open_gate
from tests.bench.eol.motor_records import motor_record


@pytest.fixture
def records(tmp_path: Path) -> Iterator[RecordWriter]:
    writer = RecordWriter(
        open_database(str(tmp_path / "records.sqlite")), Spool(tmp_path / "unstored", "records.sqlite")
    )
    yield writer
    writer.close()


def a_record(number: int, serial: str, batch: str = "b") -> MotorRecord:
    return motor_record(number, identifier=f"{batch}-{number}", batch=batch, serial_number=serial)


def admitted(
    folder: Path,
    lines: str,
    writer: RecordWriter,
    *,
    person: str = "",
    last: int = 0,
    finished: Sequence[str] = (),
) -> list[BatchMotor | RefusedSerial]:
    file = folder / "serials.txt"
    file.write_text(lines, encoding="utf-8")

    def check(serial: str) -> None:
        if not serial.isprintable():
            raise InputError(f"serial number {serial!r}: allowed are up to 64 printable characters")

    desk = AdmissionDesk(writer.register, check, "record-{}".format, lambda _: None, "b", "s", "LG-400W", person=person)
    admitted = []
    with closing(serials_of_file(file)) as serials:
        admission = Admission(serials, [], desk, open_gate(folder), last=last, finished=finished)
        while not admission.ended and (motor := admission.take("1")) is not None:
            admitted.append(motor)
    return admitted


def test_motors_of_earlier_batches_are_refused_unless_a_person_answers(tmp_path: Path, records: RecordWriter) -> None:
    records.save(a_record(7, "A1", batch="last week"))
    first, second = admitted(tmp_path, "A1\nA2\n", records)
    assert isinstance(first, RefusedSerial)
    assert "fail at station S, socket 1" in str(first.why)
    assert "motor 7 of batch last week" in str(first.why)
    assert first.by_person
    assert second == BatchMotor(1, "A2")
    assert admitted(tmp_path, "A1\n", records, person="Wang") == [BatchMotor(1, "A1", 2, "Wang", judged_before=True)]


def test_a_motor_in_a_socket_is_not_taken_in_other_capitals_beside_itself(
    tmp_path: Path, records: RecordWriter
) -> None:
    first, second = admitted(tmp_path, "A1\na1\n", records)
    assert first == BatchMotor(1, "A1")
    assert isinstance(second, RefusedSerial)
    assert "a1 differs in capitals only from A1, which is being measured now" in str(second.why)
    assert [type(each) for each in admitted(tmp_path, "B1\nb1\n", records, person="Wang")] == [BatchMotor] * 2


def test_what_an_input_method_sends_full_width_is_the_same_motor(tmp_path: Path, records: RecordWriter) -> None:
    records.save(a_record(7, "A-1", batch="last week"))
    (refused,) = admitted(tmp_path, "Ａ－１\n", records)
    assert isinstance(refused, RefusedSerial)
    assert "serial number A-1 was tested before" in str(refused.why)
    records.save(a_record(8, "Ｂｕ\u0308", batch="last week"))
    assert [record.serial_number for record in records.records.read("last week")] == ["A-1", "B\u00fc"]


def test_a_resumed_batch_passes_over_what_it_has(tmp_path: Path, records: RecordWriter) -> None:
    records.save(a_record(1, "A1"))
    assert admitted(tmp_path, "A1\nA2\n", records, last=1, finished=["A1"]) == [BatchMotor(2, "A2")]


def test_a_scanner_that_sends_rubbish_does_not_stop_the_line(tmp_path: Path, records: RecordWriter) -> None:
    result = admitted(tmp_path, "\ufeffA1\r\n\r\nA\x1b2\n A3 \t\u3000\u00a0\n\u3000\n", records)
    assert [type(each) for each in result] == [BatchMotor, RefusedSerial, BatchMotor]
    assert result[2] == BatchMotor(2, "A3")


def test_generated_serial_numbers_are_a_list() -> None:
    serials = generated_serials("V{number:03d}", 2)
    assert serials.listed
    assert [serials.take(), serials.take(), serials.take()] == ["V001", "V002", None]
    assert serials.ended


def test_made_up_serial_numbers_go_on_where_another_batch_ended(bench: Any) -> None:
    bench.run(motors=1)
    counts, _ = bench.run(motors=1, first_serial=2, batch="next")
    assert (counts.motors, counts.refused) == (1, 0)
    assert bench.listener.records[-1].serial_number == "V000002"
    with pytest.raises(UsageError, match=r"--first-serial 0: allowed are 1 to"):
        bench.run(motors=1, first_serial=0)
    with pytest.raises(UsageError, match=r"--first-serial 7: only for the motors of --motors N"):
        bench.run(motors=None, first_serial=7)


@pytest.mark.parametrize("length", [4095, 4096, 4099, 8192, 8195])
def test_the_end_of_a_line_that_is_too_long_is_no_serial_number(tmp_path: Path, length: int) -> None:
    path = tmp_path / "serials.txt"
    path.write_text("X" * length + "\nA1\n", encoding="utf-8")
    serials = serials_of_file(path)
    first, second = serials.take(), serials.take()
    assert (first is not None and len(first), second, serials.take()) == (min(length, 4096), "A1", None)
    serials.close()


@pytest.mark.parametrize("content", ["", "\ufeff", "\r\n \n"])
def test_a_list_without_a_serial_number_is_refused(bench: Any, content: str) -> None:
    (bench.folder / "serials.txt").write_text(content, encoding="utf-8")
    with pytest.raises(FileError, match=r"serials\.txt: the file has no serial number; write one a line"):
        bench.run(motors=None, serials=str(bench.folder / "serials.txt"))
    assert not list(bench.request.runs.rglob("batch.jsonl")), "no batch was begun"


def test_a_terminal_that_ends_without_a_serial_number_is_refused(bench: Any) -> None:
    with pytest.raises(UsageError, match="no serial number came before the end of the input"):
        bench.run(motors=None)


@pytest.mark.parametrize("serial", ["A\t1", "\u202eA1", "A" * 300])
def test_what_is_no_serial_number_belongs_to_no_other_plan(bench: Any, serial: str) -> None:
    plan = load_plan(bench.request.plan)
    (bench.folder / "other.toml").write_text(
        '[plan]\nname = "other"\nmotor = "m"\nserial_pattern = "(?s).+"\n', encoding="utf-8"
    )
    with pytest.raises(InputError, match="allowed are up to 64 printable characters") as refused:
        check_serial(plan, serial)
    assert "other" not in str(refused.value)
