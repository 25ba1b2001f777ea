"""The panel's list of runs while folders are removed, damaged and closed under it."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from bench.journal.packed import is_journal
from bench.panel import archive
from bench.panel.archive import Archive


def run_in(runs: Path, name: str, result: str | None = None) -> Path:
    folder = runs / name
    folder.mkdir()
    (folder / "journal.jsonl").touch()
    if result is not None:
        (folder / "result.json").write_text(result, encoding="utf-8")
    return folder


def test_a_run_that_is_removed_while_the_list_is_made_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_in(tmp_path, "a", '{"status": "completed"}')
    gone = run_in(tmp_path, "b", '{"status": "completed"}')
    runs = Archive(tmp_path)
    assert [run.name for run in runs.list()] == ["b", "a"]

    def seen_and_removed(journal: Path) -> bool:
        there = is_journal(journal)
        if journal.parent == gone and there:
            shutil.rmtree(gone)
        return there

    monkeypatch.setattr(archive, "is_journal", seen_and_removed)
    assert [run.name for run in runs.list()] == ["a"]


@pytest.mark.parametrize("result", ["[]", "{", "", "null", '"x"'])
def test_a_damaged_result_keeps_no_other_run_from_the_list(tmp_path: Path, result: str) -> None:
    run_in(tmp_path, "a", result)
    run_in(tmp_path, "b", '{"status": "completed"}')
    assert [(run.name, run.status) for run in Archive(tmp_path).list()] == [("b", "completed"), ("a", "unreadable")]


@pytest.mark.parametrize("closed", ["result.json", "journal.jsonl"])
def test_a_file_that_must_not_be_read_keeps_no_other_run_from_the_list(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, closed: str
) -> None:
    folder = run_in(tmp_path, "a", "{}" if closed == "result.json" else None)
    run_in(tmp_path, "b", '{"status": "completed"}')
    opened = Path.open

    def refused(path: Path, *how: Any, **more: Any) -> Any:
        if path == folder / closed:
            raise PermissionError(13, "Permission denied")
        return opened(path, *how, **more)

    monkeypatch.setattr(Path, "open", refused)
    assert [(run.name, run.status) for run in Archive(tmp_path).list()] == [("b", "completed"), ("a", "unreadable")]
