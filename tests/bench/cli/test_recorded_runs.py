"""`run --record` and `station replay` where there is nothing to record, or nothing was."""

from pathlib import Path

from tests.command_line import Call

RUN = ("run", "nameplate", "--station", "virtual", "--motor", "lg-400w")


def test_a_recording_that_is_refused_makes_no_run(call: Call, tmp_path: Path) -> None:
    (tmp_path / "there.traffic").write_text("mine", encoding="utf-8")
    code, _, err = call(*RUN, "--record", "there.traffic")
    assert (code, "the file already exists" in err) == (2, True)
    assert not (tmp_path / "runs").exists()
    assert (tmp_path / "there.traffic").read_text(encoding="utf-8") == "mine"


def test_a_recording_without_a_message_is_not_called_good(call: Call) -> None:
    assert call(*RUN, "--record", "empty.traffic")[0] == 0
    code, _, err = call("station", "replay", "empty.traffic")
    assert (code, "no instrument's messages are in it" in err) == (2, True)
