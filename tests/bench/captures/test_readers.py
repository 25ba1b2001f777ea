import gzip
import hashlib
from pathlib import Path

import numpy as np
import pytest

from bench.captures import CaptureError, read_capture, read_captures
from bench.journal.waveforms import StoredWaveform, WaveformFolder, file_image, read_waveform, waveform_names

RTB = "in s,C1 in V\n-1.000010E-03,1.5E-01\n-9.900090E-04,2.5E-01\n-9.800080E-04,1.0E-01\n"
TDS = (
    "Record Length,3.000000e+00,,  -0.050000000000,   0.16000,\n"
    "Vertical Units,V,,  -0.049960000000,   0.20000,\n"
    "Source,CH2,,-00.049920000000,   0.16000,\n"
)


def put(folder: Path, text: str, name: str = "record.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


SDS_CONVERTED = (
    "Record Length,Analog:4\nSample Rate,100000.0\nVertical Scale,CH2: 0.05\nVertical Offset,CH2:0.00000\n"
    "Horizontal Scale, 0.00001\nSecond,Volt\n-0.00001,-0.194\n0.00000,-0.192\n0.00001,-0.190\n"
)
SDS_OWN = (
    "Record Length,Analog:3,\nSample Interval,Analog:1.0E-05,\nVertical Units,CH1:V,CH3:A,,\nVertical Scale,CH1:1.0,CH3:1.0,,\n"
    "Model Number,SDS1104X-U,\nSource,CH1,CH3\nSecond,Value,Value\n+0.0E+00,+4.0E-02,+1\n+1.0E-05,+8.0E-02,+2\n+2.0E-05,0,+3\n"
)
SDS_SHORT = "Source,CH4\nSecond,Volt\n-0.1,0.5\n0.0,0.6\n0.1,0.6\n"


@pytest.mark.parametrize(
    ("content", "channels", "first", "line"),
    [
        (SDS_CONVERTED, [("CH2", "V")], -0.194, 7),
        (SDS_OWN, [("CH1", "V"), ("CH3", "A")], 0.04, 8),
        (SDS_SHORT, [("CH4", "V")], 0.5, 3),
    ],
)
def test_siglent_with_its_channels_and_units(
    tmp_path: Path, content: str, channels: list[tuple[str, str]], first: float, line: int
) -> None:
    capture = read_capture(put(tmp_path, content))
    assert capture.description.startswith("Siglent CSV")
    assert [(c.name, c.unit) for c in capture.channels] == channels
    assert capture.channels[0].values[0] == pytest.approx(first)
    assert (capture.times().size, capture.line_of(0)) == (3, line)
    assert any("states 4 samples, but the file contains 3" in note for note in map(str, capture.assumptions)) == (
        "Analog:4" in content
    )


RIGOL_NUMBERED = (
    "X,CH1,CH2,Start,Increment,\nSequence,Volt,Ampere,-2.000000e-03,1.000000e-03\n"
    "0,1.0e-01,1,,\n1,2.0e-01,2,,\n2,3.0e-01,3,,\n"
)
RIGOL_WITHOUT_TIME = "CH1V,CH2A,t0 =-2.000000e-03s, tInc = 1.000000e-03s,\n1.0e-01,1,,\n2.0e-01,2,,\n3.0e-01,3,,\n"


@pytest.mark.parametrize("content", [RIGOL_NUMBERED, RIGOL_WITHOUT_TIME])
def test_rigol_has_its_time_from_the_heading(tmp_path: Path, content: str) -> None:
    capture = read_capture(put(tmp_path, content))
    assert capture.description == "Rigol CSV"
    assert [(c.name, c.unit) for c in capture.channels] == [("CH1", "V"), ("CH2", "A")]
    assert capture.times() == pytest.approx([-2e-3, -1e-3, 0.0])
    assert capture.channels[1].values == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (RIGOL_NUMBERED.replace(",Start,Increment", ""), "line 2: numbers its samples"),
        (RIGOL_NUMBERED.replace("1.000000e-03", "0"), "line 2: numbers its samples"),
        (RIGOL_NUMBERED.replace("\n2,", "\n7,"), "line 5: sample 1 is followed by 7"),
    ],
)
def test_rigol_without_a_time_to_each_sample_is_refused(tmp_path: Path, content: str, said: str) -> None:
    with pytest.raises(CaptureError, match=said):
        read_capture(put(tmp_path, content))


def test_siglent_with_a_broken_row_names_its_line(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match=r"line 5: '0\.1' is not a row of 2 numbers"):
        read_capture(put(tmp_path, SDS_SHORT.replace("0.1,0.6", "0.1,")))


def test_rohde_schwarz_with_its_channel_and_unit(tmp_path: Path) -> None:
    capture = read_capture(put(tmp_path, RTB))
    assert capture.description == "Rohde & Schwarz CSV"
    assert [(c.name, c.unit) for c in capture.channels] == [("C1", "V")]
    assert capture.channel("CHAN1").values == pytest.approx([0.15, 0.25, 0.10])
    assert capture.times()[0] == pytest.approx(-1.00001e-3)
    assert capture.evenly_sampled().times()[1] == pytest.approx(-9.90009e-4)


def test_a_text_that_unpacks_to_any_length_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.captures.text.LONGEST", 1 << 20)
    path = tmp_path / "bomb.csv.gz"
    path.write_bytes(gzip.compress(b"1,2\n" * (1 << 20)))
    with pytest.raises(CaptureError, match="more than 1 MiB"):
        read_capture(path)
    path.write_bytes(b"1,2\n" * (1 << 20))
    with pytest.raises(CaptureError, match="more than 1 MiB"):
        read_capture(path)


def test_gzip_is_seen_by_content(tmp_path: Path) -> None:
    path = tmp_path / "record.csv.gz"
    path.write_bytes(gzip.compress(RTB.encode()))
    assert read_capture(path).channels[0].values.size == 3
    path.write_bytes(gzip.compress(RTB.encode())[:-12])
    with pytest.raises(CaptureError, match="not a whole gzip file"):
        read_capture(path)


@pytest.mark.parametrize("stray", ["", "2"])
def test_tektronix_with_or_without_a_stray_character(tmp_path: Path, stray: str) -> None:
    capture = read_capture(put(tmp_path, stray + TDS))
    assert (capture.channels[0].name, capture.channels[0].unit) == ("CH2", "V")
    assert capture.channels[0].values == pytest.approx([0.16, 0.20, 0.16])
    assert capture.times() == pytest.approx([-0.05, -0.04996, -0.04992])


def test_tektronix_cut_short_is_noticed(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match=r"line 2: holds 2 samples where its heading states 3"):
        read_capture(put(tmp_path, "\n".join(TDS.splitlines()[:2])))


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("time (s),u (V)\n0,1.5\n0.001,2.5\n", "V"),
        ("t [ms];U [mV]\n0;1500\n1;2500\n", "V"),
        ("Zeit/ms\tU/V\n0,0\t1,5\n1,0\t2,5\n", "V"),
        ("0,0;1,5\n0,001;2,5\n", ""),
        ('"0,0","1,5"\n"0,001","2,5"\n', ""),
        ('"t (s)","u (V)"\n"0,0","1,5"\n"0,001","2,5"\n', "V"),
        ("0 1.5\n0.001 2.5\n", ""),
        ("# made by a logger\ntime,voltage\ns,V\n0,1.5\n0.001,2.5\n", "V"),
        ("time_s,voltage_mV\n0,1500,\n0.001,2500,\n", "V"),
        ("\ufeffin ms,C1 in mV\n0,1500\n1,2500\n", "V"),
    ],
)
def test_plain_tables_in_many_dresses(tmp_path: Path, text: str, unit: str) -> None:
    capture = read_capture(put(tmp_path, text))
    assert capture.times() == pytest.approx([0.0, 0.001])
    assert capture.channels[0].values == pytest.approx([1.5, 2.5])
    assert capture.channels[0].unit == unit


def test_what_a_table_leaves_open_is_said(tmp_path: Path) -> None:
    capture = read_capture(put(tmp_path, "0;1\n1;2\n"))
    assert "no heading: the first column is taken as time in s" in str(capture.assumptions[0])
    strange = read_capture(put(tmp_path, "time (s),x (furlong)\n0,1\n1,2\n"))
    assert (strange.channels[0].name, strange.channels[0].unit) == ("x", "furlong")


def test_speed_and_angle_units_become_si(tmp_path: Path) -> None:
    capture = read_capture(put(tmp_path, "time (s),speed (rpm),torque (mN·m)\n0,60,5\n1,30,0\n"))
    assert capture.channel("speed").values == pytest.approx([2 * np.pi, np.pi])
    assert capture.channel("torque").values == pytest.approx([0.005, 0.0])
    table = read_capture(put(tmp_path, "angle (deg),L (µH)\n0,146\n90,153\n"))
    assert table.time is None
    assert table.channel("angle").values == pytest.approx([0, np.pi / 2])
    assert table.channel("L").values == pytest.approx([146e-6, 153e-6])
    with pytest.raises(CaptureError, match="no time column"):
        table.times()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t (s),u (V)\n0,1\n1,nan\n2,1\n", r"line 3: '1,nan' contains a value that is not a finite number"),
        ("t (s),u (V)\n0,1\n1,\n2,1\n", r"line 3: .* is not a row of 2 numbers"),
        ("t (s),u (V)\n0,1\n\n2,1\n", r"line 3: .* is not a row of 2 numbers"),
        ("t (s),u (V)\n0,1\n2,1\n1,1\n", r"line 4: time does not increase \(2 s, then 1 s\)"),
        ("t (s),u (V)\n0,1\n1,1\n1,2\n", r"line 4: the time 1 s stands in two rows"),
        ("u (V)\n1\n2\n", r"line 2: has one column only"),
        ("hello\nworld\n", r"line 1: no row of numbers"),
        ("t (s),u (V)\n0,1\n", r"line 2: holds one row of numbers only"),
        ("\n\n", "is empty"),
        ("in s,C1 in V\n0,1\n1,x\n2,1\n", r"line 3: '1,x' is not a row of 2 numbers"),
        ("in s,C1 in V\n0,1\n", "fewer than two samples"),
    ],
)
def test_broken_files_are_refused_with_file_and_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(CaptureError, match=r"record\.csv.*" + message):
        read_capture(put(tmp_path, text))


def test_a_gap_is_refused_with_its_line(tmp_path: Path) -> None:
    rows = "\n".join(f"{k * 1e-3},{k % 3}" for k in range(50) if k != 20)
    capture = read_capture(put(tmp_path, f"t (s),u (V)\n{rows}\n"))
    with pytest.raises(CaptureError, match=r"record\.csv, line 22: gap in time: 0.002 s"):
        capture.evenly_sampled()


def test_slowly_creeping_samples_are_refused(tmp_path: Path) -> None:
    rows = "\n".join(f"{1e-3 * k * (1 + 0.004 * k)},{k % 3}" for k in range(50))
    with pytest.raises(CaptureError, match="not evenly spaced"):
        read_capture(put(tmp_path, f"t (s),u (V)\n{rows}\n")).evenly_sampled()


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match=r"absent\.csv: does not exist"):
        read_capture(tmp_path / "absent.csv")


def test_files_of_one_record_are_joined_and_others_are_not(tmp_path: Path) -> None:
    one, two = put(tmp_path, RTB, "one.csv"), put(tmp_path, RTB.replace("C1", "C2"), "two.csv")
    assert [c.name for c in read_captures([one, two]).channels] == ["C1", "C2"]
    same = put(tmp_path, RTB, "same.csv")
    assert [c.name for c in read_captures([one, same]).channels] == ["one:C1", "same:C1"]
    with pytest.raises(CaptureError, match="given twice"):
        read_captures([one, one])
    other = put(tmp_path, RTB.replace("-9.900090E-04", "-9.950090E-04"), "other.csv")
    longer = put(tmp_path, RTB + "-9.700070E-04,1.0E-01\n", "longer.csv")
    for path in (other, longer):
        with pytest.raises(CaptureError, match=rf"{path.name}: its time axis .* differs from that of .*one\.csv"):
            read_captures([one, path])
    with pytest.raises(CaptureError, match="no file given"):
        read_captures([])


def test_scaling_is_by_name_and_told(tmp_path: Path) -> None:
    capture = read_capture(put(tmp_path, RTB)).scaled({"CH1": -10})
    assert capture.channels[0].values == pytest.approx([-1.5, -2.5, -1.0])
    assert "channel C1 multiplied by -10" in [str(each) for each in capture.assumptions]
    with pytest.raises(CaptureError, match="no channel 'C7'; there are C1"):
        capture.scaled({"C7": 10})
    with pytest.raises(CaptureError, match="other than 0"):
        capture.scaled({"C1": 0})


def test_converter_step_is_found_in_coarse_data_only(tmp_path: Path) -> None:
    values = np.round(np.sin(np.arange(400) / 10) / 0.04) * 0.04
    rows = "\n".join(f"{k},{v:.2f},{v + k * 1e-5:.5f}" for k, v in enumerate(values))
    coarse, fine = read_capture(put(tmp_path, f"t (s),a (V),b (V)\n{rows}\n")).channels
    assert coarse.resolution == pytest.approx(0.04)
    assert fine.resolution == 0.0


def wave(values: list[float], start: float = 0.0, channel: int = 1) -> StoredWaveform:
    return StoredWaveform(start + np.arange(len(values)) * 1e-3, np.array(values), "V", 0.04, channel)


def put_waves(path: Path, **waves: StoredWaveform) -> Path:
    path.write_bytes(file_image({name.replace("_", "/"): each for name, each in waves.items()}))
    return path


def test_waveforms_come_back_as_written(tmp_path: Path) -> None:
    folder = WaveformFolder(tmp_path / "waveforms")
    first = folder.store(
        "oscilloscope", {"channel2": wave([1.0, 2.0, 3.0], channel=2), "channel4": wave([4.0, 5.0, 6.0])}
    )
    path = tmp_path / first.path
    assert first.reference("channel2") == "waveforms/0001-oscilloscope.h5#channel2"
    assert hashlib.sha256(path.read_bytes()).hexdigest() == first.sha256
    assert waveform_names(path) == ["channel2", "channel4"]
    back = read_waveform(path, first.reference("channel2"))
    assert back.values == pytest.approx([1.0, 2.0, 3.0])
    assert (back.unit, back.resolution, back.channel, back.clipped) == ("V", 0.04, 2, False)
    assert read_waveform(path, "channel4").time == pytest.approx([0.0, 1e-3, 2e-3])
    with pytest.raises(KeyError, match="no waveform 'emf/z'"):
        read_waveform(path, "emf/z")


def test_records_are_numbered_and_never_written_over(tmp_path: Path) -> None:
    folder = WaveformFolder(tmp_path / "waveforms")
    first = folder.store("oscilloscope", {"channel1": wave([1.0, 2.0])})
    assert folder.store("oscilloscope", {"channel1": wave([1.0, 2.0])}).path == "waveforms/0002-oscilloscope.h5"
    (tmp_path / first.path).unlink()
    assert WaveformFolder(folder.path).store("x", {"channel1": wave([1.0])}).path == "waveforms/0003-x.h5"


def test_hdf5_is_a_capture_and_one_record_can_be_chosen(tmp_path: Path) -> None:
    waves = {"emf_a": wave([1.0, 2.0]), "emf_b": wave([3.0, 4.0])}
    path = put_waves(tmp_path / "waveforms.h5", **waves)
    assert [c.name for c in read_capture(path).channels] == ["emf/a", "emf/b"]
    put_waves(path, **waves, step=wave([5.0, 6.0], start=1.0))
    with pytest.raises(CaptureError, match=r"different times; choose one record by waveforms\.h5#NAME"):
        read_capture(path)
    chosen = read_capture(f"{path}#emf")
    assert [c.resolution for c in chosen.channels] == [0.04, 0.04]
    with pytest.raises(CaptureError, match="the file contains no waveform 'other'; choose one of: emf/a, emf/b, step"):
        read_capture(f"{path}#other")


@pytest.mark.parametrize(
    ("waveform", "message"),
    [
        (StoredWaveform(np.array([0.0, 1.0]), np.array([1.0, np.nan]), "V", 0.0), "not finite"),
        (StoredWaveform(np.array([1.0, 0.0]), np.array([1.0, 2.0]), "V", 0.0), "does not increase"),
        (StoredWaveform(np.array([1.0]), np.array([1.0]), "V", 0.0), "fewer than two"),
    ],
)
def test_broken_waveforms_are_refused(tmp_path: Path, waveform: StoredWaveform, message: str) -> None:
    put_waves(tmp_path / "bad.h5", x=waveform)
    with pytest.raises(CaptureError, match=rf"bad\.h5: waveform x.*{message}"):
        read_capture(tmp_path / "bad.h5")


def test_a_broken_hdf5_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "cut.h5"
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(50))
    with pytest.raises(CaptureError, match="cannot be read as HDF5"):
        read_capture(path)
