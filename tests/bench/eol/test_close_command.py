"""`motorbench eol close`: batches that were broken off, listed and closed."""

import json
import os
from contextlib import closing
from pathlib import Path

import pytest

from bench.eol.line.batch_log import ANNOUNCEMENTS, FILE, BatchLog, BatchMotor
from tests.command_line import called


def test_batches_that_were_broken_off_are_listed_and_closed_and_can_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for number, name in enumerate(("first", "second", "ended")):
        with closing(BatchLog(tmp_path / name, {})) as log:
            log.begin(BatchMotor(1, "P-1"), "1")
        os.utime(tmp_path / name / FILE, (1e9 + number, 1e9 + number))
        if name != "ended":
            (tmp_path / name / ANNOUNCEMENTS[1]).write_text("{}")
    # Cut off in writing.
    with (tmp_path / "first" / FILE).open("a") as file:
        file.write('{"number": 2, "seri')
    os.utime(tmp_path / "first" / FILE, (1e9, 1e9))
    typed = ("eol", "close", "--runs", str(tmp_path), "--json")
    assert json.loads(called(capsys, *typed)[1]) == {"closed": [], "broken_off": ["second", "first"]}
    code, _, err = called(capsys, *typed[:2], "ended", *typed[2:])
    assert code == 2
    assert "there is no batch ended that was broken off; those that were: second, first" in err
    closed = json.loads(called(capsys, *typed[:2], "first", *typed[2:], "--person", "王工")[1])
    assert closed == {"closed": ["first"], "broken_off": ["second"]}
    assert json.loads((tmp_path / "first" / FILE).read_text().splitlines()[-1])["by"] == "王工"
    with closing(BatchLog(tmp_path / "first", {})) as again:
        assert again.last == 1
        again.begin(BatchMotor(2, "P-2"), "1")
        assert [motor.number for motor in again.begun()] == [1, 2]
