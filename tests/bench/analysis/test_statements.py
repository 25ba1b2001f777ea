import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.analysis import analyze_back_emf
from bench.analysis.statements import read_statements
from bench.analysis.temperature import copper_temperature, magnet_temperature
from bench.i18n.errors import InputError, UsageError


@pytest.mark.parametrize(
    ("word", "name", "gain", "offset", "unit"),
    [
        ("CH1=2%+5mV", "CH1", 0.02, 0.005, "V"),
        ("voltage=±2 % + 5 mV", "voltage", 0.02, 0.005, "V"),
        ("current=5mA", "current", 0.0, 0.005, "A"),
        ("current=1e-3A+0.5%", "current", 0.005, 0.001, "A"),
        ("time=25ppm", "time", 25e-6, 0.0, ""),
        ("torque=.2%+3mN·m", "torque", 0.002, 0.003, "N·m"),
        ("inductance=0.1%+20nH", "inductance", 0.001, 20e-9, "H"),
        ("a=b=1%", "a=b", 0.01, 0.0, ""),
        ("voltage=0%", "voltage", 0.0, 0.0, ""),
    ],
)
def test_limits_are_read_in_si(word: str, name: str, gain: float, offset: float, unit: str) -> None:
    (statement,) = read_statements([word])
    assert (statement.name, statement.unit) == (name, unit)
    assert (statement.gain, statement.offset) == pytest.approx((gain, offset), rel=1e-12)


def test_a_speed_may_be_stated_in_rpm() -> None:
    (statement,) = read_statements(["speed=0.1%+1rpm"])
    assert statement.offset == pytest.approx(2 * math.pi / 60)
    assert statement.unit == "rad/s"


@given(st.floats(0.0, 50.0), st.floats(0.0, 1e3))
def test_every_number_is_read_as_written(percent: float, millivolts: float) -> None:
    (statement,) = read_statements([f"CH1={percent!r}%+{millivolts!r}mV"])
    assert statement.gain == pytest.approx(percent / 100, rel=1e-12)
    assert statement.offset == pytest.approx(millivolts / 1000, rel=1e-12)


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("CH1", "give NAME=LIMITS"),
        ("=2%", "give NAME=LIMITS"),
        ("CH1=", "'' is not understood; allowed is a gain in % or ppm"),
        ("CH1=2", "'2' is not understood"),
        ("CH1=2%+", "not understood"),
        ("CH1=-2%", "not understood"),
        ("CH1=2%5mV", "not understood"),
        ("CH1=nan%", "not understood"),
        ("CH1=2%+1%", "two gains"),
        ("CH1=2mV+1V", "two offsets"),
        ("CH1=2parsec", "the unit 'parsec' is not known; known are %, ppm, V"),
        ("CH1=51%", "allowed is up to 50 %"),
    ],
)
def test_what_is_no_accuracy_is_refused_with_what_is_allowed(word: str, said: str) -> None:
    with pytest.raises(UsageError) as refused:
        read_statements([word])
    assert str(refused.value).startswith(f"--accuracy {word}: ")
    assert said in str(refused.value)


def test_a_name_is_stated_once() -> None:
    with pytest.raises(UsageError, match="CH1=3%: CH1 was already stated by --accuracy CH1=2%"):
        read_statements(["CH1=2%", "CH1=3%"])


def test_a_file_holds_text_or_tables_and_the_command_line_overrules_it(tmp_path: Path) -> None:
    file = tmp_path / "scope.toml"
    file.write_text(
        'voltage = "2%+5mV"\ncurrent = "1%"\n[CH3]\ngain = 0.03\noffset = 0.01\ninstrument = "probe 7"\n',
        encoding="utf-8",
    )
    stated = {s.name: s for s in read_statements(["current=4%"], file)}
    assert (stated["voltage"].gain, stated["voltage"].offset) == (0.02, 0.005)
    assert stated["current"].gain == 0.04
    assert (stated["CH3"].gain, stated["CH3"].offset, stated["CH3"].instrument) == (0.03, 0.01, "probe 7")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("voltage = 2\n", "voltage = 2; allowed is text with a gain in %"),
        ('voltage = "2"\n', "voltage = \"2\": '2' is not understood"),
        ("[CH1]\ngain = 2\n", "CH1.gain = 2; allowed is a number of at least 0 and up to 0.5"),
        ("[CH1]\ngian = 0.02\n", "unknown key CH1.gian; did you mean gain?"),
        ("[CH1]\noffset = '5 mV'\n", "CH1.offset = '5 mV' is text, not a number"),
        ("voltage = \n", "not valid TOML"),
    ],
)
def test_a_bad_file_is_named_with_key_and_what_is_allowed(tmp_path: Path, content: str, said: str) -> None:
    file = tmp_path / "scope.toml"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_statements([], file)
    assert str(refused.value).startswith(f"{file}: ")
    assert said in str(refused.value)
    with pytest.raises(InputError, match="there is no such accuracy file"):
        read_statements([], tmp_path / "none.toml")


def test_temperatures_are_checked() -> None:
    assert copper_temperature(None, None, 0.00393) is None
    known = magnet_temperature(40.0, None, -0.001)
    assert known is not None
    assert (known.celsius, known.half_width, known.coefficient) == (40.0, 2.0, -0.001)
    for celsius, half_width, said in (
        (None, 2.0, "--temperature-uncertainty 2: give --temperature too"),
        (400.0, None, "--temperature 400: allowed is a number from -60 to 250 °C"),
        (float("nan"), None, "--temperature nan: allowed"),
        (40.0, -1.0, "--temperature-uncertainty -1: allowed is a number from 0 to 50 K"),
    ):
        with pytest.raises(UsageError, match=said):
            copper_temperature(celsius, half_width, 0.00393)
    with pytest.raises(UsageError, match=r"--copper-coefficient 0.1: allowed is a number from 0 to 0.01 1/K"):
        copper_temperature(40.0, 1.0, 0.1)
    with pytest.raises(UsageError, match=r"--magnet-coefficient 0.001: allowed"):
        magnet_temperature(40.0, 1.0, 0.001)


def test_per_cent_of_full_scale_grows_as_the_reading_falls(tmp_path):
    time = np.arange(4000) * 1e-5
    path = tmp_path / "emf.csv"
    np.savetxt(
        path,
        np.column_stack((time, 4.0 * np.sin(2 * np.pi * 100.0 * time))),
        delimiter=",",
        header="time (s),CH1 (V)",
        comments="",
    )

    def share(
        *words: str, file: Path | None = None, ranges: Sequence[str] = (), said: str = "full scale, 8 V"
    ) -> float:
        made = analyze_back_emf([path], accuracy=read_statements(words, file, ranges))
        flux = made["parameters"]["flux_linkage"]
        assert any(said in each for each in made["assumptions"])
        return max(row["contribution"] for row in flux["budget"] if "gain" in row["source"]) / flux["value"]

    # A sine of 4 V spans these 8 V: its amplitude is off by the share at most.
    assert share("CH1=1.5%fs@8V") == pytest.approx(0.015 / np.sqrt(3.0), rel=0.01)
    assert share("CH1=1%+1.5%fs@8V+5mV") == pytest.approx(0.025 / np.sqrt(3.0), rel=0.01)
    assert share("voltage=1.5%fs", ranges=["CH1=16V"], said="16 V") == pytest.approx(0.03 / np.sqrt(3.0), rel=0.01)
    assert share("CH1=1.5%fs", said="State the range with --full-scale CH1") == pytest.approx(
        0.0375 / np.sqrt(3.0), rel=0.01
    )
    file = tmp_path / "scope.toml"
    file.write_text("[CH1]\nfull_scale_gain = 0.015\nfull_scale = 8.0\n", encoding="utf-8")
    assert share(file=file) == pytest.approx(0.015 / np.sqrt(3.0), rel=0.01)
    for word, said in (
        ("CH1=0%fs", "not a full scale"),
        ("CH1=1.5%fs@2V", "beyond the full scale of 2 V"),
        ("CH1=1.5%fs@8furlong", "not a full scale"),
        ("CH1=1.5%fs@8V+1A", "an offset in A and a full scale in V"),
        ("CH1=1.5%fs@8A", "an offset in A"),
    ):
        with pytest.raises(InputError, match=said):
            analyze_back_emf([path], accuracy=read_statements([word]))
    for word, said in (
        ("CH1", "give NAME=RANGE"),
        ("CH1=0V", "give NAME=RANGE"),
        ("CH2=8V", "this analysis has no channel"),
        ("CH1=8A", "a full scale in A"),
        ("CH1=2V", "beyond the full scale of 2 V"),
    ):
        with pytest.raises(InputError, match=said):
            analyze_back_emf([path], accuracy=read_statements(["CH1=2%fs"], full_scales=[word]))
