"""Numbers as people type them."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.operators.typed import parted, typed_number


@pytest.mark.parametrize(
    ("typed", "unit", "value"),
    [
        ("5,2", "Ω", 5.2),
        ("5.2", "Ω", 5.2),
        (" .5 ", "V", 0.5),
        ("−3", "A", -3.0),
        ("31 mOhm", "Ω", 0.031),
        ("31mohm", "Ω", 0.031),
        ("5.2 mΩ", "Ω", 0.0052),
        ("5.2 m\u2126", "Ω", 0.0052),
        ("4,7 kΩ", "Ω", 4700.0),
        ("1.5 MOhm", "Ω", 1.5e6),
        ("73 uH", "H", 73e-6),
        ("73 µH", "H", 73e-6),
        ("1.2 mH", "µH", 1200.0),
        ("73", "µH", 73.0),
        ("12 mV", "V", 0.012),
        ("250 mA", "A", 0.25),
        ("1500 rpm", "rpm", 1500.0),
        ("1500 1/min", "rpm", 1500.0),
        ("25 °C", "°C", 25.0),
        ("-5,5 C", "°C", -5.5),
        ("120 mNm", "N·m", 0.12),
        ("0,016", "Ω", 0.016),
        ("１２.５", "V", 12.5),
        ("2", "", 2.0),
        ("30 毫欧", "Ω", 0.03),
        ("30 欧姆", "Ω", 30.0),
        ("30m欧", "Ω", 0.03),
        ("３０ｍΩ", "Ω", 0.03),
        ("５㏀", "Ω", 5000.0),
        ("－３．５　毫伏", "V", -0.0035),
        ("2.5 千伏", "V", 2500.0),
        ("1 兆欧姆", "Ω", 1e6),
        ("250 毫安", "A", 0.25),
        ("2 安培", "A", 2.0),
        ("73 微亨", "H", 73e-6),
        ("73 微亨利", "µH", 73.0),
        ("100 千赫兹", "Hz", 1e5),
        ("120 毫牛米", "N·m", 0.12),
        ("1.5 牛·米", "N·m", 1.5),
        ("1500 转/分钟", "rpm", 1500.0),
        ("1500转每分", "rpm", 1500.0),
        ("157 弧度/秒", "rad/s", 157.0),
        ("90 度", "°", 90.0),
        ("23.5 度", "°C", 23.5),
        ("23.5 摄氏度", "°C", 23.5),
        ("20 毫秒", "s", 0.02),
        ("５％", "%", 5.0),
    ],
)
def test_a_number_is_taken_in_the_unit_asked_for(typed: str, unit: str, value: float) -> None:
    assert typed_number(typed, unit) == value


@pytest.mark.parametrize(
    ("typed", "unit", "said"),
    [
        ("", "Ω", "is not a number"),
        ("five", "Ω", "is not a number"),
        ("nan", "Ω", "is not a number"),
        ("1e400", "V", "is not a number"),
        ("31 mH", "Ω", "'31 mH' is in mH, and Ω is asked for; type it like 12.3 / 12,3 Ω / 12.3 mΩ"),
        ("50 Hz", "rpm", "is in Hz, and rpm is asked for"),
        ("5 furlongs", "V", "the unit furlongs is not known here"),
        ("1,500", "rpm", "'1,500' could mean 1500 or 1.500; type one of these"),
        ("1.234,5", "V", "more than one decimal sign or a gap"),
        ("1 500", "rpm", "more than one decimal sign or a gap"),
        ("3 V", "", "is not a number"),
        ("30 毫亨", "Ω", "'30 毫亨' is in 毫亨, and Ω is asked for; type it like 12.3 / 12,3 Ω / 12.3 mΩ"),
        ("25 度", "V", "is in 度, and V is asked for"),
        ("25 摄氏度", "°", "is in 摄氏度, and ° is asked for"),
        ("30 毫", "Ω", "the unit 毫 is not known here"),
        # No hundred and two.
        ("10²", "Ω", "has more than one decimal sign or a gap"),
        ("１，５００", "rpm", "could mean 1500 or 1.500; type one of these"),
    ],
)
def test_what_could_mean_something_else_is_refused_in_a_sentence(typed: str, unit: str, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        typed_number(typed, unit)


@given(st.floats(-1e6, 1e6, allow_nan=False), st.sampled_from([("m", 1e-3), ("µ", 1e-6), ("k", 1e3), ("", 1.0)]))
def test_a_prefix_changes_the_value_by_its_factor_alone(value: float, prefix: tuple[str, float]) -> None:
    assert typed_number(f"{value!r} {prefix[0]}V", "V") == pytest.approx(value * prefix[1], rel=1e-15, abs=0.0)


def test_a_list_is_parted_as_people_part_it() -> None:
    assert parted(" ０　90；180,5、 270° ") == ["0", "90", "180,5", "270°"]
    assert parted("  ") == []
