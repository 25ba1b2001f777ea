"""A photo beside a motor's or a station's file: shown with its run, or refused in one sentence."""

import base64
import io
import json
import re
import struct
import zlib
from importlib import resources
from pathlib import Path

import pytest
from PIL import Image
from pypdf import PdfReader

from bench.i18n.errors import FileError
from bench.motor.motor_file import load_motor
from bench.station.station_file import make_station
from tests.command_line import called

PLATE = '[nameplate]\nname = "M1"\nconnection = "wye"\nrated_current = 2.0\nphoto = {name}\n'


def camera(path: Path, size: tuple[int, int] = (1600, 1200)) -> bytes:
    """Write a photo as a phone does: turned, with where it was taken."""
    exif = Image.Exif()
    exif[0x0112] = 6
    exif[0x010F] = "where it was taken"
    Image.new("RGB", size, "orange").save(path, exif=exif)
    return path.read_bytes()


def motor(folder: Path, name: str) -> str:
    path = folder / "motor.toml"
    path.write_text(PLATE.format(name=json.dumps(name)))
    return str(path)


def virtual_motor(folder: Path) -> str:
    content = (resources.files("bench") / "motors" / "lg-400w.toml").read_text()
    (folder / "motor.toml").write_text(content.replace("[nameplate]", '[nameplate]\nphoto = "photo.jpg"', 1))
    return str(folder / "motor.toml")


def png_of(width: int, height: int) -> bytes:
    chunks = ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)), (b"IDAT", b""))
    told = (struct.pack(">I", len(c)) + n + c + struct.pack(">I", zlib.crc32(n + c)) for n, c in chunks)
    return b"\x89PNG\r\n\x1a\n" + b"".join(told)


def test_it_is_made_small_upright_and_says_nothing_else(tmp_path: Path) -> None:
    camera(tmp_path / "photo.jpg")
    photo = load_motor(motor(tmp_path, "photo.jpg")).photo
    assert photo is not None
    made = photo.small()
    with Image.open(io.BytesIO(made)) as image:
        assert (image.format, image.size) == ("JPEG", (600, 800))
        assert not image.getexif()
    assert b"taken" not in made


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("nowhere.jpg", None, "there is no such file"),
        ("words.jpg", b"no picture", "it is not a JPEG or PNG picture"),
        ("vector.svg", b"<svg xmlns='http://www.w3.org/2000/svg'/>", "it is not a JPEG or PNG picture"),
        ("bomb.png", png_of(200_000, 200_000), "it is not a JPEG or PNG picture"),
        ("large.png", png_of(12_000, 12_000), "it has more than 120 million pixels"),
        (".", None, "it is a folder, not a file"),
        ("../photo.jpg", None, "a photo must be in the folder of its file"),
        ("/etc/passwd", None, "a photo must be in the folder of its file"),
        ("a\0b.jpg", None, "a photo must be in the folder of its file"),
    ],
)
def test_what_cannot_be_shown_is_refused_in_one_sentence(
    tmp_path: Path, name: str, content: bytes | None, said: str
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(FileError) as refused:
        load_motor(motor(tmp_path, name))
    message = str(refused.value)
    assert said in message
    assert "motor.toml: nameplate.photo" in message
    assert "\n" not in message


def test_a_huge_file_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "huge.jpg").open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(FileError, match="more than 32 MiB"):
        load_motor(motor(tmp_path, "huge.jpg"))


def test_a_broken_off_photo_is_refused_before_the_run_has_a_folder(tmp_path: Path, capsys) -> None:
    whole = camera(tmp_path / "photo.jpg")
    (tmp_path / "photo.jpg").write_bytes(whole[: len(whole) // 2])
    arguments = ("--motor", virtual_motor(tmp_path), "--runs", str(tmp_path / "runs"))
    status, _, err = called(capsys, "run", "nameplate", "--station", "virtual", *arguments)
    assert status == 2
    assert "incomplete or damaged" in re.sub(r"\s+", " ", err)
    assert not (tmp_path / "runs").exists()


def test_a_stations_photo_is_named_by_its_own_key(tmp_path: Path, capsys) -> None:
    path = tmp_path / "bench.toml"
    path.write_text('[station]\nname = "bench 3"\nphoto = "bench.jpg"\n')
    status, _, err = called(capsys, "station", "check", str(path))
    assert status == 2
    assert "station.photo" in err
    assert make_station({"station": {"name": "bench 3"}}, "x.toml", b"").photo is None


def test_run_page_and_paper_show_it(tmp_path: Path, capsys) -> None:
    camera(tmp_path / "photo.jpg")
    runs = tmp_path / "runs"
    arguments = ("--station", "virtual", "--motor", virtual_motor(tmp_path), "--runs", str(runs))
    assert called(capsys, "run", "nameplate", *arguments)[0] == 0
    (folder,) = runs.iterdir()
    # The run shows it by itself: the file may go.
    (tmp_path / "photo.jpg").unlink()
    kept = (folder / "photo-motor.jpg").read_bytes()
    assert called(capsys, "report", str(folder))[0] == 0
    page = next(folder.glob("*.html")).read_text()
    assert base64.b64encode(kept).decode() in page
    assert "Photo of the motor" in page
    images = [image for paper in PdfReader(next(folder.glob("*.pdf"))).pages for image in paper.images]
    assert any(image.image is not None and image.image.size == (600, 800) for image in images)
    # What is no picture any more is left out.
    (folder / "photo-motor.jpg").write_bytes(b"gone")
    assert called(capsys, "report", str(folder))[0] == 0
    assert "Photo of the motor" not in next(folder.glob("*.html")).read_text()
