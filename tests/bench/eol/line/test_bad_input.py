"""What a line is given that is not right: named, refused, and nothing lost."""

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from bench.eol.line.admission import Admission, RefusedSerial
from bench.eol.line.admission_desk import AdmissionDesk
from bench.eol.line.batch_log import FILE, BatchLog, BatchMotor
from bench.eol.line.line_file import load_line
from bench.eol.line.messages import Task
from bench.eol.line.motor_record import new_folder, run_folders
from bench.eol.line.preparation import prepare
from bench.eol.line.record_writer import RecordWriter, own_records
from bench.eol.line.serial_numbers import generated_serials, serials_of_file
from bench.eol.record import MotorRecord
from bench.eol.store.database import open_database
from bench.eol.store.faults import StoreError
from bench.eol.store.spool import Spool
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError, UsageError
from procedures.core.bench import Role
from tests.bench.eol.line.golden import open_gate
from tests.bench.eol.motor_records import motor_record

IDENTITY = {"name": "b", "plan": "1", "motor": "2", "line": "3", "seed": 0}
REAL = """
[station]
name = "two benches"
[line]
timeout = 5.0
[instruments.lcr_meter]
driver = "keysight-e4980a"
address = "TCPIP0::10.0.0.9::inst0::INSTR"
[sockets.left.instruments.supply]
driver = "keysight-e36300"
address = "TCPIP0::10.0.0.1::inst0::INSTR"
channel = 1
maximum_current = 10.0
[sockets.right.instruments.supply]
driver = "keysight-e36300"
address = "TCPIP0::10.0.0.2::inst0::INSTR"
channel = 1
maximum_current = 10.0
"""


def changed(bench: Any, *pairs: tuple[str, str]) -> Path:
    path: Path = bench.folder / "plan.toml"
    content = path.read_text(encoding="utf-8")
    for old, new in pairs:
        assert old in content
        content = content.replace(old, new, 1)
    path.write_text(content, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("percent = 60.0", "low = 2.0\nhigh = 1.0", "low = 2 is above high = 1"),
        ('parameter = "pole_pairs"', 'parameter = "pole_pears"', "no procedure of the plan gives it"),
        ('parameter = "pole_pairs"', 'parameter = "inertia"', "add the procedure inertia"),
        ('name = "stator-resistance"', 'name = "stator-resistence"', "did you mean stator-resistance"),
        ("repeats = 1", "repeats = 0", "procedure stator-resistance: settings.repeats"),
        ("resistance = 3.0", 'serial = "fixed"', "put the number in"),
        ('name = "pole-pairs-back-emf"', 'name = "pole-pairs-back-emf"\nafter = ["inertia"]', "not listed before it"),
        ("every = 2", "retries = 2", "retries = 2 has no effect with on_failure = 'go_on'"),
        ("low = 4\nhigh = 4", "low = 4.2\nhigh = 4.8", "it is a count, and no whole number lies within 4.2 … 4.8"),
        ("percent = 60.0", "low = 0.016\nhigh = 0.016", "low and high are both 0.016"),
        ("percent = 60.0", 'low = "15 mOm"', "low: '15 mOm': the unit mOm is not known here"),
        ("percent = 60.0", 'low = "15 mH"', "low: '15 mH' is in mH, and Ω is asked for"),
    ],
)
def test_a_plan_that_is_not_right_is_refused_before_anything_begins(
    bench: Any, old: str, new: str, message: str
) -> None:
    with pytest.raises(InputError, match=r"plan\.toml") as refused:
        prepare(changed(bench, (old, new)), "virtual", 1)
    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("pairs", "said"),
    [
        ([], []),
        ([("percent = 60.0", "low = 15.2\nhigh = 16.8")], ["the type's own 0.016 (expected.stator_resistance of"]),
        (
            [('[[limit]]\nparameter = "pole_pairs"\nlow = 4\nhigh = 4\n', "")],
            ["so that only what they refuse is rejected: pole-pairs-back-emf"],
        ),
        (
            [
                ('[[limit]]\nparameter = "stator_resistance"\npercent = 60.0\n', ""),
                ('[[limit]]\nparameter = "pole_pairs"\nlow = 4\nhigh = 4\n', ""),
            ],
            ["there is no [[limit]]: every motor that can be measured passes"],
        ),
    ],
)
def test_limits_that_are_allowed_and_likely_a_mistake_are_told_of(
    bench: Any, pairs: list[tuple[str, str]], said: list[str]
) -> None:
    notes = prepare(changed(bench, *pairs), "virtual", 1).notes
    assert len(notes) == len(said)
    for note, words in zip(notes, said, strict=True):
        assert words in str(note)


def test_a_missing_instrument_is_named(bench: Any) -> None:
    station = bench.folder / "station.toml"
    station.write_text(REAL, encoding="utf-8")
    with pytest.raises(InputError, match=r"pole-pairs-back-emf: it needs \[instruments.dynamometer\]"):
        prepare(bench.request.plan, str(station), None)


def test_a_line_shares_what_stands_outside_its_sockets(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    station.write_text(REAL, encoding="utf-8")
    line = load_line(str(station), None)
    assert [socket.name for socket in line.sockets] == ["left", "right"]
    assert line.shared == {Role.LCR_METER}
    assert line.timeout == 5.0
    stations = [socket.station for socket in line.sockets if socket.station]
    assert [each.entries[Role.SUPPLY].address.split("::")[1] for each in stations] == ["10.0.0.1", "10.0.0.2"]
    with pytest.raises(UsageError, match="has 2"):
        load_line(str(station), 3)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[sockets.left.instruments.supply]", "[instruments.supply]", "either the socket's own or shared"),
        ("[sockets.right.instruments.supply]", "[sockets.right.instruments.suply]", "instruments.suply"),
        ("timeout = 5.0", "timeout = -5.0", "line.timeout"),
        ("timeout = 5.0", "shared = ['lcr_meter']", "line.shared goes with"),
    ],
)
def test_a_line_that_is_not_right_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    station = tmp_path / "station.toml"
    station.write_text(REAL.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_line(str(station), None)


def test_a_shared_supply_is_refused_for_its_guardian(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    shared = REAL.replace("[sockets.left.instruments.supply]", "[instruments.supply]")
    station.write_text(shared[: shared.index("[sockets.right")] + "[sockets.left]\n[sockets.right]\n", encoding="utf-8")
    with pytest.raises(InputError, match="feeds energy and cannot be shared"):
        load_line(str(station), None)


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
    assert admitted(tmp_path, "A1\n", records, person="Wang") == [BatchMotor(1, "A1", 2, "Wang")]


def test_a_resumed_batch_passes_over_what_it_has(tmp_path: Path, records: RecordWriter) -> None:
    records.save(a_record(1, "A1"))
    assert admitted(tmp_path, "A1\nA2\n", records, last=1, finished=["A1"]) == [BatchMotor(2, "A2")]


def test_a_scanner_that_sends_rubbish_does_not_stop_the_line(tmp_path: Path, records: RecordWriter) -> None:
    result = admitted(tmp_path, "\ufeffA1\r\n\r\nA\x1b2\n A3 \n", records)
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


def test_limits_that_strict_guard_bands_close_are_the_station_s(bench: Any) -> None:
    content = bench.request.plan.read_text(encoding="utf-8")
    for old, new in (('"shared"', '"strict"'), ("percent = 60.0", "percent = 0.001"), ("resistance = 3.0", "")):
        content = content.replace(old, new, 1)
    bench.request.plan.write_text(content, encoding="utf-8")
    bench.run(motors=1)
    (record,) = bench.listener.records
    assert record.verdict is Verdict.ERROR
    assert "its uncertainty is too large" in record.cause
    assert "nothing was measured by this plan" in bench.listener.noticed[0]
    bench.run(motors=1, first_serial=2, batch="next")
    told = bench.listener.noticed[1:]
    # At the motor of the first batch, and before the second.
    assert len(told) == 2
    for words in told:
        assert "limit on stator_resistance: " in words
        assert "and 1 are asked for: it will be an error" in words


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


def test_a_database_of_a_newer_schema_is_refused_and_left_alone(bench: Any) -> None:
    path = bench.folder / "records.sqlite"
    open_database(str(path)).dispose()
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE alembic_version SET version_num = '9999'")
        connection.execute("UPDATE compatibility SET least = '9999'")
    with pytest.raises(InputError, match="9999"):
        bench.run()
    assert not (bench.folder / "runs" / "small" / FILE).exists(), "nothing was begun"


def test_a_full_disk_ends_the_batch_and_no_motor_is_called_done(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    full = StoreError("database or disk is full")

    def save(_self: RecordWriter, _record: MotorRecord) -> None:
        raise full

    monkeypatch.setattr("bench.eol.line.record_writer._RETRY_TIME", 0.0)
    monkeypatch.setattr(RecordWriter, "save", save)
    with pytest.raises(StoreError, match="start the batch again"):
        bench.run(motors=2)
    assert bench.listener.records == []
    assert any("is not stored yet" in words for words in bench.listener.troubles)
    monkeypatch.undo()
    bench.run(motors=2)
    with own_records(str(bench.folder / "records.sqlite")) as kept:
        assert sorted(record.number for record in kept.read("small")) == [1, 2]


def test_wrong_names_and_numbers_are_usage_errors(bench: Any) -> None:
    for wrong in (
        {"batch": "../x"},
        {"motors": 0},
        {"motors": 2, "serials": "file.txt"},
        {"sockets": 0},
        {"operator": "terminal"},
    ):
        with pytest.raises(UsageError):
            bench.run(**wrong)
    with pytest.raises(InputError, match="cannot be read"):
        bench.run(motors=None, serials=str(bench.folder / "none.txt"))


def test_a_server_that_is_away_keeps_nothing_from_being_kept(bench: Any) -> None:
    counts, _ = bench.run(motors=1, records="postgresql://nobody@127.0.0.1:9/none")
    assert counts.motors == 1
    assert (counts.waits.for_server, counts.waits.unstored, counts.waits.refused) == (1, 0, ())
    (trouble,) = counts.waits.troubles
    assert "the server accepts no records" in str(trouble.why)
    with own_records(str(bench.folder / "runs" / "records.sqlite")) as kept:
        assert kept.count("small") == 1


def test_sockets_with_relays_of_their_own_and_one_relay_for_two_is_refused(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    relay = 'driver = "beckhoff-bk9000"\naddress = "tcp://10.0.0.9:502"\nroles = ["supply"]\n'
    station.write_text(f"{REAL}\n[sockets.left.watchdog_relays.enable]\n{relay}", encoding="utf-8")
    left, right = (socket.station for socket in load_line(str(station), None).sockets)
    assert left is not None
    assert right is not None
    assert [each.name for each in left.watchdog_relays] == ["enable"]
    assert right.watchdog_relays == ()
    station.write_text(f"{REAL}\n[watchdog_relays.enable]\n{relay}", encoding="utf-8")
    with pytest.raises(
        InputError, match=r"watchdog_relays.enable.address: tcp://10.0.0.9:502 is the address of enable too"
    ):
        load_line(str(station), None)


def test_a_virtual_socket_has_a_fixture_and_the_type_s_six_step_drive(bench: Any) -> None:
    plan = changed(bench, ('name = "stator-resistance"', 'name = "insulation-resistance"'))
    content = plan.read_text(encoding="utf-8").replace('repeats = 1, aperture = "SHOR", winding_temperature = 25.0', "")
    content = content.replace(
        'parameter = "stator_resistance"\npercent = 60.0', 'parameter = "insulation_resistance"\nlow = 1e8'
    )
    plan.write_text(content, encoding="utf-8")
    assert prepare(plan, "virtual", 1).plan.checks[0].name == "insulation-resistance"
    with pytest.raises(InputError, match="insulation_tester, which the virtual bench does not have"):
        prepare(plan, "virtual", 1, "virtual")
    plan.write_text(content.replace("insulation-resistance", "no-load-current-six-step"), encoding="utf-8")
    with pytest.raises(InputError):
        prepare(plan, "virtual", 1)
    six_step = (
        '[plan]\nname = "six"\nmotor = "92bl-30-25l"\n[[procedure]]\nname = "no-load-current-six-step"\n'
        '[[procedure]]\nname = "hall-sensors"\n'
    )
    plan.write_text(six_step, encoding="utf-8")
    assert [check.name for check in prepare(plan, "virtual", 1).plan.checks] == [
        "no-load-current-six-step",
        "hall-sensors",
    ]
