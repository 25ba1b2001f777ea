"""What a technician waits for at the panel: `uv run pytest tests/benchmarks/test_panel.py --benchmark-enable -n 0`."""

import bisect
import json
import math
import os
import signal
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, sync_playwright

from bench.journal.journal import Journal
from bench.journal.waveforms import StoredWaveform
from bench.operators.operator_channel import OperatorLine
from bench.operators.stored_plot import store_plot
from bench.panel.plots import waveform_plot
from drivers.interfaces.text import text
from procedures.core.axes import Axes
from procedures.core.live_plot import ComingReadings, LivePlot
from tests.bench.panel.conftest import CHROMIUM, FLAGS
from tests.journals import event


def serve(runs: Path) -> "tuple[subprocess.Popen[bytes], int]":
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE" and not k.startswith("PYTEST_")}
    command = [sys.executable, "-m", "bench", "serve", "--virtual", "--port", str(port), "--runs", str(runs)]
    return subprocess.Popen(command, env=kept), port


def answers(port: int) -> bool:
    try:
        with socket.create_connection(("127.0.0.1", port), timeout=5) as asked:
            asked.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            return asked.recv(12).startswith(b"HTTP/1.1 200")
    except OSError:
        return False


def stop(process: "subprocess.Popen[bytes]") -> None:
    process.send_signal(signal.SIGTERM)
    process.wait(timeout=20)


def test_server_ready(benchmark, tmp_path):
    started = []

    def begin() -> None:
        process, port = serve(tmp_path)
        started.append(process)
        while not answers(port):
            threading.Event().wait(0.005)

    benchmark.pedantic(begin, rounds=5, warmup_rounds=1)
    status = Path(f"/proc/{started[-1].pid}/status").read_text()
    benchmark.extra_info["memory, MB"] = round(int(status.split("VmHWM:")[1].split()[0]) / 1024)
    for process in started:
        stop(process)


@contextmanager
def live_run(runs: Path, plot: LivePlot | None = None) -> "Iterator[tuple[Journal, int, subprocess.Popen[bytes]]]":
    """Have a run that is there, whose journal is ours to write, and a panel; nobody asks anything on the run's line."""
    folder = runs / "live"
    folder.mkdir()
    journal = Journal(folder / "journal.jsonl", lambda: time.monotonic())
    journal.record(event("run_started", procedures=["inertia"], settings=[], motor={"name": "M"}, truth={}))
    process, port = serve(runs)
    line = OperatorLine(lambda _: None)
    line.announce(folder)
    if plot is not None:
        line.say({"plot": store_plot(plot)})
    try:
        while not answers(port):
            threading.Event().wait(0.01)
        yield journal, port, process
    finally:
        stop(process)
        journal.close()
        line.close()


def read(journal: Journal, number: int) -> float:
    """Write a reading of so many rpm; return when (ms since 1970) it was written."""
    journal.record(
        event(
            "reading",
            instrument="tachometer",
            call="measure_speed",
            value={"value": number * math.pi / 30.0, "unit": "rad/s"},
        )
    )
    return 1000.0 * time.time()


def watch(page: Page) -> None:
    """Have the page note when each reading is on its screen."""
    page.wait_for_selector("[data-reading]", state="attached")
    page.evaluate(
        """() => { window.seen = {}; const look = () => { const told = parseFloat(document.querySelector('[data-reading]').textContent);
           if (!(told in window.seen)) window.seen[told] = Date.now(); }; look();
           new MutationObserver(look).observe(document.body, {subtree: true, childList: true, characterData: true}); }"""
    )


def tell(benchmark, delays: list[float]) -> None:
    benchmark.extra_info["median delay, ms"] = round(statistics.median(delays))
    benchmark.extra_info["90 % within, ms"] = round(float(np.percentile(delays, 90)))
    benchmark.extra_info["largest delay, ms"] = round(max(delays))
    benchmark.extra_info["load of the machine"] = round(os.getloadavg()[0], 1)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_a_reading_is_on_the_screen(benchmark, tmp_path):
    """From the end of the journal's write to the digits in the browser's page, 40 readings, one after the other."""
    delays: list[float] = []
    with live_run(tmp_path) as (journal, port, _), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page()
        page.goto(f"http://127.0.0.1:{port}/runs/live")
        watch(page)

        def show(number: int) -> None:
            written = read(journal, number)
            page.wait_for_function("number => number in window.seen", arg=number)
            delays.append(page.evaluate("number => window.seen[number]", number) - written)

        numbers = iter(range(101, 1000))
        benchmark.pedantic(lambda: show(next(numbers)), rounds=40, warmup_rounds=2)
        browser.close()
    tell(benchmark, delays)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
@pytest.mark.parametrize("plotted", [False, True])
def test_twenty_readings_a_second_are_on_the_screen(benchmark, tmp_path, plotted):
    """For 15 s, alone and as points of a plot; and the server's memory with this run open.

    What was overwritten before it was seen counts until the next was.
    """
    first, count = 1001, 300
    written: dict[int, float] = {}
    speed = Axes(text("Time"), "s", text("Speed"), "rpm", ())
    coming = ComingReadings("tachometer", "speed", time.monotonic(), scale=math.pi / 30.0)
    plot = LivePlot(text("Coast-down"), speed, coming=coming) if plotted else None
    with live_run(tmp_path, plot) as (journal, port, process), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page()
        page.goto(f"http://127.0.0.1:{port}/runs/live")
        watch(page)

        def write() -> None:
            begun = time.monotonic()
            for number in range(count):
                threading.Event().wait(max(0.0, begun + 0.05 * number - time.monotonic()))
                written[first + number] = read(journal, first + number)
            page.wait_for_function("number => number in window.seen", arg=first + count - 1)

        benchmark.pedantic(write, rounds=1)
        seen = {int(number): when for number, when in page.evaluate("window.seen").items() if number.isdigit()}
        status = Path(f"/proc/{process.pid}/status").read_text()
        browser.close()
    shown = sorted(seen)
    tell(benchmark, [seen[shown[bisect.bisect_left(shown, number)]] - when for number, when in written.items()])
    for name, field in (("memory, MB", "VmRSS:"), ("largest memory, MB", "VmHWM:")):
        benchmark.extra_info[name] = round(int(status.split(field)[1].split()[0]) / 1024)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
@pytest.mark.parametrize(("path", "ready"), [("/", ".mb-procedures .q-checkbox"), ("/runs/live", "[data-reading]")])
def test_a_page_is_ready(benchmark, tmp_path, path, ready):
    """From the call of the page until a person can use it; the browser has seen the panel's files before."""
    with live_run(tmp_path) as (_, port, _), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page()

        def call() -> None:
            page.goto(f"http://127.0.0.1:{port}{path}", wait_until="commit")
            page.wait_for_selector(ready)

        benchmark.pedantic(call, rounds=10, warmup_rounds=1)
        browser.close()
    benchmark.extra_info["load of the machine"] = round(os.getloadavg()[0], 1)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_memory_with_a_run_open(benchmark, tmp_path):
    """The server's, after a finished run's page with three of its waveforms, and its report."""
    subprocess.run(
        [sys.executable, "-m", "bench", "demo", "--json", "--runs", str(tmp_path)], capture_output=True, check=True
    )
    process, port = serve(tmp_path)
    try:
        while not answers(port):
            threading.Event().wait(0.01)
        with sync_playwright() as playwright:
            benchmark.pedantic(lambda: look_at_a_run(playwright, port, next(tmp_path.iterdir()).name), rounds=1)
        status = Path(f"/proc/{process.pid}/status").read_text()
    finally:
        stop(process)
    benchmark.extra_info["memory, MB"] = round(int(status.split("VmHWM:")[1].split()[0]) / 1024)


def look_at_a_run(playwright, port, name):
    browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
    page = browser.new_page()
    page.goto(f"http://127.0.0.1:{port}/runs/{name}")
    for number in (0, 8, 16):
        page.get_by_role("region", name="Waveforms").locator(".q-select").click()
        page.locator(".q-menu .q-item").nth(number).click()
        page.locator(".h-96 canvas").first.wait_for()
        page.wait_for_timeout(500)
    # A report is seven seconds of a slow processor, which three other benchmarks want at the same time.
    with page.expect_download(timeout=120_000):
        page.get_by_role("button", name="Report", exact=False).first.click()
    browser.close()


def test_a_million_points_for_the_screen(benchmark):
    times = np.linspace(0.0, 1.0, 1_000_000)
    wave = StoredWaveform(times, np.random.default_rng(1).normal(size=times.size), "V", 0.01, 1)
    plot = benchmark(lambda: waveform_plot({"1": wave}))
    benchmark.extra_info["characters sent"] = len(json.dumps(plot))
