"""A person at a terminal in front of a served bench: whatever becomes of the run, nothing stays on."""

import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bench.journal.guardian_record import read_guardian
from bench.journal.journal_file import read_journal
from tests.studies.energised.held import PATIENCE, Served
from tests.studies.forked import Forked, motorbench

ON = ("connect A=supply+ B=supply-", "", "supply energised 1 V 1 A regulated=current", "yes")


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    made = Served(tmp_path_factory.mktemp("served"), wired=False)
    yield made
    made.end()


class Terminal:
    """A run by hand, and the keys that are pressed."""

    def __init__(self, served: Served, runs: Path, *more: str) -> None:
        words = ("run", "by-hand", "--station", str(served.station), "--motor", "lg-400w", "--runs", str(runs))
        self.process = Forked(motorbench, *words, "--operator", "terminal", "--language", "en", *more)
        self.served, self.runs = served, runs

    def type(self, *lines: str) -> None:
        self.process.stdin.write("".join(f"{line}\n" for line in lines))
        self.process.stdin.flush()

    def switch_on(self) -> None:
        self.type(*ON)
        assert self.served.truth_becomes("output_on", True)

    def journal(self) -> list[str]:
        (folder,) = self.runs.iterdir()
        return [one.kind for one in read_journal(folder / "journal.jsonl").events]

    def ended(self) -> tuple[int | None, str, str]:
        out, err = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, out, err


@pytest.fixture
def terminal(served: Served, tmp_path: Path) -> Iterator[Callable[..., Terminal]]:
    begun = list[Terminal]()

    def begin(*more: str) -> Terminal:
        begun.append(Terminal(served, tmp_path, *more))
        return begun[-1]

    yield begin
    for one in begun:
        one.process.close()


def test_ctrl_c_switches_off(terminal: Callable[..., Terminal], served: Served) -> None:
    run = terminal()
    run.switch_on()
    run.process.send_signal(signal.SIGINT)
    served.seconds_until_off()
    status, _, err = run.ended()
    assert status == 1
    assert "aborted" in err
    assert "--resume" not in err
    assert run.journal()[-1] == "run_finished"


def test_the_guardian_switches_off_what_a_killed_run_left_on(terminal: Callable[..., Terminal], served: Served) -> None:
    run = terminal()
    run.switch_on()
    run.process.send_signal(signal.SIGKILL)
    served.seconds_until_off()
    (folder,) = run.runs.iterdir()
    begun = time.monotonic()
    while read_guardian(folder)[-1].kind != "left":
        assert time.monotonic() - begun < PATIENCE
        served.world.clock.sleep(0.2)
    took = next(one.data for one in read_guardian(folder) if one.kind == "took")
    assert took["cause"] == "the run's process has died"
    # On the disk before it was sent; that it was done may come too late.
    assert "energising" in run.journal()


def test_what_is_left_alone_goes_off_and_the_run_goes_on(terminal: Callable[..., Terminal], served: Served) -> None:
    run = terminal("--set", "idle_time=3")
    run.switch_on()
    served.seconds_until_off()
    run.type("supply output_mode", "supply energised 1 V", "finish")
    status, out, err = run.ended()
    assert status == 0, err
    assert "ON: supply energised 1 V 1 A regulated=current" in err
    assert "No command for 3 s. Everything is off" in err
    assert "DC supply: off" in err
    assert "energised needs current_limit" in err
    assert "Run: " in out
    assert "run_finished" in run.journal()


def test_the_end_of_the_input_ends_the_run_with_everything_off(
    terminal: Callable[..., Terminal], served: Served
) -> None:
    run = terminal()
    run.switch_on()
    run.process.stdin.close()
    served.seconds_until_off()
    status, _, err = run.ended()
    assert status == 1
    assert "the end of the input" in err
