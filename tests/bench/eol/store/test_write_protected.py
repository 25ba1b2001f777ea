"""Records on a medium, or in a folder, that cannot be written: reading them must work."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from bench.eol.record import MeasuredFigure
from bench.eol.store.database import NotWritableError, open_database, open_for_reading
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from tests.bench.eol.motor_records import motor_record
from tests.command_line import called
from tests.permissions import bound_by_permissions

FIGURE = MeasuredFigure("stator_resistance", 1.5, "Ω", 0.01, 0.02, 1.0, 2.0, Verdict.PASS)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / "medium"
    path.mkdir()
    return path


@contextmanager
def write_protected(folder: Path) -> Iterator[None]:
    for path in folder.iterdir():
        path.chmod(0o444)
    folder.chmod(0o555)
    try:
        with bound_by_permissions():
            yield
    finally:
        folder.chmod(0o755)


def keep(path: Path, *numbers: int) -> None:
    engine = open_database(str(path))
    for number in numbers:
        Records(engine).save(motor_record(number, verdict=Verdict.PASS, measured=(FIGURE,)))
    engine.dispose()


def test_a_file_that_cannot_be_written_is_read_with_its_latest_figures(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "records & more? 1%.sqlite"
    # After 32 motors their figures are in their table; those of one are beside it.
    keep(path, *range(1, 34))
    copy = shutil.copy(path, tmp_path / "records.sqlite")

    def read(file: Path) -> list[tuple[int, str, str]]:
        commands = (
            "stats --json",
            "export --format csv",
            "motors --parameter stator_resistance",
            "labels --batch B1",
            "motor P-0033",
        )
        return [called(capsys, "eol", *command.split(), "--records", str(file)) for command in commands]

    expected = read(copy)
    with write_protected(folder):
        assert read(path) == expected
    assert sorted(each.name for each in folder.iterdir()) == [path.name]
    assert [(code, error) for code, _, error in expected] == [(0, "")] * 5
    assert "P-0033" in expected[2][1]


def test_beside_a_line_that_writes_what_it_wrote_is_read(folder: Path) -> None:
    path = folder / "records.sqlite"
    keep(path, 1)
    line = open_database(str(path))
    Records(line).save(motor_record(2, measured=(FIGURE,)))
    with write_protected(folder):
        engine = open_for_reading(str(path))
        assert [(each.number, len(each.measured)) for each in Records(engine).read()] == [(1, 1), (2, 1)]
        engine.dispose()
    line.dispose()


def test_a_copy_with_a_log_that_was_not_merged_is_not_read_without_it(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "records.sqlite"
    keep(path, 1)
    line = open_database(str(path))
    Records(line).save(motor_record(2))
    for name in ("records.sqlite", "records.sqlite-wal"):
        shutil.copy(tmp_path / name, folder / name)
    line.dispose()
    with write_protected(folder), pytest.raises(NotWritableError, match="with it the files -wal and -shm"):
        open_for_reading(str(folder / "records.sqlite"))
    engine = open_for_reading(str(folder / "records.sqlite"))
    assert Records(engine).count() == 2
    engine.dispose()
