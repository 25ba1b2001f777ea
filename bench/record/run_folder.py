"""Where a run lives on disk."""

import json
import os
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bench.errors import InputError
from bench.record.encoding import plain


@dataclass(frozen=True)
class RunFolder:
    """One folder a run: the journal, the result, the waveforms."""

    path: Path

    @property
    def journal(self) -> Path:
        """The append-only record."""
        return self.path / "journal.jsonl"

    @property
    def result(self) -> Path:
        """What the journal comes to, as JSON."""
        return self.path / "result.json"

    @property
    def waveforms(self) -> Path:
        """The samples that the journal refers to."""
        return self.path / "waveforms.h5"

    def write_result(self, result: dict[str, Any]) -> None:
        """Write `result.json` whole or not at all."""
        part = self.path / ".result.json.part"
        text = json.dumps(plain(result), ensure_ascii=False, allow_nan=False, indent=2)
        with part.open("w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(text + "\n")
            file.flush()
            os.fsync(file.fileno())
        part.replace(self.result)


def new_run_folder(runs: Path, motor: str) -> RunFolder:
    """Make a folder named by the time (UTC) and the motor. Raises InputError where it cannot be made."""
    name = re.sub(r"[^\w.-]+", "-", motor).strip("-").lower() or "motor"
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    for count in range(1000):
        path = runs / (f"{stamp}-{name}" + (f"-{count + 1}" if count else ""))
        try:
            runs.mkdir(parents=True, exist_ok=True)
            path.mkdir()
        except FileExistsError:
            continue
        except OSError as error:
            raise InputError(f"{path}: the run's folder cannot be made: {error.strerror}; see --runs") from None
        return RunFolder(path)
    raise InputError(f"{runs}: too many runs of {name} in one second")


def existing_run_folder(reference: str, runs: Path) -> RunFolder:
    """Return a run by its folder or by its name under `runs`. Raises InputError where there is none."""
    for path in (Path(reference), runs / reference):
        if (path / "journal.jsonl").is_file():
            return RunFolder(path)
    raise InputError(f"{reference}: there is no run here, nor under {runs} (a run's folder holds journal.jsonl)")
