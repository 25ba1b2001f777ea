"""`motorbench eol archive` and `motorbench eol restore`: a batch in one file, and back."""

import shutil
import sys
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from bench.cli.new_file import refuse_existing
from bench.cli.options import Json, Language, RecordsAddress
from bench.cli.output import print_json
from bench.eol.archive.batch_archive import ArchiveSummary, restore_archive, runs_elsewhere, write_archive
from bench.eol.line.batch_log import batch_uid, held_batch, is_measured, owns_record
from bench.eol.store.database import open_database, open_for_reading
from bench.eol.store.faults import StoreError
from bench.eol.store.records import Records
from bench.i18n.errors import InputError, at
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import reason_of, text, text_of


def archive(
    batch: str,
    *,
    out: Annotated[Path, Parameter(name=("--output", "--out"))],
    records: RecordsAddress = "records.sqlite",
    runs: Path = Path("runs"),
    remove: Literal["runs", "all"] | None = None,
    force: bool = False,
    language: Language = "auto",
    json: Json = False,
) -> None:
    """Write a batch's records, plan and runs into one file, which is read again and compared before anything is removed.

    Parameters
    ----------
    batch
        The batch's name.
    out
        The file, a tar compressed by gzip with a manifest of SHA-256.
    runs
        Folder of the batches' folders.
    remove
        What to remove after packing: the folders of the batch's runs, or all, its records too. A motor whose record is removed
        counts as never tested.
    force
        Overwrite the file if it exists.

    """
    refuse_existing(out, force=force)
    engine = open_database(records, existing=True) if remove == "all" else open_for_reading(records)
    try:
        records_there = Records(engine)
        with held_batch(runs / batch) if remove is not None else nullcontext():
            measured = remove is None and is_measured(runs / batch)
            elsewhere = runs_elsewhere(records_there, batch, runs)
            summary = write_archive(engine, batch, runs, out)
            if remove is not None:
                _remove(records_there, batch, runs / batch, records_too=remove == "all")
    except StoreError as error:
        raise InputError(text_of(error)) from None
    finally:
        engine.dispose()
    if json:
        print_json(_plain(out, summary) | {"removed": remove, "runs_elsewhere": elsewhere, "being_measured": measured})
        return
    message = text(
        "batch {batch}, motors: {motors}, files: {files}", batch=batch, motors=summary.motors, files=summary.files
    )
    translate = translator(language_of(language))
    print(at(out, message).render(translate))
    if measured:
        part = text(
            "this batch is being measured: the archive has what was there when it was written. Archive it again when it has ended"
        )
        print(f"motorbench: {part.render(translate)}", file=sys.stderr)
    if elsewhere:
        missing = text(
            "motors whose run is not in {runs} and so not in the archive: {count}; it is elsewhere (see --runs) or was removed",
            runs=runs,
            count=elsewhere,
        )
        print(f"motorbench: {missing.render(translate)}", file=sys.stderr)


def restore(
    file: Path,
    *,
    records: RecordsAddress = "records.sqlite",
    runs: Path = Path("runs"),
    language: Language = "auto",
    json: Json = False,
) -> None:
    """Put an archived batch back: its records and its runs. What is there already stays, a changed archive is refused.

    Parameters
    ----------
    file
        The file that `eol archive` wrote.
    runs
        Folder of the batches' folders.

    """
    engine = open_database(records)
    try:
        summary, restored = restore_archive(file, engine, runs)
    except StoreError as error:
        raise InputError(text_of(error)) from None
    finally:
        engine.dispose()
    if json:
        print_json(_plain(file, summary) | {"restored": restored})
        return
    message = text(
        "batch {batch}, motors: {motors}, of these restored: {restored}, files: {files}",
        batch=summary.batch,
        motors=summary.motors,
        restored=restored,
        files=summary.files,
    )
    print(at(file, message).render(translator(language_of(language))))


def _remove(records: Records, batch: str, folder: Path, *, records_too: bool) -> None:
    uid = batch_uid(folder)
    try:
        if folder.is_dir():
            shutil.rmtree(folder)
    except OSError as error:
        raise InputError(
            text("{folder}: the runs cannot be removed: {error}", folder=folder, error=reason_of(error))
        ) from None
    if records_too:
        records.remove(batch, partial(owns_record, uid))


def _plain(file: Path, summary: ArchiveSummary) -> dict[str, object]:
    return {
        "file": str(file),
        "batch": summary.batch,
        "motors": summary.motors,
        "files": summary.files,
        "size": summary.size,
    }
