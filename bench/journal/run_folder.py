"""The folder of a run."""

import errno
import os
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bench.files.toml_file import nearest
from bench.i18n.errors import FileError, InputError
from bench.journal.disk import write_file
from bench.journal.encoding import indented, to_bytes
from bench.journal.packed import is_journal, packed_path
from drivers.interfaces.text import Text, reason_of, text

#: What a rehearsal's folder holds in place of a run's journal, so that neither is taken for the other.
REHEARSAL = "rehearsal.jsonl"
#: Stands for the run that began last.
LATEST = "latest"
#: Runs that a message names.
_SHOWN = 8
_STAMPED = re.compile(r"\d{8}T\d{6}Z-")


@dataclass(frozen=True)
class RunFolder:
    """One folder a run: the journal, the result, the waveforms."""

    path: Path

    @property
    def journal(self) -> Path:
        """The append-only record; of a run that was packed, where it would be (`open_journal`)."""
        return self.path / "journal.jsonl"

    @property
    def result(self) -> Path:
        """Result made from the journal, as JSON."""
        return self.path / "result.json"

    @property
    def waveforms(self) -> Path:
        """Folder of the samples that the journal refers to."""
        return self.path / "waveforms"

    def photo(self, what: str) -> Path:
        """Return the file of a photo that the run keeps to be shown: of the `motor` or of the `station`."""
        return self.path / f"photo-{what}.jpg"

    @property
    def reserve(self) -> Path:
        """Room that is kept for the end of a run while it goes on."""
        return self.path / ".reserve"

    def remove_if_empty(self) -> None:
        """Remove the folder of a run that did not begin."""
        try:
            self.path.rmdir()
        except OSError as error:
            # An empty folder that cannot be removed harms nobody; what kept the run from beginning is to be told.
            if not isinstance(error, PermissionError) and error.errno not in (
                errno.ENOTEMPTY,
                errno.ENOENT,
                errno.EROFS,
                errno.EIO,
            ):
                raise

    def write_result(self, result: dict[str, Any]) -> None:
        """Write `result.json` durably, completely or not at all. Raises RecordError."""
        write_file(self.result, stored_form(result))


def stored_form(result: dict[str, Any]) -> bytes:
    """Return the content of `result.json`."""
    return to_bytes(indented(result) + "\n")


def new_run_folder(runs: Path, motor: str) -> RunFolder:
    """Make a folder named by the time (UTC) and the motor. Raises InputError where it cannot be made."""
    # File systems take 255 bytes; what a process appends and stamps has to fit beside the name.
    name = re.sub(r"[^\w.-]+", "-", motor).strip("-").lower().encode()[:150].decode(errors="ignore") or "motor"
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    for count in range(1000):
        path = runs / (f"{stamp}-{name}" + (f"-{count + 1}" if count else ""))
        try:
            runs.mkdir(parents=True, exist_ok=True)
            path.mkdir()
        except FileExistsError as error:
            if runs.is_dir():
                continue
            raise InputError(text("{runs}: is a file; give the folder of the runs with --runs", runs=runs)) from error
        except OSError as error:
            raise InputError(
                text(
                    "{path}: the run's folder cannot be made: {strerror}; see --runs",
                    path=path,
                    strerror=reason_of(error),
                )
            ) from None
        return RunFolder(path)
    raise InputError(text("{runs}: too many runs of {name} in one second", runs=runs, name=name))


def existing_run_folder(reference: str, runs: Path) -> RunFolder:
    """Return a run by its folder, by its name under `runs`, or the one begun last for `latest`. Raises FileError for none."""
    for path in (Path(reference), runs / reference):
        # Unlike Path.is_file, these take a name that is too long, too.
        if os.path.isfile(path / "journal.jsonl") or os.path.isfile(packed_path(path / "journal.jsonl")):
            return RunFolder(path)
        if os.path.isfile(path / REHEARSAL):
            raise FileError(
                text(
                    "{path}: this is a rehearsal; nothing was measured, and it cannot be resumed or shown as a run",
                    path=path,
                )
            )
    there = run_folders(runs)
    if reference == LATEST and there:
        return there[-1]
    names = [folder.path.name for folder in there]
    hint = Text("; {near}", {"near": nearest(Path(reference).name, names[-_SHOWN:])}) if names else ""
    raise FileError(
        text(
            "{reference}: no run was found here or under {runs} (a run's folder contains journal.jsonl){hint} — "
            "motorbench results list --runs {runs} lists the runs",
            reference=reference,
            runs=runs,
            hint=hint,
        )
    )


def run_folders(runs: Path) -> list[RunFolder]:
    """Return all runs of a folder, in the order they began by their names; one that must not be entered is known by its name.

    Raises FileError where the folder cannot be read.
    """
    try:
        found = [path for path in runs.iterdir() if is_journal(path / "journal.jsonl") or _closed_run(path)]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise FileError(
            text(
                "{runs}: the folder of the runs cannot be read: {strerror}; see --runs",
                runs=runs,
                strerror=reason_of(error),
            )
        ) from None
    return [RunFolder(path) for path in sorted(found, key=lambda path: (_STAMPED.match(path.name) is not None, path))]


def _closed_run(path: Path) -> bool:
    return _STAMPED.match(path.name) is not None and os.path.isdir(path) and not os.access(path, os.X_OK)
