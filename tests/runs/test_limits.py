"""Limits of the motor end a run before or while it energises, each named, and nothing is left on."""

from pathlib import Path

import pytest

from bench.journal.journal_file import read_journal
from bench.motor.shipped_motors import motor_content


@pytest.fixture
def motor_file(tmp_path):
    """Return a function that writes a shipped motor's file with other lines on its nameplate."""

    def write(**lines: float) -> str:
        text = motor_content("lg-400w")[1].decode()
        plate, virtual = text.split("[nameplate.wire_colours]", 1)
        kept = [line for line in plate.splitlines() if not any(line.startswith(key) for key in lines)]
        given = [f"{key} = {value}" for key, value in lines.items()]
        path = tmp_path / "motor.toml"
        path.write_text("\n".join([*kept, *given, "[nameplate.wire_colours]"]) + virtual, encoding="utf-8")
        return str(path)

    return write


def energised(run: str) -> list[str]:
    events = read_journal(Path(run) / "journal.jsonl").events
    return [event.data["instrument"] for event in events if event.kind == "energising"]


def test_a_winding_above_its_temperature_is_not_energised(motorbench) -> None:
    status, result = motorbench(
        "run", "stator-resistance-dc", "--station", "virtual", "--motor", "lg-400w", "--set", "winding_temperature=140"
    )
    assert status == 1
    assert "winding temperature = 140 °C is above 130 °C, the limit of the motor" in result["cause"]
    assert energised(result["run"]) == []


def test_a_winding_that_warms_beyond_its_limit_is_seen_by_its_resistance(motorbench, motor_file) -> None:
    motor = motor_file(maximum_winding_temperature=25.1)
    settings = ("--set", "winding_temperature=25", "--set", "settle=60", "--set", "current_share=0.3")
    status, result = motorbench("run", "stator-resistance-dc", "--station", "virtual", "--motor", motor, *settings)
    assert status == 1
    assert "is above 25.1 °C, the limit of the motor (nameplate.maximum_winding_temperature)" in result["cause"]
    # It is seen after the first pair of terminals (five levels and the wiring's check, both polarities): no other is energised.
    assert len(energised(result["run"])) == 12
    cooler = motor_file(maximum_winding_temperature=80.0)
    status, result = motorbench("run", "stator-resistance-dc", "--station", "virtual", "--motor", cooler, *settings)
    assert status == 0, result.get("cause")


def test_a_speed_beyond_the_motors_is_refused_whatever_the_settings_ask(motorbench, motor_file) -> None:
    motor = motor_file(maximum_speed_rpm=3000.0, pole_pairs=4)
    status, result = motorbench(
        "run", "pole-pairs-inverter", "--station", "virtual", "--motor", motor, "--set", "frequency=400"
    )
    assert status in (0, 1)
    events = read_journal(Path(result["run"]) / "journal.jsonl").events
    commanded = [event.data["arguments"][0] for event in events if event.kind == "energising"]
    assert commanded
    assert max(commanded) == pytest.approx(200.0)
