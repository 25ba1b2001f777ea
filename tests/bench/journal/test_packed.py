"""Packed journals give back every byte, whatever they hold, and say where they are none."""

import hashlib
import lzma
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.eol.line.batch_log import FILE, BatchLog, held_batch
from bench.i18n.errors import FileError
from bench.journal.packed import is_journal, open_journal, pack, packed_path, unpack
from tests.command_line import called


def chained(count: int) -> bytes:
    lines, previous = [], ""
    for n in range(1, count + 1):
        data = f'{{"instrument":"supply","value":{{"time":{n / 3!r},"value":{n % 7}}}}}'
        line = (
            f'{{"n":{n},"wall":"2026-11-24T06:27:{n % 60:02d}.{n:06d}+00:00","time":{n / 3!r},"kind":"reading",'
            f'"data":{data},"previous":"{previous}"}}'
        )
        lines.append(line)
        previous = hashlib.sha256(line.encode()).hexdigest()
    return "".join(f"{line}\n" for line in lines).encode()


def packed_and_back(folder: Path, content: bytes) -> bytes:
    journal = folder / "journal.jsonl"
    packed_path(journal).unlink(missing_ok=True)
    journal.write_bytes(content)
    pack(journal)
    assert not journal.exists()
    assert is_journal(journal)
    with open_journal(journal) as file:
        read = file.read()
    unpack(journal)
    assert journal.read_bytes() == read
    assert not packed_path(journal).exists()
    return read


@given(content=st.binary(max_size=400))
def test_any_content_comes_back(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    assert packed_and_back(tmp_path_factory.mktemp("any"), content) == content


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"", b""),
        (b'"time":1.0', b'"time":01.0'),
        (b"+00:00", b"+01:00"),
        (b"supply", b"a:~b"),
        (b'"n":7,', b'"n":8,'),
        (b'"kind":"reading"', b'"kind":"a reading"'),
        (b'"kind":"reading"', b'"kind":"setting"'),
        (b"\n", b"\r\n"),
    ],
)
def test_a_journal_comes_back_also_where_a_line_is_unusual(tmp_path: Path, old: bytes, new: bytes) -> None:
    content = chained(50).replace(old, new, 3) if old else chained(50)
    assert packed_and_back(tmp_path, content) == content
    torn = content[:-20]
    assert packed_and_back(tmp_path, torn) == torn


def test_what_fits_one_block_of_the_disk_is_packed_quickly_and_the_rest_as_small_as_can_be(tmp_path: Path) -> None:
    few, many = chained(100), chained(1500)
    assert packed_and_back(tmp_path, few) == few
    assert packed_and_back(tmp_path, many) == many
    pack(journal_of(tmp_path, few))
    assert packed_path(tmp_path / "journal.jsonl").stat().st_size <= 4096
    packed_path(tmp_path / "journal.jsonl").unlink()
    pack(journal_of(tmp_path, many))
    assert packed_path(tmp_path / "journal.jsonl").stat().st_size < len(many) / 10


def journal_of(folder: Path, content: bytes) -> Path:
    journal = folder / "journal.jsonl"
    journal.write_bytes(content)
    return journal


def test_what_a_line_gives_again_is_not_kept(tmp_path: Path) -> None:
    journal = tmp_path / "journal.jsonl"
    journal.write_bytes(chained(700))
    pack(journal)
    # Each hash alone would be 32 bytes that nothing shortens.
    assert packed_path(journal).stat().st_size < 700 * 16


@pytest.mark.parametrize(
    "change", [lambda c: c[:-9], lambda c: c[:200] + b"x" + c[201:], lambda c: b"x" + c, lambda c: c + c]
)
def test_a_packed_journal_that_was_changed_is_refused(tmp_path: Path, change: "object") -> None:
    journal = tmp_path / "journal.jsonl"
    journal.write_bytes(chained(50))
    pack(journal)
    packed_path(journal).write_bytes(change(packed_path(journal).read_bytes()))  # type: ignore[operator]
    with pytest.raises(FileError, match="no packed journal"):
        open_journal(journal)
    with pytest.raises(FileNotFoundError):
        open_journal(tmp_path / "none" / "journal.jsonl")


def test_a_journal_that_was_packed_in_its_own_order_is_read(tmp_path: Path) -> None:
    first = b'{"n":1,"wall":"2000-01-01T00:00:07.000000+00:00","time":0.5,"kind":"reading","data":{"time":0.5},"previous":""}'
    short = [b'7000000,0.5,"kind":"reading","data":{"time":~}', b"!by hand", b"!"]
    packed = b"motorbench journal, packed 1\n" + lzma.compress(b"\n".join(short))
    packed_path(tmp_path / "journal.jsonl").write_bytes(packed)
    with open_journal(tmp_path / "journal.jsonl") as file:
        assert file.read() == first + b"\nby hand\n"


@pytest.mark.parametrize(
    "parts", [b"", b"x", b"-1", b"2\n!\n!\nonly one", b"1\n!\na\nmuch", b"1\nreading\n5", b"1\nreading\nx\n0\nz"]
)
def test_what_no_journal_comes_to_is_refused(tmp_path: Path, parts: bytes) -> None:
    packed_path(tmp_path / "journal.jsonl").write_bytes(b"motorbench journal, packed 2\n" + lzma.compress(parts))
    with pytest.raises(FileError, match="no packed journal"):
        open_journal(tmp_path / "journal.jsonl")


def test_there_is_nothing_to_pack(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = called(capsys, "eol", "pack", "--runs", str(tmp_path))
    assert code == 2
    assert "contains no batches" in err
    batch = tmp_path / "B1"
    batch.mkdir()
    (batch / FILE).write_text("")
    code, _, err = called(capsys, "eol", "pack", "B2", "--runs", str(tmp_path))
    assert code == 2
    assert "contains no batch B2; the batches are: B1" in err


def test_a_batch_that_is_being_measured_packs_its_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("B1", "B2"):
        BatchLog(tmp_path / name, {}).close()
    with held_batch(tmp_path / "B1"):
        assert called(capsys, "eol", "pack", "--runs", str(tmp_path))[0] == 0
        code, _, err = called(capsys, "eol", "pack", "B1", "--runs", str(tmp_path))
        assert code == 1
        assert "another process is measuring this batch" in err
