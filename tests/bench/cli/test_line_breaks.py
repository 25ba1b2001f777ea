"""Lines of Chinese end between characters, and no name, number or option is taken apart."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from bench.cli.line_breaks import broken
from tests.command_line import Call

_WORDS = st.lists(
    st.tuples(
        st.sampled_from(("电", "（", "--list", "mathworks", "0.5", "Ω", "[默认：x]", "测试台")),
        st.sampled_from(("", "", " ", "，", "、", "）。")),
    ).map("".join),
    max_size=40,
).map("".join)


@given(_WORDS, st.integers(24, 80))
def test_no_line_is_wider_than_asked_or_begins_with_a_mark_and_nothing_is_lost(words: str, width: int) -> None:
    lines = broken(words, width).split("\n")
    assert all(cell_len(line.rstrip()) <= width for line in lines if "（（" not in line)
    assert "".join(lines).replace(" ", "") == words.replace(" ", "")
    assert not any(line[0] in "，、）。" for line in lines[1:])


@pytest.mark.parametrize("width", [20, 24, 30, 40])
def test_names_stay_whole(width: int) -> None:
    said = "目标名称，见 --list：vesc、odrive（固件 0.5）、odrive-0.6、mathworks；磁链图可用 c-tables。"
    lines = broken(said, width).split("\n")
    for name in ("--list", "odrive-0.6", "mathworks", "c-tables"):
        assert sum(name in line for line in lines) == 1


def test_the_help_on_a_terminal_of_80_columns(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    _, out, _ = call("--language", "zh", "export", "--help")
    assert "mathworks、" in out
    assert max(map(cell_len, out.splitlines())) <= 80
    assert "[默认：06:00 14:00 22:00]" in call("--language=zh", "eol", "stats", "--help")[1]
    assert "[default: 06:00 14:00 22:00]" in " ".join(call("eol", "stats", "--help")[1].split())


def test_the_language_may_stand_before_the_command(call: Call) -> None:
    assert call("--language", "zh") == call("--help", "--language", "zh")
    assert call("--language", "zh", "run", "all") == call("run", "all", "--language", "zh")
