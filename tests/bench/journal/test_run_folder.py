"""Where a run lives: a folder named by time and motor."""

from pathlib import Path

import pytest

from bench.journal.run_folder import new_run_folder


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
