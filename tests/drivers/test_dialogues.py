"""Each recorded dialogue: today's driver does the same calls' messages, in their order, and reads the same out of the answers."""

from pathlib import Path

import pytest

from bench.testing.recordings import check_recording
from tests.drivers.dialogue import DIALOGUES


@pytest.mark.parametrize("file", sorted(DIALOGUES.glob("*.traffic")), ids=lambda file: file.stem)
def test_dialogue(file: Path) -> None:
    check_recording(file)
