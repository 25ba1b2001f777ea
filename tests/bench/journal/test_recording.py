from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from bench.journal.journal import Journal
from bench.journal.journal_file import read_journal
from bench.journal.recording import Recording
from bench.journal.waveforms import StoredRecord
from drivers.interfaces import CommunicationError, Waveform
from procedures.core.bench import Role


class Sink:
    def __init__(self) -> None:
        self.kept: list[Mapping[str, Waveform]] = []

    def store(self, name: str, waveforms: Mapping[str, Waveform]) -> StoredRecord:
        self.kept.append(waveforms)
        return StoredRecord(f"waveforms/{len(self.kept)}-{name}.h5", "ab" * 32, 100)


@pytest.fixture
def recorded(tmp_path: Path, fakes: dict[Role, Any]) -> Any:
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)
    yield {role: Recording(fake, role.value, journal, Sink()) for role, fake in fakes.items()}
    journal.close()


def events(tmp_path: Path) -> list[tuple[str, dict[str, Any]]]:
    return [(event.kind, dict(event.data)) for event in read_journal(tmp_path / "journal.jsonl").events]


def test_settings_readings_and_energised_blocks_are_events(tmp_path: Path, recorded: Any) -> None:
    supply = recorded[Role.SUPPLY]
    supply.configure(1.0, current_limit=2.0)
    with supply.energised(1.0, 2.0):
        assert supply.measure_current().value == 1.25
    kinds = [kind for kind, _ in events(tmp_path)]
    assert kinds == ["commanding", "setting", "energising", "energised", "reading", "de_energised"]
    command, first, reading = (events(tmp_path)[number][1] for number in (0, 1, 4))
    assert command == first
    assert first == {"instrument": "supply", "call": "configure", "arguments": [1.0], "named": {"current_limit": 2.0}}
    assert reading["value"]["value"] == 1.25
    assert reading["value"]["accuracy"]["source"] == "fake"


def test_waveforms_are_stored_and_referred_to(tmp_path: Path, recorded: Any) -> None:
    waves = recorded[Role.OSCILLOSCOPE].fetch([1, 3], timeout=1.0)
    assert set(waves) == {1, 3}
    ((kind, data),) = events(tmp_path)
    assert kind == "waveforms"
    assert data["file"] == {"path": "waveforms/1-oscilloscope.h5", "sha256": "ab" * 32, "bytes": 100}
    assert data["value"]["3"]["waveform"] == "waveforms/1-oscilloscope.h5#channel3"
    assert data["value"]["3"]["samples"] == 4


def test_errors_are_events_and_raised(tmp_path: Path, recorded: Any, fakes: dict[Role, Any]) -> None:
    fakes[Role.SUPPLY].failing["measure_current"] = CommunicationError("supply", "no reply")
    with pytest.raises(CommunicationError):
        recorded[Role.SUPPLY].measure_current()
    ((kind, data),) = events(tmp_path)
    assert kind == "instrument_error"
    assert data["error"] == "CommunicationError: supply: no reply"


@pytest.mark.parametrize("what", ["on", "off"])
def test_a_block_that_fails_at_either_end_is_told(
    tmp_path: Path, recorded: Any, fakes: dict[Role, Any], what: str
) -> None:
    fakes[Role.SUPPLY].failing[what] = CommunicationError("supply", "no reply")
    with pytest.raises(CommunicationError), recorded[Role.SUPPLY].energised(1.0, 1.0):
        pass
    kind, data = events(tmp_path)[-1]
    assert kind == "de_energised"
    assert "no reply" in data["error"]


def test_what_belongs_to_the_instrument_passes(recorded: Any) -> None:
    assert recorded[Role.SUPPLY].maximum_current == 10.0
    assert recorded[Role.SUPPLY].identity.model == "supply"
    with pytest.raises(AttributeError, match="wavelength"):
        recorded[Role.SUPPLY].wavelength()
