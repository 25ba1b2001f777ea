"""Pictures of the plots that a run shows, on four screens: `python -m tests.studies.panel_plots DIRECTORY` (needs Chromium)."""

import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, sync_playwright

from bench.journal.stored_result import store_text
from drivers.interfaces import Accuracy, ImpedanceReading
from drivers.interfaces.text import text
from procedures.core.curves import curve
from procedures.techniques.shaft.plots import coast_plot, emf_plot, ramp_plot
from procedures.techniques.winding.plots import SweepPlot, aligned_plot, step_plot
from tests.bench.panel.conftest import CHROMIUM, FLAGS, Server
from tests.bench.panel.shown_run import ShownRun
from tests.studies.panel_screens import SCREENS

_RPM = np.pi / 30.0
_RNG = np.random.default_rng(3)


def sweep(run: ShownRun, share: float = 0.6) -> None:
    """Have a hand turn a motor of four pole pairs, not quite evenly, for a share of the sweep."""
    run.record("action", action="StartTurning", details={"speed": 0.1}, text=[])
    run.record("action_done", action="StartTurning", given=None)
    plot, taken = SweepPlot(0.0, 0.1, 80, 0.2, 4.0), list[ImpedanceReading]()
    run.show(plot.made(taken))
    for n in range(int(80 * share)):
        run.time = 0.2 * n
        angle = 8.0 * 0.1 * (run.time + 0.6 * np.sin(0.5 * run.time))
        inductance = 1.2e-3 * (1.0 - 0.2 * np.cos(angle)) + 4e-6 * _RNG.normal()
        accuracy = Accuracy()
        taken.append(ImpedanceReading(0.1, inductance, 1e3, accuracy, accuracy, run.time))
        run.read("lcr_meter", "measure", inductance=inductance)
    run.show(plot.made(taken))


def turned(run: ShownRun) -> None:
    """Show the whole sweep with its fit."""
    time = 0.2 * np.arange(80)
    fitted = 1.2e-3 * (1.0 - 0.2 * np.cos(8.0 * 0.1 * (time + 0.6 * np.sin(0.5 * time))))
    left = 4e-6 * _RNG.normal(size=80)
    run.show(SweepPlot(0.0, 0.1, 80, 0.2, 4.0).fitted(time, fitted + left, left))


def step(run: ShownRun) -> None:
    """Show a step right after its capture."""
    time = (np.arange(10_000) - 3000) * 1e-6
    voltage = np.where(time > 0.0, 1.0, 0.0) + 0.01 * _RNG.normal(size=time.size)
    current = np.where(time > 0.0, 1.0 - np.exp(-time / 8e-4), 0.0) + 0.005 * _RNG.normal(size=time.size)
    run.show(step_plot(time, voltage, current))


def beside(run: ShownRun) -> None:
    """Show a step, and ask for hand work then."""
    step(run)
    run.ask("action", action="TurnToRest", lines=[store_text(text("Stop turning the shaft"))])


def emf(run: ShownRun) -> None:
    """Show two periods of three phases with a fifth harmonic."""
    time = np.linspace(0.0, 0.01, 1200)
    columns = {"time": time}
    for k in range(3):
        angle = 2.0 * np.pi * (200.0 * time - k / 3.0)
        fitted = 40.0 * np.sin(angle) + 1.6 * np.sin(5.0 * angle) + 0.4 * np.sin(7.0 * angle)
        columns |= {f"channel_{k + 1}": fitted + 0.6 * _RNG.normal(size=time.size), f"fitted_{k + 1}": fitted}
    run.show(emf_plot(300.0, curve(**columns), {"1": 40.0, "3": 0.05, "5": 1.6, "7": 0.4}))


def coasting(run: ShownRun, share: float = 0.5) -> None:
    """Have a shaft coast down for a share of its time."""
    run.show(ramp_plot(text("Coast-down"), 0.0, 60.0))
    for n in range(int(400 * share)):
        run.time = 0.01 * n
        speed = 320.0 * np.exp(-0.4 * run.time) - 8.0 * run.time + 0.3 * _RNG.normal()
        run.read("dynamometer", "measure", speed=speed, torque=0.0, power=0.0)


def coasted(run: ShownRun) -> None:
    """Show a coast-down by both models."""
    time = np.linspace(0.0, 4.0, 800)
    speed = 320.0 / (1.0 + 0.9 * time) - 4.0 * time + 0.3 * _RNG.normal(size=time.size)
    run.show(coast_plot(text("Coast-down"), time, speed))


def aligned(run: ShownRun) -> None:
    """Show what was read on d and on q."""
    run.show(aligned_plot(1.1e-3, 1.7e-3))


def gauge(run: ShownRun) -> None:
    """Ask a hand to drive the shaft at a speed that a tachometer reads."""
    wanted = 3000.0 * _RPM
    run.record("energising", instrument="dynamometer", call="driving_speed", arguments=[wanted])
    task = text("Drive the shaft at {speed:g} rpm and wait until the speed is steady.", speed=3000.0)
    run.tell(
        [{"role": "tachometer", "found": "on", "feeds": False, "values": [[0.9 * wanted, "rad/s"]], "error": None}]
    )
    run.ask("confirm", instrument="dynamometer", task=store_text(task))


SWEEP = ("dq-inductance-extremes", "3.3.2/2", "Turn the shaft very slowly through 2 electrical turns")
STEP = ("dq-inductance-time-constant", "3.3.1-d/4", "Switch on and record the current's step response")
EMF = ("back-emf-constant", "3.4.2/2", "Probe three phases against an artificial star point, and record")
COAST = ("inertia", "3.5/3", "Let it coast: record speed over time")
ALIGNED = ("dq-inductance-aligned", "3.3.3-q/3", "Read the inductance of A against B and C together")
#: What is played, in which step of which procedure.
PLAYED: Mapping[str, tuple[Callable[[ShownRun], None], tuple[str, str, str]]] = {
    "sweep": (sweep, SWEEP),
    "turned": (turned, SWEEP),
    "step": (step, STEP),
    "beside": (beside, STEP),
    "emf": (emf, EMF),
    "coasting": (coasting, COAST),
    "coasted": (coasted, COAST),
    "aligned": (aligned, ALIGNED),
    "gauge": (gauge, EMF),
}


def take(folder: Path, only: list[str]) -> None:
    """Play each plot to a panel and take its pictures, the first one in Chinese too."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as kept, sync_playwright() as playwright:
        server = Server(Path(kept) / "runs", "--virtual")
        server.start()
        try:
            page = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS).new_page()
            page.set_default_timeout(30_000)
            page.on("pageerror", lambda error: print("page:", error))
            page.on("console", lambda message: print("console:", message.text) if message.type == "error" else None)
            for name in PLAYED:
                if not only or name in only:
                    _take(page, server, name, folder)
        finally:
            server.stop()


def _take(page: Page, server: Server, name: str, folder: Path) -> None:
    play, where = PLAYED[name]
    with ShownRun(server.runs / name, *where) as run:
        page.goto(f"{server.url}/runs/{name}")
        page.wait_for_selector("[data-reading]", state="attached")
        play(run)
        page.wait_for_timeout(1500)
        shoot(page, name, folder)
        if name == "sweep":
            page.get_by_role("button", name="中文").click()
            page.wait_for_timeout(1500)
            shoot(page, "chinese", folder)
            page.get_by_role("button", name="English").click()


def shoot(page: Page, name: str, folder: Path) -> None:
    """Take the page's pictures, and say where it is wider than its screen."""
    for screen, (width, height) in SCREENS.items():
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_timeout(500)
        if page.evaluate("document.documentElement.scrollWidth") > width:
            print(f"{name}_{screen}: too wide")
        page.screenshot(path=folder / f"{name}_{screen}.png")
    page.set_viewport_size({"width": 1280, "height": 800})


if __name__ == "__main__":
    take(Path(sys.argv[1]), sys.argv[2:])
