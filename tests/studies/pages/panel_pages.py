"""How the pages of a panel are come to, each in the state in which it is looked at."""

import itertools
import json
import os
import re
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import partial
from pathlib import Path

from playwright.sync_api import Error, Page

from bench.cli.main import main
from bench.operators.operator_channel import FILE
from bench.panel.server.access import add_person
from tests.bench.panel.browser.test_line_page import EXAMPLE, QUICK
from tests.bench.panel.browser.test_run_page import BY_HAND
from tests.bench.panel.browser.test_statistics_page import keep, motors
from tests.bench.panel.conftest import QUICK as HASHED
from tests.bench.panel.conftest import Server
from tests.studies.pages.played_run import played_line, played_run

Come = Callable[[Page, "Bench"], AbstractContextManager[None]]
_DISTURBED = Path(__file__).parents[3] / "docs" / "examples" / "disturbances.toml"


class Bench:
    """A panel of the virtual bench, its runs and its records; others for a page that needs them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.names = (f"played-{number}" for number in itertools.count(1))
        self._ended: dict[str, str] = {}
        self.server = self._serve("--virtual")

    def close(self) -> None:
        """End the panel."""
        self.server.stop()

    def ended(self, *words: str, motor: str = "ipmsm") -> str:
        """Return the name of a run of these words that has ended, made by the command line once."""
        key = " ".join((motor, *words))
        if key not in self._ended:
            before = set(self.server.runs.glob("*"))
            command = ["run", *words, "--station", "virtual", "--motor", motor, "--runs", str(self.server.runs)]
            with suppress(SystemExit):
                main([*command, "--person", "J. Doe", "--serial-number", f"SN-{len(self._ended) + 1:03d}"])
            self._ended[key] = next(iter(set(self.server.runs.glob("*")) - before)).name
        return self._ended[key]

    @contextmanager
    def other(self, *options: str) -> Iterator[Server]:
        """Have a second panel with options of its own."""
        server = self._serve(*options)
        try:
            yield server
        finally:
            server.stop()

    def _serve(self, *options: str) -> Server:
        kept = ["--plans", str(self.folder / "plans")]
        if "--records" not in options:
            kept += ["--records", str(self.folder / "records.sqlite")]
        server = Server(self.folder / f"runs-{options[0].strip('-')}", *options, *kept)
        server.start()
        return server


def begin(page: Page, server: Server, *titles: str, motor: str = "ipmsm") -> None:
    """Order a run of a shipped motor: of procedures, by the beginnings of their titles."""
    page.goto(server.url)
    page.get_by_label("Motor type").click()
    page.get_by_text(f"{motor} (virtual)", exact=True).click()
    page.get_by_label("Operator's name").fill("J. Doe")
    page.get_by_label("Serial number").fill("SN-001")
    page.get_by_role("button", name="None").click()
    for title in titles:
        page.get_by_role("checkbox", name=re.compile(f"^{re.escape(title)}")).first.click()
    page.get_by_role("button", name="Start", exact=True).click()
    page.wait_for_url("**/runs/**")


def reach(page: Page, words: str) -> None:
    """Confirm what is asked until the page says these words."""
    for _ in range(600):
        if page.get_by_text(words).first.is_visible():
            return
        # Where nothing is asked just now, there is nothing to press.
        with suppress(Error):
            page.locator("[data-done]").click(timeout=300)
        page.wait_for_timeout(50)
    raise SystemExit(f"never reached: {words}; the page says: {page.get_by_role('heading', level=1).inner_text()}")


def _abort(page: Page) -> None:
    page.locator(".mb-stop:not([disabled])").click()
    page.get_by_text(re.compile("ABORTED|已中止")).first.wait_for()


@contextmanager
def _step(title: str, words: str, page: Page, bench: Bench) -> Iterator[None]:
    begin(page, bench.server, title)
    reach(page, words)
    yield
    _abort(page)


@contextmanager
def _aborted(page: Page, bench: Bench) -> Iterator[None]:
    begin(page, bench.server, "dq inductance, time constant")
    reach(page, "Connect, in this order")
    _abort(page)
    yield


@contextmanager
def _typed_by_hand(typed: str, page: Page, bench: Bench) -> Iterator[None]:
    """Enter a reading of a meter that is read by eye, then type the next."""
    station = bench.folder / "station.toml"
    station.write_text(BY_HAND)
    with bench.other("--station", str(station)) as server:
        begin(page, server, "Stator resistance ·")
        field = page.locator("input[data-focus]")
        while not (field.is_visible() and "resistance" in page.get_by_role("heading", level=1).inner_text()):
            with suppress(Error):
                page.locator("[data-done]").click(timeout=300)
            page.wait_for_timeout(50)
        page.wait_for_timeout(500)
        page.keyboard.type("31,8m")
        page.keyboard.press("Enter")
        page.get_by_text("31.8 mΩ").first.wait_for()
        page.wait_for_timeout(600)
        page.keyboard.type(typed)
        page.wait_for_timeout(300)
        page.keyboard.press("Enter")
        page.get_by_role("alert").filter(has_text=re.compile("five times|number")).wait_for()
        yield
        _abort(page)


@contextmanager
def _by_hand(page: Page, bench: Bench) -> Iterator[None]:
    page.goto(bench.server.url)
    page.get_by_label("Motor type").click()
    page.get_by_text("ipmsm (virtual)").click()
    page.get_by_role("button", name="Use the instruments by hand").click()
    page.wait_for_url("**/runs/**")
    line = page.get_by_role("textbox", name="Or type a command; help lists them")
    line.fill("connect A=supply+ B=supply- C=open")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Done", exact=True).click()
    page.get_by_text("Done: connect").wait_for()
    line.fill("supply energised voltage=1V current_limit=500mA regulated=current")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Confirmed: switch on").click()
    page.get_by_text("ON: ").wait_for()
    yield
    _abort(page)


@contextmanager
def _played(kind: str, page: Page, bench: Bench) -> Iterator[None]:
    """Show a run that has come as far as its first connection, and now stands at a question or a measurement."""
    real = bench.server.runs / bench.ended("dq-inductance-time-constant") / "journal.jsonl"
    name, upto = next(bench.names), "action_done" if kind in ("measuring", "doubt", "angles") else "action"
    lines = real.read_text().splitlines(keepends=True)
    last = next(number for number, line in enumerate(lines) if f'"kind":"{upto}"' in line)
    with played_run(bench.server.runs / name, lines[: last + 1], kind):
        page.goto(f"{bench.server.url}/runs/{name}")
        page.locator("[data-state]:visible").first.wait_for()
        lead = page.get_by_role("button", name="Take the control")
        if lead.is_visible():
            lead.click()
        page.wait_for_timeout(2500)
        yield
    (bench.server.runs / name / "journal.jsonl").unlink()


@contextmanager
def _map_growing(page: Page, bench: Bench) -> Iterator[None]:
    """Hold a run still in the middle of its map."""
    begin(page, bench.server, "Pole pairs by stable positions", "Flux map at constant speed", motor="ipmsm-map")
    reach(page, "readings, about")
    page.get_by_text("A first look").first.wait_for()
    announced = bench.server.runs / page.url.rpartition("/")[2] / FILE
    process = int(json.loads(announced.read_text(encoding="utf-8"))["pid"])
    os.kill(process, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(process, signal.SIGCONT)
    page.locator(".mb-stop:not([disabled])").or_(page.locator("[data-next]")).first.click()
    page.get_by_text(re.compile("ABORTED|Motor type")).first.wait_for()


@contextmanager
def _lost(page: Page, bench: Bench) -> Iterator[None]:
    begin(page, bench.server, "dq inductance, time constant")
    reach(page, "Connect, in this order")
    bench.server.stop()
    page.wait_for_timeout(4000)
    yield
    bench.server.start()
    page.locator(".mb-stop:not([disabled])").click(timeout=20_000)
    page.get_by_text("ABORTED").first.wait_for()


@contextmanager
def _watching(page: Page, bench: Bench) -> Iterator[None]:
    begin(page, bench.server, "dq inductance, time constant")
    reach(page, "Connect, in this order")
    page.context.clear_cookies()
    page.reload()
    yield
    _abort(page)


@contextmanager
def _ended(words: tuple[str, ...], page: Page, bench: Bench, motor: str = "ipmsm") -> Iterator[None]:
    page.goto(f"{bench.server.url}/runs/{bench.ended(*words, motor=motor)}")
    page.get_by_role("button", name="Measure the next motor").wait_for()
    page.wait_for_timeout(1500)
    yield


@contextmanager
def _report(page: Page, bench: Bench) -> Iterator[None]:
    with _ended(("stator-resistance",), page, bench):
        with page.expect_download():
            page.get_by_role("button", name="Report", exact=True).click()
        page.get_by_text("Download again").first.wait_for()
        yield


@contextmanager
def _compared(page: Page, bench: Bench) -> Iterator[None]:
    runs = (bench.ended("stator-resistance"), bench.ended("stator-resistance", "--seed", "2"))
    page.goto(f"{bench.server.url}/compare/{'/'.join(runs)}")
    page.get_by_role("columnheader").first.wait_for()
    yield


@contextmanager
def _statistics(page: Page, bench: Bench) -> Iterator[None]:
    records = keep(bench.folder / "statistics.sqlite", ("November", "LG-400W", motors(60, 1)))
    with bench.other("--virtual", "--records", records) as server:
        page.goto(f"{server.url}/statistics")
        page.locator("canvas").first.wait_for()
        page.wait_for_timeout(1000)
        yield


@contextmanager
def _line(page: Page, bench: Bench) -> Iterator[None]:
    with played_line(bench.server.runs / next(bench.names)):
        page.goto(f"{bench.server.url}/line")
        page.get_by_text("LG-2026-000005").first.wait_for()
        yield


@contextmanager
def _plans(page: Page, bench: Bench) -> Iterator[None]:
    folder = bench.folder / "plans"
    folder.mkdir(exist_ok=True)
    for name, low in (("pump", 0.0), ("reversed", 20.0)):
        (folder / f"{name}.toml").write_text(QUICK.format(name=name, motor=EXAMPLE / "motor.toml", low=low))
    with _at("/line", page, bench):
        page.get_by_role("radio", name="pump").wait_for()
        yield


@contextmanager
def _at(path: str, page: Page, bench: Bench) -> Iterator[None]:
    page.goto(f"{bench.server.url}{path}")
    page.wait_for_load_state("networkidle")
    yield


@contextmanager
def _refused(page: Page, bench: Bench) -> Iterator[None]:
    with _at("/", page, bench):
        page.get_by_role("button", name="Start", exact=True).click()
        page.get_by_text("Choose the motor's type.").wait_for()
        yield


@contextmanager
def _login(page: Page, bench: Bench) -> Iterator[None]:
    people = bench.folder / "people.toml"
    add_person(people, "J.Doe", "engineer", "battery staple", HASHED)
    with bench.other("--virtual", "--people", str(people)) as server:
        page.goto(f"{server.url}/login?failed=1")
        yield


PAGES: Mapping[str, Come] = {
    "start": partial(_at, "/"),
    "refused": _refused,
    "motor": partial(_at, "/motor"),
    "hand": partial(_step, "dq inductance, time constant", "Connect, in this order"),
    "probes": partial(_step, "dq inductance, time constant", "arrow towards the motor"),
    "energised": partial(_step, "Pole pairs by stable positions", "Energised on purpose"),
    "typed": partial(_step, "Stator resistance ·", "Read and enter"),
    "slip": partial(_typed_by_hand, "3.18"),
    "nonsense": partial(_typed_by_hand, "many"),
    "turning": partial(_step, "dq inductance, smallest and largest", "Turn the shaft by hand"),
    **{kind: partial(_played, kind) for kind in ("measuring", "unknown", "doubt", "set", "choice", "angles")},
    "map_growing": _map_growing,
    "by_hand": _by_hand,
    "watching": _watching,
    "aborted": _aborted,
    "ended": partial(_ended, ("stator-resistance", "dq-inductance-extremes", "pole-pairs-static")),
    "withheld": partial(_ended, ("dq-inductance-time-constant", "--seed", "3", "--disturbances", str(_DISTURBED))),
    "map_ended": partial(_ended, ("pole-pairs-static", "flux-map", "load-points", "short-circuit"), motor="ipmsm-map"),
    "report": _report,
    "runs": partial(_at, "/history"),
    "compared": _compared,
    "statistics": _statistics,
    "statistics_empty": partial(_at, "/statistics"),
    "line_empty": partial(_at, "/line"),
    "line_plans": _plans,
    "line": _line,
    "login": _login,
    "lost": _lost,
}
