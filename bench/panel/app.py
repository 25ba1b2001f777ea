"""The web application: sessions by cookie, pages by path, the panel's state behind them."""

import asyncio
from contextlib import suppress
from functools import partial
from pathlib import Path

from nicegui import app, core, ui
from nicegui.client import templates
from starlette.requests import Request

import reports
from bench.eol.statistics_messages import GROUPING_WORDS
from bench.i18n.errors import InputError
from bench.panel.line_records import Choice, serial_numbers
from bench.panel.pages.frame import frame
from bench.panel.pages.history import compare_page, history_page
from bench.panel.pages.line.motor_tests import motor_tests_page
from bench.panel.pages.line.page import line_page
from bench.panel.pages.login import login_page
from bench.panel.pages.motor_form import motor_page
from bench.panel.pages.run.page import run_page
from bench.panel.pages.start import start_page
from bench.panel.pages.statistics.page import statistics_page
from bench.panel.panel import Panel
from bench.panel.server.content_policy import mark_scripts
from bench.panel.server.gate import Gate
from bench.panel.server.hosts import AllowedHosts
from bench.panel.server.sessions import Session
from bench.panel.server.socket_guard import SocketGuard
from drivers.interfaces.text import text

#: Longest wait (s) for the words of procedures, and for a page: what takes longer on a busy computer is an error to the browser.
_WORDS, _PAGE = 2.0, 30.0
#: Style and script of the pages, and the report's fonts.
_ASSETS = Path(__file__).parent / "assets"
_FONTS = Path(reports.__file__).parent / "fonts"


def build(panel: Panel, hosts: AllowedHosts) -> None:
    """Register the pages; with people who log in, everything but the login asks who is there."""
    access = panel.access
    guard = SocketGuard(core.sio, panel.sessions, panel.control)
    guard.install()
    mark_scripts(templates.env)
    app.add_middleware(Gate, hosts=hosts, sessions=panel.sessions, login=access is not None)
    app.add_static_files("/assets/fonts", _FONTS)
    app.add_static_files("/assets", _ASSETS)
    app.on_startup(guard.open)
    app.on_shutdown(guard.close)
    app.on_startup(panel.open)
    app.on_shutdown(panel.close)

    page = partial(ui.page, response_timeout=_PAGE)

    @page("/")
    async def start(request: Request, motor: str = "", as_before: str = "") -> None:
        start_page(panel, _session(request), motor, as_before)

    @page("/motor")
    async def new_motor(request: Request) -> None:
        motor_page(panel, _session(request))

    @page("/runs/{name:path}")
    async def run(request: Request, name: str) -> None:
        try:
            live = await panel.follow(name)
        except InputError as error:
            with frame(panel, _session(request), text("Runs")) as reader:
                ui.label(reader.fault(error)).classes("text-xl")
            return
        # The words of procedures and steps; a page without them shows the names of the journal.
        with suppress(InputError, TimeoutError):
            async with asyncio.timeout(_WORDS):
                await panel.offer.procedures()
        run_page(panel, _session(request), live)

    @page("/line")
    async def line(request: Request, batch: str = "") -> None:
        line_page(panel, _session(request), batch)

    @page("/statistics")
    async def statistics(
        request: Request,
        model: str = "",
        batch: str | None = None,
        parameter: str = "",
        golden: str = "",
        by: str = Choice.by,
    ) -> None:
        by = by if by in GROUPING_WORDS else Choice.by
        statistics_page(panel, _session(request), Choice(model, batch, parameter, serial_numbers(golden), by))

    @page("/motors")
    async def motor_tests(request: Request, serial_number: str = "") -> None:
        motor_tests_page(panel, _session(request), serial_number)

    @page("/history")
    async def history(request: Request) -> None:
        history_page(panel, _session(request))

    @page("/compare/{first}/{second}")
    async def compare(request: Request, first: str, second: str) -> None:
        compare_page(panel, _session(request), first, second)

    if access is not None:
        login_page(panel, access)


def _session(request: Request) -> Session:
    session: Session = request.state.session
    return session
