"""Alarms of the whole set reach result, journal and summary."""

import json
from pathlib import Path

import pytest

from bench.cli.main import main
from bench.motor.shipped_motors import motor_content


@pytest.fixture
def counting_poles(tmp_path):
    """Return the 400 W motor's file with the number of poles where the pole pairs belong."""
    path = tmp_path / "motor.toml"
    _, content, _ = motor_content("lg-400w")
    wrong = content.decode().replace("[nameplate]\n", "[nameplate]\npole_pairs = 8\n", 1)
    path.write_text(wrong, encoding="utf-8")
    return str(path)


def test_poles_on_the_plate(motorbench, counting_poles, capsys):
    status, given = motorbench("run", "pole-pairs-static", "--station", "virtual", "--motor", counting_poles)
    assert status == 0
    (warning,) = given["warnings"]
    assert (warning["id"], warning["procedure"]) == ("consistency-pole-pairs", None)
    assert warning["message"] == (
        "nameplate: 8 pole pairs, but pole-pairs-static: 4. Likely: poles counted for pole pairs"
    )
    events = [json.loads(line) for line in (Path(given["run"]) / "journal.jsonl").read_bytes().splitlines()]
    (checked,) = [event["data"] for event in events if event["kind"] == "consistency_checked"]
    assert [entry["id"] for entry in checked["warnings"]] == ["consistency-pole-pairs"]
    for language, likely in (("en", "poles counted for pole pairs"), ("zh", "把极数当作极对数")):
        with pytest.raises(SystemExit):
            main(["results", given["run"], "--language", language])
        assert likely in capsys.readouterr().out.replace("\n  ", " ")


def test_a_resumed_run_judges_the_whole_again(motorbench, counting_poles):
    _, first = motorbench("run", "pole-pairs-static", "--station", "virtual", "--motor", counting_poles)
    _, again = motorbench("run", "pole-pairs-inverter", "--resume", first["run"])
    (warning,) = again["warnings"]
    assert "pole-pairs-static, pole-pairs-inverter: 4" in warning["message"]
