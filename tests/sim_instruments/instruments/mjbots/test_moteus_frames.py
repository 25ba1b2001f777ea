"""Frames byte by byte: what the documentation shows, and what the firmware does with those that are wrong."""

import struct
from collections.abc import Iterator

import can
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sim_instruments.instruments.mjbots.multiplex import told
from tests.sim_instruments.instruments.mjbots.conftest import Frames, moteus_bench, simulated


@pytest.fixture(scope="module")
def shared() -> Iterator[Frames]:
    with moteus_bench(sockets=False) as bench:
        yield Frames(bench)


def test_the_documentations_example_is_answered_in_its_form(frames: Frames) -> None:
    """Position mode with three int16, then four int16 and three int8 are read (documentation, "CAN Protocol")."""
    answer = frames.ask("01000a07206000200150ff140400130d")
    assert answer is not None
    # What it reads is from before the command: stopped. 48 V in half volts, 33 °C, no fault.
    assert answer == "2404" + "00" + "0000" * 4 + "230d602100"
    assert frames.heard[0].arbitration_id == 0x500
    assert not frames.heard[0].is_extended_id
    assert frames.heard[0].is_fd
    assert frames.heard[0].bitrate_switch


def test_a_command_is_read_back_as_it_was_written(frames: Frames) -> None:
    frames.ask("01000a07206000200150ff", respond=False)
    assert frames.ask("1720") == "27206000200150ff"
    # In the other types: 0.0096 turns are no whole hundredth.
    assert frames.ask("1120") == "212000"
    assert frames.ask("1920") == "2920c0030000"
    assert frames.ask("1d20") == "2d20" + struct.pack("<f", np.float32(96) * np.float32(0.0001)).hex()


@pytest.mark.parametrize(
    ("asked", "answered"),
    [
        ("50", ""),  # nothing but filling
        ("1100", "210000"),
        ("1d00", "2d0000000000"),
        ("100200", "2002" + "0000" + "00"),  # a count of its own
        ("110011" + "0f", "210000" + "210f00"),
        ("1101" + "13" + "99", "210100"),  # what ends within a subframe ends the frame
        ("11" + "9901", "31" + "9901" + "01"),
    ],
)
def test_reads(shared: Frames, asked: str, answered: str) -> None:
    assert shared.ask(asked) == answered


@pytest.mark.parametrize(
    ("asked", "answered"),
    [
        ("0101" + "05", "300102"),  # position is read only
        ("01" + "9003" + "05", "30900301"),  # 190h does not exist
        ("01" + "9002" + "05", "30900202"),  # the multiplex ID is there, and not to be written
        ("11" + "9002", "31900201"),
        ("0100" + "10", "300001"),  # there is no mode 16
        ("0100" + "ff", "300001"),
        ("0d01" + "00000000" + "1100", "300102" + "210000"),  # what follows an error is done
        ("11" + "9001" + "1100", "31900101"),  # what follows a register that cannot be read is not
        ("60" + "1100", ""),  # an unknown subframe ends the frame
        ("1100" + "43" + "0100", "210000"),  # as flow control does, which this firmware has not
        ("11" + "8002", "31800201"),  # versions in int32 only
        ("19" + "8102", "298102" + "00010100"),
        ("19" + "8202", "298202" + "05000000"),
        ("40" + "05" + "00", ""),  # there is no such stream
        ("4001" + "09" + "41", ""),  # a stream's bytes that are not there
        ("420129", "410100"),
    ],
)
def test_wrong_ones_are_answered_as_the_firmware_does(shared: Frames, asked: str, answered: str) -> None:
    assert shared.ask(asked) == answered


def test_without_the_uppermost_bit_of_the_source_nothing_is_answered(frames: Frames) -> None:
    assert frames.ask("01000a1100", respond=False) is None
    assert frames.ask("1100") == "210002"


@pytest.mark.parametrize(
    "frame", [{"node": 6}, {"node": 0x80}, {"prefix": 3}, {"is_remote_frame": True, "is_fd": False}]
)
def test_others_frames_are_not_heard(frames: Frames, frame: dict[str, int]) -> None:
    remote = {"bitrate_switch": False} if "is_remote_frame" in frame else {}
    assert frames.ask("" if remote else "1100", **frame, **remote) is None


def test_a_classic_frame_is_answered_by_one_as_long_as_it_fits(frames: Frames) -> None:
    frames.ask("1100", is_fd=False, bitrate_switch=False)
    assert not frames.heard[0].is_fd
    frames.ask("140400", is_fd=False, bitrate_switch=False)
    assert frames.heard[0].is_fd
    assert not frames.heard[0].bitrate_switch


def test_everybody_answers_to_7f(frames: Frames) -> None:
    assert frames.ask("1100", node=0x7F) == "210000"
    assert frames.heard[0].arbitration_id == 0x500


def test_its_identifier_and_prefix_are_configured(frames: Frames) -> None:
    sent = b"conf set id.id 17\n"
    frames.ask(f"4001{len(sent):02x}{sent.hex()}")
    assert frames.ask("1100") is None
    assert frames.ask("1100", node=17) == "210000"
    assert frames.heard[0].arbitration_id == 0x1100
    sent = b"conf set can.prefix 3\n"
    frames.ask(f"4001{len(sent):02x}{sent.hex()}", node=17)
    assert frames.ask("1100", node=17) is None
    assert frames.ask("1100", node=17, prefix=3) == "210000"
    assert frames.heard[0].arbitration_id == 0x31100
    assert frames.heard[0].is_extended_id


def test_of_an_answer_longer_than_a_frame_nothing_comes(frames: Frames) -> None:
    assert frames.ask("1c0e20") is not None
    assert frames.ask("1c0e20" + "1d00") is None


def test_values_are_cut_saturated_and_nan_in_integers(frames: Frames) -> None:
    frames.ask("010009" + "0e1c" + struct.pack("<ff", 0.5, -40000.0).hex(), respond=False)
    assert frames.ask("1a1c") == "2a1c" + struct.pack("<ii", 499, -40000000).hex() + "5050"
    assert frames.ask("161c") == "261c" + struct.pack("<hh", 5, -32767).hex()
    assert frames.ask("121c") == "221c" + struct.pack("<bb", 0, -127).hex()
    # No velocity limit: NaN, in every type its own.
    assert frames.ask("1128") == "212880"
    assert frames.ask("1928") == "292800000080"
    # Written so, it is one again.
    frames.ask("01000a" + "05" + "20" + "0080", respond=False)
    assert frames.ask("1d20") == "2d20" + struct.pack("<f", float("nan")).hex()


def test_a_mode_begins_the_command_anew(frames: Frames) -> None:
    frames.ask("010009" + "0d1c" + struct.pack("<f", 2.0).hex(), respond=False)
    frames.ask("01000a", respond=False)
    assert frames.ask("1d1c") == "2d1c00000000"
    # Without a mode nothing is commanded, whatever else is written.
    frames.bench.clock.sleep(0.1)
    frames.ask("0d22" + struct.pack("<f", 9.0).hex(), respond=False)
    assert frames.ask("1100") == "21000a"


def test_another_devices_uuid_ends_the_frame_without_an_answer(frames: Frames) -> None:
    mine = (frames.ask("1b" + "d002") or "")[6:30]
    assert frames.ask("0b" + "d402" + mine + "1100") == "210000"
    assert frames.ask("09" + "d402" + "00000000" + "010009" + "1100") is None
    assert frames.ask("1100") == "210000"


def test_a_long_reply_of_the_stream_comes_in_pieces_of_41_bytes(frames: Frames) -> None:
    sent = b"tel schema servo_control\n"
    first = bytes.fromhex(frames.ask(f"4001{len(sent):02x}{sent.hex()}") or "")
    assert first[:3] == b"\x41\x01\x29"
    assert first[3:].startswith(b"schema servo_control\r\n")
    assert bytes.fromhex(frames.ask("420110") or "")[2] == 16


def test_the_position_is_set_by_a_register(frames: Frames) -> None:
    frames.ask("0d" + "b102" + struct.pack("<f", 1.25).hex(), respond=False)
    assert frames.ask("1d01") == "2d01" + struct.pack("<f", 1.25).hex()
    frames.ask("0d" + "b002" + struct.pack("<f", 0.0).hex(), respond=False)
    assert frames.ask("1d01") == "2d01" + struct.pack("<f", 0.25).hex()


@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=64))
def test_no_frame_brings_it_down(shared: Frames, data: bytes) -> None:
    drive = simulated(shared.bench)
    answer = drive.serve(data, respond=True)
    assert answer is None or len(answer) <= 64
    assert isinstance(told(data), str)
    drive.serve(bytes.fromhex("010000"), respond=False)
    assert drive.serve(bytes.fromhex("1100"), respond=True) == bytes.fromhex("210000")


def test_a_frame_is_told_in_words() -> None:
    assert told(bytes.fromhex("0100090e1c0000000000000000" + "1100")) == "write 000H write 01CH 01DH read 000H"
    assert told(b"\x40\x01\x0ctel get git\n") == "stream 1 tel get git"
    assert told(bytes.fromhex("42013d")) == "poll 1"
    assert told(bytes.fromhex("0100")) == "malformed"
    assert told(bytes.fromhex("61")) == "subframe 61H"


def test_error_frames_are_passed_over(frames: Frames) -> None:
    frames.heard.clear()
    frames._end.send(can.Message(arbitration_id=0x8005, is_error_frame=True))
    assert not frames.heard
