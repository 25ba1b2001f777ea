"""Files that a rule removed from a run's folder, noted there so that the run can still be verified without them."""

import json
from collections.abc import Mapping
from pathlib import Path

from bench.journal.disk import write_file

_FILE = "removed.json"


def note_removed(folder: Path, files: Mapping[str, str], rule: str, when: str) -> None:
    """Note files, each with its SHA-256 by its path from the folder, before they are removed. Raises RecordError."""
    noted = {"rule": rule, "time": when, "files": dict(files)}
    content = json.dumps([*_noted(folder), noted], ensure_ascii=False, indent=2)
    write_file(folder / _FILE, content.encode("utf-8", "backslashreplace") + b"\n")


def removed_files(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each file that a rule removed, by its path; none where the note cannot be read."""
    files: dict[str, str] = {}
    for noted in _noted(folder):
        if isinstance(noted, dict) and isinstance(noted.get("files"), dict):
            files |= {str(path): str(sha256) for path, sha256 in noted["files"].items()}
    return files


def _noted(folder: Path) -> list[object]:
    try:
        noted = json.loads((folder / _FILE).read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return []
    return noted if isinstance(noted, list) else []
