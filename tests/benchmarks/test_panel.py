"""What a technician waits for at the panel: `uv run pytest tests/benchmarks/test_panel.py --benchmark-enable -n 0`."""

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
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import sync_playwright

from bench.journal.journal import Journal
from bench.journal.waveforms import StoredWaveform
from bench.panel.plots import waveform_plot
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


def watch(playwright, port, benchmark, journal, delays):
    """Write one reading after the other and note when each is on the screen."""
    browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
    page = browser.new_page()
    page.goto(f"http://127.0.0.1:{port}/runs/live")
    page.wait_for_selector("[data-reading]", state="attached")
    page.evaluate(
        """() => { window.seen = {}; const look = () => { const told = document.querySelector('[data-reading]').textContent;
           if (!(told in window.seen)) window.seen[told] = Date.now(); }; look();
           new MutationObserver(look).observe(document.body, {subtree: true, childList: true, characterData: true}); }"""
    )

    def show(number: int) -> None:
        written = time.time()
        reading = {"value": number * math.pi / 30.0, "unit": "rad/s"}
        journal.record(event("reading", instrument="tachometer", call="measure_speed", value=reading))
        key = "number => Object.keys(window.seen).find(key => parseFloat(key) === number)"
        page.wait_for_function(key, arg=number)
        delays.append(page.evaluate("key => window.seen[key]", page.evaluate(key, number)) - 1000.0 * written)

    numbers = iter(range(101, 1000))
    benchmark.pedantic(lambda: show(next(numbers)), rounds=40, warmup_rounds=2)
    browser.close()


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_a_reading_is_on_the_screen(benchmark, tmp_path):
    """From the end of the journal's write to the digits in the browser's page, 40 readings."""
    folder = tmp_path / "live"
    folder.mkdir()
    journal = Journal(folder / "journal.jsonl", lambda: 0.0)
    journal.record(event("run_started", procedures=["inertia"], settings=[], motor={"name": "M"}, truth={}))
    process, port = serve(tmp_path)
    line = socket.create_server(("127.0.0.1", 0))
    # A run that is there: its line is announced, and nobody asks anything on it.
    (folder / "operator.json").write_text(json.dumps({"pid": os.getpid(), "port": line.getsockname()[1], "token": ""}))
    delays: list[float] = []
    try:
        while not answers(port):
            threading.Event().wait(0.01)
        with sync_playwright() as playwright:
            watch(playwright, port, benchmark, journal, delays)
    finally:
        stop(process)
        journal.close()
        line.close()
    benchmark.extra_info["median delay, ms"] = round(statistics.median(delays))
    benchmark.extra_info["largest delay, ms"] = round(max(delays))


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
    with page.expect_download():
        page.get_by_role("button", name="Report", exact=False).first.click()
    browser.close()


def test_a_million_points_for_the_screen(benchmark):
    times = np.linspace(0.0, 1.0, 1_000_000)
    wave = StoredWaveform(times, np.random.default_rng(1).normal(size=times.size), "V", 0.01, 1)
    plot = benchmark(lambda: waveform_plot({"1": wave}))
    benchmark.extra_info["characters sent"] = len(json.dumps(plot))
