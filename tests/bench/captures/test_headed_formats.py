"""Files whose heading states the time: Yokogawa DLM and Hantek."""

from pathlib import Path

import pytest

from bench.captures import CaptureError, read_capture

YOKOGAWA = (
    '"Header Size",14\n"Model Name","DLM3054"\n"Comment",""\n"BlockNumber",1\n"TraceName","CH1","CH2"\n"BlockSize",3,3\n'
    '"VUnit","V","A"\n"SampleRate",1000.0,1000.0\n"HResolution",1.0E-03,1.0E-03\n"HOffset",-2.0E-03,-2.0E-03\n"HUnit","s","s"\n'
    '"DisplayBlockSize",3,3\n"Date","2026/05/18","2026/05/18"\n"Time","10:00:00.0","10:00:00.0"\n\n'
    ",1.0E-01,1,\n,2.0E-01,2,\n,3.0E-01,3,\n"
)
HANTEK = (
    "#CHANNEL:CH1\n#CLOCK=20.0uS\n#SIZE=3\n#UNITS:V\n\n-1.5\n0.5\n0.9\n\n\n"
    "#CHANNEL:CH2\n#CLOCK=20.0uS\n#SIZE=3\n#UNITS:mV\n\n2000\n2500\n2600\n"
)


def put(folder: Path, content: str) -> Path:
    path = folder / "record.csv"
    path.write_text(content, encoding="utf-8")
    return path


def test_yokogawa_has_its_time_by_resolution_and_offset(tmp_path: Path) -> None:
    capture = read_capture(put(tmp_path, YOKOGAWA))
    assert capture.description == "Yokogawa CSV of a DLM3054"
    assert [(c.name, c.unit) for c in capture.channels] == [("CH1", "V"), ("CH2", "A")]
    assert capture.times() == pytest.approx([-2e-3, -1e-3, 0.0])
    assert capture.channels[1].values == pytest.approx([1.0, 2.0, 3.0])
    assert capture.line_of(0) == 16


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"HResolution",1.0E-03,1.0E-03\n', "", "without TraceName, HResolution and HOffset"),
        ('"HUnit","s","s"', '"HUnit","Hz","Hz"', "without TraceName, HResolution and HOffset"),
        ("-2.0E-03,-2.0E-03", "-2.0E-03,-1.0E-03", "different HResolution or HOffset"),
        ('"BlockNumber",1', '"BlockNumber",7', "7 blocks of the history"),
        (",2.0E-01,2,", ",2.0E-01,,", "line 17: .* is not a row of 2 numbers"),
    ],
)
def test_yokogawa_whose_time_is_not_known_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in YOKOGAWA
    with pytest.raises(CaptureError, match=said):
        read_capture(put(tmp_path, YOKOGAWA.replace(old, new)))


def test_hantek_has_a_block_a_channel(tmp_path: Path) -> None:
    capture = read_capture(put(tmp_path, HANTEK))
    assert capture.description == "Hantek text"
    assert [(c.name, c.unit) for c in capture.channels] == [("CH1", "V"), ("CH2", "V")]
    assert capture.times() == pytest.approx([0.0, 20e-6, 40e-6])
    assert capture.channels[0].values == pytest.approx([-1.5, 0.5, 0.9])
    assert capture.channels[1].values == pytest.approx([2.0, 2.5, 2.6])
    one = read_capture(put(tmp_path, "# CHANNEL:CH1\n# CLOCK=0.000001000S\n# SIZE=9\n# UNITS:V\n\n4.5\n5.1\n"))
    assert one.times() == pytest.approx([0.0, 1e-6])
    assert any("states 9 samples, but the file contains 2" in note for note in map(str, one.assumptions))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("#CLOCK=20.0uS\n#SIZE=3\n#UNITS:V", "#CLOCK=?\n#SIZE=3\n#UNITS:V", "channel CH1 has no clock period"),
        ("2600\n", "", "numbers of samples that differ"),
        ("0.5\n", "0.5,1\nabc\n", "line 8: 'abc'"),
    ],
)
def test_hantek_that_is_not_whole_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in HANTEK
    with pytest.raises(CaptureError, match=said):
        read_capture(put(tmp_path, HANTEK.replace(old, new, 1)))
