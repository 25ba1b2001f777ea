"""Files that an editor saved in another encoding: what they are, and how to save them, the same for each kind of file."""

from collections.abc import Callable
from pathlib import Path

import pytest

from bench.eol.line.admission.serial_numbers import serials_of_file
from bench.i18n.errors import FileError
from bench.motor.motor_file import load_motor
from bench.traffic.traffic_file import read_recording

READERS: dict[str, Callable[[Path], object]] = {
    "motor.toml": lambda path: load_motor(str(path)),
    "traffic.txt": read_recording,
    "serials.txt": serials_of_file,
}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize(("encoding", "said"), [("utf-16", "the text is UTF-16"), ("latin-1", "not UTF-8 text")])
def test_another_encoding_is_named_with_what_to_do(tmp_path: Path, name: str, encoding: str, said: str) -> None:
    path = tmp_path / name
    path.write_bytes('name = "Müller"\n'.encode(encoding))
    with pytest.raises(FileError) as refused:
        READERS[name](path)
    assert str(refused.value).startswith(f"{path}: {said}")
    assert str(refused.value).endswith("save it as UTF-8, in the editor's Save As")
