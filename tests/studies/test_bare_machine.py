"""What the study of the bare machine reads and judges; the study itself takes minutes."""

import pytest

from tests.studies.bare_machine import Outcome, promised


def test_the_readme_promises_two_commands() -> None:
    assert promised() == ("python3 -m pip install uv && uv run motorbench demo", "uv run pytest")


@pytest.mark.parametrize(
    ("status", "output", "trouble"),
    [
        (0, "all well\n\n", ""),
        (
            0,
            "SKIPPED [1] tests/x.py:3: the captures are not beside the repository\n1 passed",
            "skips more than browser tests: SKIPPED [1] tests/x.py:3: the captures are not beside the repository",
        ),
        (0, "SKIPPED [24] tests/x.py:0: no Chromium on this machine (Debian: …)\n1 passed, 24 skipped", ""),
        (
            0,
            "SKIPPED [1] tests/x.py:3: no server\n1 passed",
            "skips more than browser tests: SKIPPED [1] tests/x.py:3: no server",
        ),
        (1, "1 failed, 2 passed", "ends with 1"),
    ],
)
def test_how_a_command_is_judged(status: int, output: str, trouble: str) -> None:
    outcome = Outcome(status, output, 1.0, with_data=True)
    assert outcome.trouble == trouble
    if "captures" in output:
        assert Outcome(status, output, 1.0, with_data=False).trouble == ""
    assert outcome.last_line == output.strip().splitlines()[-1]
