"""Where a run lives: a folder named by time and motor."""

import os
from pathlib import Path
from typing import Any

import pytest

from bench.journal.overview import overview
from bench.journal.run_folder import new_run_folder, run_folders


def test_only_a_folder_with_nothing_in_it_is_removed(tmp_path: Path) -> None:
    folder = new_run_folder(tmp_path, "motor")
    folder.journal.touch()
    folder.remove_if_empty()
    assert folder.journal.exists()
    folder.journal.unlink()
    folder.remove_if_empty()
    folder.remove_if_empty()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["x" * 300, "ä" * 300, "电机" * 100, "a" + "电" * 90])
def test_a_motor_with_a_long_name_has_a_folder(tmp_path: Path, name: str) -> None:
    first, second = new_run_folder(tmp_path, name), new_run_folder(tmp_path, name)
    assert first.path.is_dir()
    assert second.path.is_dir()
    assert first.path != second.path
    assert name.startswith(first.path.name.partition("Z-")[2])


def test_a_run_that_must_not_be_read_keeps_no_other_from_being_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = new_run_folder(tmp_path, "a"), new_run_folder(tmp_path, "b")
    for folder in (first, second, run := new_run_folder(tmp_path, "c")):
        folder.journal.touch()
    (tmp_path / "lost+found").mkdir()
    closed = (str(second.path), str(tmp_path / "lost+found"))
    stat, access = os.stat, os.access

    def refused(path: Any, **more: Any) -> os.stat_result:
        if os.path.dirname(path) in closed:
            raise PermissionError(13, "Permission denied")
        return stat(path, **more)

    monkeypatch.setattr(os, "stat", refused)
    monkeypatch.setattr(os, "access", lambda path, mode: str(path) not in closed and access(path, mode))
    found = run_folders(tmp_path)
    assert [folder.path for folder in found] == [first.path, second.path, run.path]
    assert overview(second).status == "unreadable"
