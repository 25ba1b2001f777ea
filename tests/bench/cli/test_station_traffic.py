"""`station record` and `station replay`, from a served instrument to a file and through the driver again."""

import json
import signal
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
import tomli_w

from bench.station.clock import SystemClock
from bench.traffic.sessions import session_of
from bench.traffic.traffic_file import read_recording
from drivers.interfaces import Role
from sim_instruments.recorded.served import ServedRecording
from tests.command_line import Call
from tests.drivers.dialogue import DIALOGUES
from tests.studies.forked import Forked, motorbench

DIALOGUE = DIALOGUES / "keysight_34461a.traffic"


@pytest.fixture
def station(tmp_path: Path) -> Iterator[Path]:
    """A station file whose voltmeter is that of a dialogue, on a real socket."""
    sessions = {"voltmeter": session_of(read_recording(DIALOGUE), Role.VOLTMETER, tolerant=True)}
    with ServedRecording(sessions) as served:
        table = {"driver": "keysight-34461a", "address": served.addresses["voltmeter"]["socket"]}
        file = tmp_path / "station.toml"
        file.write_text(tomli_w.dumps({"station": {"name": "bench 1"}, "instruments": {"voltmeter": table}}))
        yield file


def test_from_an_instrument_to_a_file_and_through_the_driver(call: Call, station: Path, tmp_path: Path) -> None:
    file = tmp_path / "bench1.traffic"
    code, out, err = call("station", "record", str(station), "--out", str(file))
    assert (code, err) == (0, "")
    assert "✓ voltmeter" in out
    assert "19 messages" in out
    content = file.read_text()
    assert "MY53201234" not in content
    assert "127.0.0.1" not in content
    assert "bench 1" not in content
    assert "voltmeter > READ?\\n" in content
    code, out, err = call("station", "replay", str(file))
    assert (code, err) == (0, "")
    assert "✓ voltmeter" in out
    code, _, err = call("station", "record", str(station), "--out", str(file))
    assert code == 2
    assert "overwrite it with --force" in err
    code, out, _ = call("station", "record", str(station), "--out", str(file), "--force", "--identifiable", "--json")
    assert json.loads(out)["instruments"]["voltmeter"]["messages"] == 19
    assert code == 0
    assert "MY53201234" in file.read_text()


def test_an_instrument_that_is_not_there_is_recorded_as_it_is(call: Call, tmp_path: Path) -> None:
    station, file = tmp_path / "station.toml", tmp_path / "bench1.traffic"
    table = {"driver": "delta-dyn200", "address": "tcp://127.0.0.1:9", "maximum_speed": 100.0}
    station.write_text(tomli_w.dumps({"station": {"name": "bench 1"}, "instruments": {"dynamometer": table}}))
    code, out, _ = call("station", "record", str(station), "--out", str(file))
    assert code == 1
    assert "✗ dynamometer" in out
    assert read_recording(file).lines == []


def test_the_first_difference_is_shown(call: Call, tmp_path: Path) -> None:
    file = tmp_path / "other.traffic"
    file.write_text(DIALOGUE.read_text().replace("NPLC 100", "NPLC 10.0"))
    code, out, _ = call("station", "replay", str(file))
    assert code == 1
    assert out.splitlines()[-4:] == [
        "  ✗ voltmeter         keysight-34461a         11 messages sent",
        "      line 30",
        "      recorded: > VOLT:DC:NPLC 10.0\\n",
        "      today:    > VOLT:DC:NPLC 100\\n",
    ]
    code, out, _ = call("station", "replay", str(file), "--json")
    assert code == 1
    told = json.loads(out)
    assert told["good"] is False
    assert told["instruments"]["voltmeter"]["difference"]["line"] == 30
    assert call("station", "replay", str(file), "--tolerant")[0] == 0


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[station]\n", "no recording of motorbench"),
        (DIALOGUE.read_text()[:600], "the file ends early"),
        (DIALOGUE.read_text().replace("traffic 1", "traffic 7"), "a recording of version 7"),
        (DIALOGUE.read_text().replace("keysight-34461a", "acme-dm5"), "acme-dm5"),
        (
            DIALOGUE.read_text().replace("measure_voltage()", "make_coffee()"),
            "line 33: 'make_coffee()' is no call of voltmeter",
        ),
    ],
)
def test_a_file_that_is_no_recording(call: Call, tmp_path: Path, content: str, said: str) -> None:
    file = tmp_path / "sent.traffic"
    file.write_text(content)
    code, out, err = call("station", "replay", str(file))
    assert (code, out) == (2, "")
    assert said in err
    assert len(err.splitlines()) == 1


def test_a_place_that_cannot_be_written(call: Call, station: Path, tmp_path: Path) -> None:
    code, _, err = call("station", "record", str(station), "--out", str(tmp_path / "nowhere" / "one.traffic"))
    assert code == 2
    assert "there is no folder" in err


def test_serve_ends_with_a_signal(tmp_path: Path) -> None:
    process = Forked(motorbench, "station", "replay", str(DIALOGUE), "--serve")
    with closing(process):
        first = process.stdout.readline()
        # It serves once the station has been named.
        while process.stdout.readline() != "\n":
            continue
        process.send_signal(signal.SIGTERM)
        output, errors = process.communicate(timeout=10.0)
    assert process.returncode == 0
    assert first.startswith("# voltmeter         hislip  TCPIP0::127.0.0.1::hislip0,")
    assert 'driver = "keysight-34461a"' in output
    assert "is served" in errors


@pytest.mark.parametrize("typed", [("--host", "::1"), ("--base-port", "80")])
def test_what_cannot_be_served_on(call: Call, typed: tuple[str, ...]) -> None:
    code, _, err = call("station", "replay", str(DIALOGUE), "--serve", *typed)
    assert code == 2
    assert "allowed is" in err or "give an IPv4 address" in err


def test_what_a_killed_run_recorded_replays(call: Call, tmp_path: Path) -> None:
    file = tmp_path / "run.traffic"
    run = ("stator-resistance-dc", "--station", "virtual", "--motor", "lg-400w", "--runs", str(tmp_path / "runs"))
    process = Forked(motorbench, "run", *run, "--record", str(file))
    with closing(process):
        while not file.exists() or b"voltmeter < " not in file.read_bytes():
            SystemClock().sleep(0.001)
        process.send_signal(signal.SIGKILL)
        process.communicate(timeout=10.0)
    kept = read_recording(file)
    assert kept.unfinished
    assert {Role.SUPPLY, Role.VOLTMETER} <= {line.role for line in kept.lines}
    code, out, err = call("station", "replay", str(file))
    assert (code, err) == (0, "")
    assert f"cut short after {len(kept.lines)} lines" in out


def test_a_run_is_recorded_and_replayed(call: Call, tmp_path: Path) -> None:
    file = tmp_path / "run.traffic"
    run = ("stator-resistance-dc", "--station", "virtual", "--motor", "lg-400w", "--runs", str(tmp_path / "runs"))
    assert call("run", *run, "--record", str(file))[0] == 0
    content = file.read_text()
    assert "supply = with energised(" in content
    code, out, _ = call("station", "replay", str(file))
    assert code == 0, out
    for taken, said in ((file, "the file already exists"), (tmp_path / "nowhere" / "run.traffic", "cannot be written")):
        code, _, err = call("run", *run, "--record", str(taken))
        assert code == 2
        assert said in err
