"""The panel's server killed while a run that was started through it has something energised."""

import os
import random
import re
import signal
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from socket import create_server
from time import monotonic
from typing import Any

from bench.journal.journal_file import read_journal
from bench.operators.operator_channel import FILE
from tests.bench.panel.conftest import CHROMIUM, FLAGS
from tests.studies.energised.held import quiet
from tests.studies.kills.measuring import Bench
from tests.studies.kills.trial import PATIENCE, Trial
from tests.studies.kills.victim import judge_verification, wait_until_let_go

_BEGIN = 90.0
#: A run does not notice its panel's end; it is looked for so long (s) whether it does something all the same.
_UNDISTURBED = 1.0
_NAMES = {
    "server killed, then aborted at a new one": "abort",
    "server killed, run told to stop": "signal",
    "server and run told to stop": "stop",
}


class Server:
    """`motorbench serve` on a served bench."""

    def __init__(self, folder: Path, station: Path) -> None:
        with create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}"
        words = ["serve", "--station", str(station), "--port", str(self.port), "--runs", str(folder / "runs")]
        words += ["--motors", str(folder / "motors"), "--plans", str(folder / "plans")]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "bench", *words, "--records", str(folder / "records.sqlite")],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=quiet(),
        )
        began = monotonic()
        while True:
            try:
                urllib.request.urlopen(self.url, timeout=5).close()  # noqa: S310  our own server
            except (urllib.error.URLError, ConnectionError):
                assert monotonic() - began < _BEGIN, "the server did not start"
                threading.Event().wait(0.1)
            else:
                return

    def kill(self) -> None:
        """Kill it; the run is none of its children's that end with it."""
        self.process.kill()
        self.process.wait()


def trials(folder: Path, count: int, draw: random.Random, _kept: Path | None = None) -> Iterator[Trial]:
    """Do so many trials, each with a server, a browser's page and a run of their own."""
    from playwright.sync_api import sync_playwright

    assert CHROMIUM is not None, "the panel's trials need Chromium"
    bench = Bench(folder)
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            for number in range(count):
                here = folder / f"panel-{number}"
                here.mkdir()
                case = list(_NAMES)[number % len(_NAMES)]
                yield _killed(bench, here, case, browser.new_page, draw)
            browser.close()
    finally:
        bench.close()


def _killed(bench: Bench, here: Path, case: str, new_page: Callable[[], Any], draw: random.Random) -> Trial:
    trial = Trial("panel's server", case)
    server = Server(here, bench.station)
    page = new_page()
    run = here / "runs" / _begin(page, server, bench)
    pid = int(re.findall(r'"pid": ?(\d+)', (run / FILE).read_text(encoding="utf-8"))[0])
    threading.Event().wait(draw.uniform(0.0, 0.4))
    trial.energised = bool(bench.world.truth()["energised"])
    server.kill()
    at = monotonic()
    page.close()
    match _NAMES[case]:
        case "abort":
            server = Server(here, bench.station)
            page = new_page()
            page.goto(f"{server.url}/runs/{run.name}")
            button = page.get_by_role("button", name=re.compile("^Abort the run"))
            button.wait_for(timeout=60_000)
            trial.energised = bool(bench.world.truth()["energised"])
            at = monotonic()
            button.click()
        case "signal":
            threading.Event().wait(_UNDISTURBED)
            trial.energised = bool(bench.world.truth()["energised"])
            at = monotonic()
            os.kill(pid, signal.SIGTERM)
        case _:
            os.kill(pid, signal.SIGTERM)
    while bench.world.truth()["energised"]:
        if monotonic() - at > PATIENCE:
            trial.faults.append("left energised")
            trial.off_after = float("inf")
            break
        threading.Event().wait(0.005)
    else:
        trial.off_after = monotonic() - at
    _ended(trial, run)
    server.kill()
    page.close()
    return trial


def _begin(page: Any, server: Server, bench: Bench) -> str:
    """Order a run at the start page and confirm what is asked until something is energised; return its name."""
    page.goto(server.url)
    page.get_by_label("Motor type").click()
    page.get_by_text("lg-400w (virtual)").click()
    page.get_by_label("Operator's name").fill("J. Doe")
    page.get_by_role("button", name="None").click()
    page.get_by_role("checkbox", name=re.compile("^Pole pairs by stable positions")).click()
    page.get_by_role("button", name="Start", exact=True).click()
    page.wait_for_url("**/runs/**", timeout=60_000)
    button, began = page.get_by_role("button", name="Done"), monotonic()
    while not bench.world.truth()["energised"]:
        assert monotonic() - began < _BEGIN, "nothing was energised"
        if button.is_visible():
            button.click(timeout=2000)
        page.wait_for_timeout(20)
    return str(page.url.rpartition("/")[2])


def _ended(trial: Trial, run: Path) -> None:
    began = monotonic()
    while not (events := read_journal(run / "journal.jsonl").events) or events[-1].kind != "run_finished":
        if monotonic() - began > PATIENCE:
            trial.faults.append(f"hangs: not ended within {PATIENCE:g} s")
            return
        threading.Event().wait(0.1)
    trial.then = str(events[-1].data["status"])
    trial.judge_cause(str(events[-1].data["cause"]))
    wait_until_let_go(run)
    judge_verification(trial, run, finished=True)
