"""The tutorial's commands, typed one after the other as they stand in its Markdown; what it shows of their output is what they print."""

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from bench.cli.main import make_app
from tests.command_line import Call

PAGE = Path(__file__).parents[3] / "docs" / "tutorial.md"
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
LEFT_OUT = "…"


def words(line: str) -> str:
    """A line without what differs from run to run and from machine to machine: figures, hashes and room between columns."""
    return " ".join(re.sub(r"[0-9a-f]{16}…|\d+T\d+Z|[\d.]+(e[+-]\d+)?", "#", line).split())


def dialogue(block: str) -> Iterator[tuple[list[str], list[str]]]:
    """The commands of a block, each with the lines that are shown of what it prints."""
    for typed in re.split(r"^\$ uv run ", block, flags=re.MULTILINE)[1:]:
        command, *shown = typed.splitlines()
        yield shlex.split(command), shown


def printed(call: Call, command: list[str]) -> str:
    program, *arguments = command
    if program == "motorbench":
        _, out, err = call(*arguments)
        # At a terminal its progress stands above the table.
        return err + out
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=True)
    return done.stdout


def shown_in_order(shown: list[str], lines: list[str]) -> str | None:
    """The first line that is shown and not printed after those before it; None where there is none."""
    at = 0
    for line in shown:
        if line == LEFT_OUT:
            continue
        try:
            at = lines.index(words(line), at) + 1
        except ValueError:
            return line
    return None


@pytest.mark.slow
def test_what_is_typed_prints_what_is_shown(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(".")
    typed = 0
    for language, block in BLOCKS:
        if language == "toml":
            name = block.splitlines()[0].removeprefix("# ")
            Path(name).write_text(block, encoding="utf-8")
        elif language == "console":
            for command, shown in dialogue(block):
                said = printed(call, command)
                lines = [words(line) for line in said.splitlines()]
                assert (missing := shown_in_order(shown, lines)) is None, f"{shlex.join(command)}: {missing}\n{said}"
                typed += 1
    assert typed > 8
    assert list(Path("runs").glob("*-my-motor/report-en.pdf"))


@pytest.mark.parametrize(
    "command", [line for language, block in BLOCKS if language == "sh" for line in block.splitlines()]
)
def test_what_runs_on_or_takes_long_can_be_typed(command: str) -> None:
    _, found, arguments = command.partition("uv run motorbench ")
    if found:
        make_app().parse_args(shlex.split(arguments), exit_on_error=False, print_error=False)
    else:
        assert command == "python3 -m pip install uv"
