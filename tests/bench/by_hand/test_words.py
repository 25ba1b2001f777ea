"""What commands are called."""

import pytest

from bench.by_hand.words import command_words
from bench.i18n.language import translator


@pytest.mark.parametrize(
    ("typed", "english", "chinese"),
    [
        (
            "supply energised voltage=1V current_limit=500mA regulated=current",
            "DC supply: output on · voltage 1 V · current limit 500 mA · regulated quantity: current",
            "直流电源：接通输出 · 电压 1 V · 限流 500 mA · 恒定量：电流",
        ),
        ("supply energised 5 V 1e-1A", "DC supply: output on · 5 V · 1e-1 A", "直流电源：接通输出 · 5 V · 1e-1 A"),
        ("tachometer measure_speed", "Tachometer: read the speed", "转速表：读转速"),
        # What is no command to an instrument is shown as it was typed.
        ("connect A=supply+ B=supply-", "connect A=supply+ B=supply-", "connect A=supply+ B=supply-"),
        ("supply", "supply", "supply"),
    ],
)
def test_a_command_is_told_in_the_readers_words(typed: str, english: str, chinese: str) -> None:
    said = command_words(typed)
    assert str(said).replace("\u00a0", " ") == english
    assert said.render(translator("zh")).replace("\u00a0", " ") == chinese
