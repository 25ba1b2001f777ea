"""A batch in one file: its records, its plan, its runs' folders, and a manifest with the SHA-256 of each."""

import hashlib
import io
import json
import os
import tarfile
from collections.abc import Container, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from tempfile import TemporaryFile
from typing import IO, Any

from sqlalchemy import Engine

from bench.eol.archive.run_among import run_among
from bench.eol.line.batch_log import batch_uid, owns_record
from bench.eol.record import MotorRecord
from bench.eol.store.batch_plans import BatchPlan, keep_plan, plans_of
from bench.eol.store.records import Records
from bench.eol.store.spooled_form import record_content, record_of_content
from bench.i18n.errors import FileError, InputError
from bench.journal.disk import sync_folder, write_file
from bench.journal.encoding import dumps, to_bytes
from bench.journal.errors import RecordError
from drivers.interfaces.text import reason_of, text

#: Of the file's form; a later one gets another number.
_VERSION = 1
_MANIFEST, _RECORDS, _PLANS, _RUNS = "manifest.json", "records.jsonl", "plans.json", "runs"
#: No part of an archive but the runs' own files is longer than this (bytes).
_LONGEST = 1 << 31


@dataclass(frozen=True)
class ArchiveSummary:
    """Content of an archive: the batch, how many motors' records, how many files of runs, their bytes as they were."""

    batch: str
    motors: int
    files: int
    size: int


def own_records_of(records: Records, batch: str, runs: Path) -> Iterator[MotorRecord]:
    """Give the records of the batch that is among these runs; where it is not, those of every batch of its name."""
    uid = batch_uid(runs / batch)
    return (record for record in records.read(batch) if owns_record(uid, record.number, record.identifier))


def runs_elsewhere(records: Records, batch: str, runs: Path) -> int:
    """Return of how many motors of a batch the run's folder is not among these runs, although they have one."""
    own = own_records_of(records, batch, runs)
    return sum(bool(record.run) and not run_among(runs, record).is_dir() for record in own)


def write_archive(engine: Engine, batch: str, runs: Path, out: Path) -> ArchiveSummary:
    """Write a batch into a file that is on the disk when this returns, and read it again.

    Raises InputError where there is no batch, it cannot be written, or the file holds runs that are not among these any more.
    """
    records = Records(engine)
    if not records.count(batch):
        raise InputError(
            text("no batch is named {name!r}; the batches are: {names}", name=batch, names=records.batches()[:20])
        )
    if not any(own_records_of(records, batch, runs)):
        raise InputError(
            text(
                "{folder}: the records of the name {name} are all of another batch, whose runs are not here; name its folder of runs "
                "(--runs)",
                folder=runs / batch,
                name=batch,
            )
        )
    part = out.with_name(f".{out.name}.part")
    try:
        with tarfile.open(part, "w:gz", compresslevel=6) as tar:
            digests: dict[str, str] = {}
            motors = 0
            with TemporaryFile(dir=part.parent) as lines:
                for record in own_records_of(records, batch, runs):
                    lines.write(to_bytes(dumps(record_content(record))) + b"\n")
                    motors += 1
                _add(tar, digests, _RECORDS, lines)
            with engine.connect() as connection:
                plans = [asdict(plan) for plan in plans_of(connection, batch)]
            _add(tar, digests, _PLANS, io.BytesIO(to_bytes(json.dumps(plans, ensure_ascii=False))))
            folder = runs / batch
            size = 0
            for file in sorted(path for path in folder.rglob("*") if path.is_file()):
                name = str(PurePosixPath(_RUNS, batch, *file.relative_to(folder).parts))
                with file.open("rb") as content:
                    size += _add(tar, digests, name, content)
            manifest = {
                "version": _VERSION,
                "batch": batch,
                "archived": datetime.now(UTC).isoformat(timespec="seconds"),
                "motors": motors,
                "files": digests,
            }
            _add(tar, {}, _MANIFEST, io.BytesIO(to_bytes(json.dumps(manifest, ensure_ascii=False, indent=1))))
        summary = ArchiveSummary(batch, motors, len(digests) - 2, size)
        if read_archive(part) != summary:
            raise InputError(text("{out}: the file that was read back differs from what was written", out=out))
        if lost := _only_in(out, digests):
            raise InputError(
                text(
                    "{out}: it holds files of runs that are no longer in {runs}, such as {names}, and it is not overwritten; "
                    "give another file",
                    out=out,
                    runs=runs,
                    names=lost[:3],
                )
            )
        with part.open("rb") as written:
            os.fsync(written.fileno())
        part.replace(out)
        sync_folder(out.parent)
    except OSError as error:
        raise InputError(text("{out} cannot be written: {error}", out=out, error=reason_of(error))) from error
    finally:
        part.unlink(missing_ok=True)
    return summary


def read_archive(path: Path) -> ArchiveSummary:
    """Return what an archive holds, every part of it compared with the manifest. Raises FileError for one that is not whole."""
    with _opened(path) as tar:
        manifest = _manifest(path, tar)
        seen, size = dict[str, str](), 0
        for member in tar:
            if member.isfile() and member.name != _MANIFEST:
                with _member(tar, member) as content:
                    seen[member.name] = hashlib.file_digest(content, "sha256").hexdigest()  # type: ignore[arg-type]
                size += member.size if member.name not in (_RECORDS, _PLANS) else 0
    wrong = sorted({name for name in {*seen, *manifest["files"]} if seen.get(name) != manifest["files"].get(name)})
    if wrong:
        raise FileError(
            text("{path}: {names} differ from the archived files; nothing was restored", path=path, names=wrong[:5])
        )
    return ArchiveSummary(str(manifest["batch"]), manifest["motors"], len(seen) - 2, size)


def restore_archive(path: Path, engine: Engine, runs: Path) -> tuple[ArchiveSummary, int]:
    """Put an archive's runs and records back; return what it holds, and how many of the records were not there.

    What is there already stays. Raises FileError for an archive that is not whole, InputError where a file of the runs is there
    with another content, or cannot be written; then no record was restored.
    """
    summary = read_archive(path)
    with _opened(path) as tar:
        for member in tar:
            if member.isfile() and member.name.startswith(f"{_RUNS}/{summary.batch}/"):
                _put_back(runs, member, _content(tar, member))
    # The archive may be deleted once its records are back.
    os.sync()
    restored = 0
    records = Records(engine)
    for record in _records(path):
        restored += records.save(record)
    with engine.begin() as connection:
        for plan in _plans(path):
            keep_plan(connection, plan)
    return summary, restored


def _only_in(path: Path, files: Container[str]) -> list[str]:
    """Return the files of runs in an archive that are not among `files`; none where it is no archive."""
    if not path.is_file():
        return []
    try:
        with _opened(path) as tar:
            return [name for name in _manifest(path, tar)["files"] if name not in files]
    except FileError:
        return []


def _put_back(runs: Path, member: tarfile.TarInfo, content: bytes) -> None:
    target = runs.joinpath(*PurePosixPath(member.name).parts[1:])
    try:
        if not target.resolve().is_relative_to(runs.resolve()):
            raise InputError(text("{name}: lies outside the folder of the runs", name=member.name))
        if target.exists():
            if target.read_bytes() == content:
                return
            raise InputError(
                text(
                    "{target}: already exists with other content; restore to another folder with --runs", target=target
                )
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        write_file(target, content, durable=False)
    except RecordError as error:
        raise InputError(text("{brief}. {remedy}", brief=error.brief, remedy=error.remedy)) from error
    except OSError as error:
        raise InputError(text("{target} cannot be written: {error}", target=target, error=reason_of(error))) from error


class _Hashed:
    """A file whose bytes are hashed as they are read."""

    def __init__(self, content: IO[bytes]) -> None:
        self._content = content
        self.digest = hashlib.sha256()

    def read(self, size: int) -> bytes:
        """Return the next bytes."""
        chunk = self._content.read(size)
        self.digest.update(chunk)
        return chunk


def _add(tar: tarfile.TarFile, digests: dict[str, str], name: str, content: IO[bytes]) -> int:
    """Add a file's content, a piece at a time; return its bytes."""
    member = tarfile.TarInfo(name)
    # What is added to the file meanwhile is left out.
    member.size = content.seek(0, io.SEEK_END)
    content.seek(0)
    member.mtime = int(datetime.now(UTC).timestamp())
    hashed = _Hashed(content)
    tar.addfile(member, hashed)  # type: ignore[arg-type]
    digests[name] = hashed.digest.hexdigest()
    return member.size


@contextmanager
def _opened(path: Path) -> Iterator[tarfile.TarFile]:
    try:
        with tarfile.open(path, "r:gz") as tar:
            yield tar
    except (tarfile.TarError, EOFError, OSError, ValueError, KeyError, TypeError) as error:
        message = reason_of(error) if isinstance(error, OSError) else str(error)
        raise FileError(text("{path}: not an archive of a batch: {error}", path=path, error=message)) from None


def _manifest(path: Path, tar: tarfile.TarFile) -> dict[str, Any]:
    manifest = json.loads(_content(tar, tar.getmember(_MANIFEST)))
    if manifest["version"] != _VERSION:
        raise FileError(
            text("{path}: made by a newer motorbench (form {version})", path=path, version=manifest["version"])
        )
    batch = manifest["batch"]
    if not isinstance(batch, str) or "/" in batch or batch.startswith(".") or not isinstance(manifest["files"], dict):
        raise ValueError("its manifest names no batch")
    return {**manifest, "motors": int(manifest["motors"])}


def _member(tar: tarfile.TarFile, member: tarfile.TarInfo) -> IO[bytes]:
    file = tar.extractfile(member)
    if file is None or member.size > _LONGEST:
        raise ValueError(f"{member.name} cannot be read")
    return file


def _content(tar: tarfile.TarFile, member: tarfile.TarInfo) -> bytes:
    with _member(tar, member) as file:
        return file.read()


def _records(path: Path) -> Iterator[MotorRecord]:
    with _opened(path) as tar, _member(tar, tar.getmember(_RECORDS)) as lines:
        for line in lines:
            yield record_of_content(json.loads(line))


def _plans(path: Path) -> list[BatchPlan]:
    with _opened(path) as tar:
        return [BatchPlan(**entry) for entry in json.loads(_content(tar, tar.getmember(_PLANS)))]
