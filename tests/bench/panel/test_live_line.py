"""The panel's line beside a batch that a terminal or a list feeds: it is followed, and can be stopped, and nothing else."""

import asyncio
from contextlib import closing
from pathlib import Path

import pytest

from bench.eol.line.admission.serial_numbers import QueuedSerials
from bench.eol.line.batch_log import BatchMotor
from bench.eol.line.panel_channel import PanelChannel
from bench.panel.live.live_line import LiveLine
from tests.bench.eol.motor_records import motor_record


def test_a_batch_begun_elsewhere_is_followed_and_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.panel.live.live_line._LOOK", 0.01)
    (tmp_path / "B1").mkdir()
    stopped: list[str] = []

    async def watch(channel: PanelChannel) -> None:
        line = LiveLine(tmp_path)
        await line.open()
        try:
            async with asyncio.timeout(10):
                while line.state is None or not line.state["sockets"][0]["last"]:
                    await asyncio.sleep(0.01)
                assert line.state["scans"] is False
                for wish in ({"serial": "P-0002"}, {"serial": "P-0002", "again": "Li"}, {"finish": "Li"}):
                    assert "does not take its serial numbers from a panel" in str(await line.say(wish))
                assert await line.say({"stop": "Li"}) is None
                (tmp_path / "B2").mkdir()
                with closing(PanelChannel("B2", "Pump", ["1"], QueuedSerials())) as scanned:
                    scanned.open(tmp_path / "B2", stopped.append, lambda _serial, _person: None)
                    while line.state is None or line.state["batch"] != "B2":
                        await asyncio.sleep(0.01)
        finally:
            await line.close()

    with closing(PanelChannel("B1", "Pump", ["1"], None)) as channel:
        channel.open(tmp_path / "B1", stopped.append, lambda _serial, _person: None)
        channel.begun(BatchMotor(1, "P-0001"), "1")
        channel.done(motor_record(1))
        asyncio.run(watch(channel))
    assert stopped == ["Li"]
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["B1", "B2"], "neither is announced any more"
