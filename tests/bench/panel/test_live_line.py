"""The panel's line beside a batch that a terminal or a list feeds: it is followed, and can be stopped, and nothing else."""

import asyncio
from contextlib import closing
from pathlib import Path

import pytest

from bench.eol.line.admission.serial_numbers import QueuedSerials
from bench.eol.line.batch_log import BatchLog, BatchMotor, broken_off, close_batch
from bench.eol.line.panel_channel import WATCHED, PanelChannel
from bench.i18n.errors import InputError
from bench.panel.live.live_line import LiveLine
from tests.bench.eol.motor_records import motor_record


def test_a_batch_begun_elsewhere_is_followed_and_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.panel.live.live_line._LOOK", 0.01)
    (tmp_path / "B1").mkdir()
    stopped: list[str] = []

    async def watch() -> None:
        line = LiveLine(tmp_path)
        await line.open()
        try:
            async with asyncio.timeout(10):
                while not (batch := line.shown()) or not batch.state or not batch.state["sockets"][0]["last"]:
                    await asyncio.sleep(0.01)
                assert batch.state["scans"] is False
                for wish in ({"serial": "P-0002"}, {"serial": "P-0002", "again": "Li"}, {"finish": "Li"}):
                    assert "does not take its serial numbers from a panel" in str(await batch.say(wish))
                (tmp_path / "B2").mkdir()
                with closing(PanelChannel("B2", "Pump", ["2"], QueuedSerials())) as scanned:
                    scanned.open(tmp_path / "B2", stopped.append, lambda _serial, _person: None)
                    while len(line.running) < 2:
                        await asyncio.sleep(0.01)
                    # What is scanned for comes first, and either can be chosen.
                    assert [each.folder.name for each in line.running] == ["B2", "B1"]
                    assert (line.shown(), line.shown("B1"), line.shown("B9")) == (line.running[0], batch, None)
                    assert await batch.say({"stop": "Li"}) is None
                while len(line.running) > 1:
                    await asyncio.sleep(0.01)
                assert not line.broken_off
        finally:
            await line.close()

    with closing(PanelChannel("B1", "Pump", ["1"], None)) as channel:
        channel.open(tmp_path / "B1", stopped.append, lambda _serial, _person: None)
        channel.begun(BatchMotor(1, "P-0001"), "1")
        channel.done(motor_record(1))
        asyncio.run(watch())
    assert stopped == ["Li"]
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["B1", "B2"], "neither is announced any more"


def test_a_batch_that_is_killed_between_two_motors_is_broken_off_until_it_is_begun_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It leaves its announcement, and no process holds its log."""
    monkeypatch.setattr("bench.panel.live.live_line._LOOK", 0.01)
    log = BatchLog(tmp_path / "B1", {})
    channel = PanelChannel("B1", "Pump", ["1"], None)
    channel.open(tmp_path / "B1", lambda _person: None, lambda _serial, _person: None)
    assert not broken_off(tmp_path / "B1")

    async def watch() -> None:
        line = LiveLine(tmp_path)
        await line.open()
        try:
            async with asyncio.timeout(10):
                while not line.running:
                    await asyncio.sleep(0.01)
                announced = (tmp_path / "B1" / WATCHED).read_bytes()
                channel.close()
                (tmp_path / "B1" / WATCHED).write_bytes(announced)
                log.close()
                while line.running:
                    await asyncio.sleep(0.01)
                assert [each.folder.name for each in line.broken_off] == ["B1"]
                assert broken_off(tmp_path / "B1")
                with (
                    pytest.raises(InputError, match="another process is measuring"),
                    closing(BatchLog(tmp_path / "B1", {})),
                ):
                    close_batch(tmp_path / "B1", "王工")
                close_batch(tmp_path / "B1", "王工")
                assert not broken_off(tmp_path / "B1")
                assert not line.broken_off
                (tmp_path / "B1" / WATCHED).write_bytes(announced)
                with closing(PanelChannel("B1", "Pump", ["1"], QueuedSerials())) as again:
                    again.open(tmp_path / "B1", lambda _person: None, lambda _serial, _person: None)
                    while not line.running:
                        await asyncio.sleep(0.01)
                    assert not line.broken_off
                assert not broken_off(tmp_path / "B1")
        finally:
            await line.close()

    asyncio.run(watch())
