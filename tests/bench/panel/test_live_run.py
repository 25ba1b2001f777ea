import asyncio
import json
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path

import pytest

from bench.i18n.errors import InputError
from bench.journal.journal import Journal
from bench.panel.bench_state import bench_state
from bench.panel.launch import Launcher, Order
from bench.panel.live.live_run import LiveRun
from bench.panel.live.tail import JournalTail
from tests.journals import event

STATIC = Order(("pole-pairs-static",), "virtual", "lg-400w", "J. Doe")


async def until(seen: Callable[[], bool]) -> None:
    async with asyncio.timeout(30):
        while not seen():
            await asyncio.sleep(0.01)


async def confirm_all(run: LiveRun) -> None:
    """Do as a person does who confirms whatever is asked, once the page lets it be confirmed."""
    answered = 0
    async with asyncio.timeout(60):
        while not run.view.ended:
            question = run.line.question
            if question is not None and question["id"] != answered and bench_state(run).waits is None:
                answered = question["id"]
                assert await run.line.answer(answered, question.get("proposed")) is None
            await asyncio.sleep(0.005)


def led(runs: Path, order: Order, lead: Callable[[LiveRun], Awaitable[None]]) -> LiveRun:
    async def go() -> LiveRun:
        run = LiveRun(await Launcher(runs).start(order))
        await run.open()
        try:
            await lead(run)
        finally:
            await run.close()
        return run

    return asyncio.run(go())


def test_the_tail_gives_each_whole_line_once(tmp_path: Path) -> None:
    tail = JournalTail(tmp_path / "journal.jsonl")
    assert list(tail.read_new()) == []
    journal = Journal(tmp_path / "journal.jsonl", lambda: 1.5)
    journal.record(event("reading", value=1))
    journal.record(event("reading", value="ü"))
    assert [(event.kind, event.data["value"]) for event in tail.read_new()] == [("reading", 1), ("reading", "ü")]
    with journal.path.open("ab") as file:
        file.write(b'{"n":3,"wall":"","ti')
        file.flush()
        assert list(tail.read_new()) == []
        file.write(b'me":2.5,"kind":"three","data":{},"previous":""}\n')
    journal.close()
    assert [(event.number, event.kind) for event in tail.read_new()] == [(3, "three")]
    assert list(tail.read_new()) == []


@pytest.mark.parametrize(
    "procedures", [("back-emf-shape", "no-load-current"), ("dq-inductance-time-constant",)], ids=("runs down", "locked")
)
def test_what_the_page_waits_for_comes(tmp_path: Path, procedures: tuple[str, ...]) -> None:
    """A shaft that runs down comes to rest while a person is asked; one that current holds may be locked."""
    run = led(tmp_path, replace(STATIC, procedures=procedures), confirm_all)
    assert run.view.run.status == "completed"


def test_a_run_is_followed_and_led_to_its_end(tmp_path: Path) -> None:
    run = led(tmp_path, STATIC, confirm_all)
    assert run.view.run.status == "completed"
    assert run.view.run.parameters().parameters["pole_pairs"].value == 4
    assert run.view.energised == {}
    assert run.view.instruments["supply"].driver
    assert run.view.layout.terminals is not None
    assert run.view.latest is not None
    assert run.view.outdated, "what was read while the supply was on is of the past"


def test_the_newest_reading_is_what_the_bridge_was_asked_for(tmp_path: Path) -> None:
    run = led(tmp_path, Order(("dq-inductance-extremes",), "virtual", "lg-400w", "J. Doe"), confirm_all)
    # At 1 kHz it was asked for the inductance, at last, at 20 Hz, for the resistance.
    latest = run.view.latest
    assert latest is not None
    assert (latest.instrument, str(latest.quantity), latest.unit) == ("lcr_meter", "resistance", "Ω")
    inductance = run.view.readings["lcr_meter", "inductance"]
    assert inductance.unit == "H"
    assert inductance.values[-1] == pytest.approx(150e-6, rel=0.05)


def test_the_open_question_shows_what_is_to_be_connected(tmp_path: Path) -> None:
    async def lead(run: LiveRun) -> None:
        await until(lambda: run.line.question is not None)
        await until(lambda: run.view.action is not None)
        assert run.line.question["action"] == type(run.view.action).__name__
        assert run.running
        # A second panel, or a restarted one, sees the same.
        again = LiveRun(run.folder.path)
        await again.open()
        await until(lambda: again.line.question is not None)
        assert again.line.question == run.line.question
        assert (again.view.step, again.view.action) == (run.view.step, run.view.action)
        await again.close()
        assert await run.line.abort("J. Doe") is None
        await until(lambda: run.view.ended)

    run = led(tmp_path, STATIC, lead)
    assert run.view.run.status == "aborted"
    assert "J. Doe" in run.view.run.cause
    assert not run.running


def test_what_cannot_begin_says_why(tmp_path: Path) -> None:
    async def start(order: Order) -> None:
        await Launcher(tmp_path).start(order)

    with pytest.raises(InputError, match="'polepairs' is neither a procedure nor all"):
        asyncio.run(start(Order(("polepairs",), "virtual", "lg-400w", "")))
    with pytest.raises(InputError, match=r"missing\.toml"):
        asyncio.run(start(Order(("nameplate",), "missing.toml", "lg-400w", "--help")))
    assert not list(tmp_path.iterdir())


def test_a_run_that_was_killed_is_no_running_one(tmp_path: Path) -> None:
    folder = tmp_path / "killed"
    folder.mkdir()
    (folder / "operator.json").write_text(json.dumps({"pid": 1, "port": 9, "token": "x"}))
    Journal(folder / "journal.jsonl", lambda: 0.0).record(event("energising", instrument="supply", call="energised"))

    async def look() -> None:
        run = LiveRun(folder)
        await run.open()
        assert not run.running
        assert run.view.energised == {"supply": 0.0}
        assert str(await run.line.answer(1, None)) == "the run has ended"
        await run.close()

    asyncio.run(look())
