"""The common part of every page: title, language, who is here, who leads, and the way to abort."""

from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import ui

from bench.panel.pages.lost import lost_row
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.server.gate import LOGIN
from bench.panel.server.sessions import Session
from drivers.interfaces.text import Text, text

_CHOOSE_ENGLISH = "document.cookie='motorbench_language=en;path=/;SameSite=Strict';location.reload()"
_CHOOSE_CHINESE = "document.cookie='motorbench_language=zh;path=/;SameSite=Strict';location.reload()"
#: How often (s) a page hears from the server at least; the browser takes three seconds of silence for a lost connection.
_BEAT = 0.8
_CHANGE_BEAT = "(beat => beat && (beat.dataset.beat = 1 - beat.dataset.beat))(document.querySelector('[data-beat]'))"
#: What is pressed, dark enough to be read on white and to be written on in white.
_ACT = "#0b4fa0"
_HEAD = '<link rel="stylesheet" href="/assets/page.css"><script src="/assets/page.js"></script>'
_PAGES = (
    ("/", text("Measure")),
    ("/line", text("Line")),
    ("/statistics", text("Statistics")),
    ("/history", text("Runs")),
)


@contextmanager
def frame(panel: Panel, session: Session, heading: Text, here: str = "", *, whole: bool = False) -> Iterator[Reader]:
    """Build a page's frame and give the reader for what stands in it.

    `here` is the link of the page, or of what it belongs to. With `whole`, its content takes the whole width.
    """
    reader = Reader(session)
    say = reader.say
    ui.add_head_html(_HEAD)
    ui.colors(primary=_ACT)
    ui.page_title(f"motorbench – {say(heading)}")
    ui.link(say(text("Skip to the content")), "#main").classes("mb-skip")
    with ui.header(elevated=False, fixed=False).classes("mb-header items-center gap-2"):
        with named(ui.element("nav").classes("flex items-center"), say(text("Pages"))):
            ui.label("motorbench").classes("mb-brand")
            for target, words in _PAGES:
                link = ui.link(say(words), target).classes("no-underline text-base")
                if target == here:
                    link.props("aria-current=page")
        ui.space()
        _who(panel, reader)
        _language(reader)
        if session.logged_in:
            _log_out(panel, reader)
    _beat(session)
    lost_row(reader)
    with ui.element("div").props("id=main tabindex=-1").classes("mb-page mb-run" if whole else "mb-page"):
        yield reader


def _beat(session: Session) -> None:
    """Have the browser hear from the server often enough to know when it does not any more."""
    beat = ui.element("div").props("data-beat=0 aria-hidden=true").style("display: none")
    beat.props["data-lang"] = session.language

    # An element that is updated has the browser work out every element of the page.
    ui.timer(_BEAT, lambda: ui.run_javascript(_CHANGE_BEAT))


def _who(panel: Panel, reader: Reader) -> None:
    session, say = reader.session, reader.say
    label = ui.label().classes("mb-opt text-base").props("role=status")
    button = ui.button(on_click=lambda: panel.control.take(session.token, session.person))
    button.props("flat dense color=white no-caps").set_text(say(text("Take the control")))
    client = ui.context.client

    def show() -> None:
        leader = panel.control.leader
        if panel.control.holds(session.token):
            if client.has_socket_connection:
                panel.watch()
            label.set_text(say(text("You have the control")))
        elif leader is not None:
            label.set_text(say(text("{name} has the control", name=leader.name or text("Another browser"))))
        else:
            label.set_text(say(text("Nobody has the control")))
        button.set_visibility(session.may_lead and not panel.control.holds(session.token))

    show()
    ui.timer(0.5, show)


def _log_out(panel: Panel, reader: Reader) -> None:
    def leave() -> None:
        ui.navigate.to(LOGIN)
        panel.sessions.end(reader.session.token)

    ui.button(reader.say(text("Log out")), on_click=leave).props("flat dense color=white no-caps")


def _language(reader: Reader) -> None:
    for code, name in (("en", "English"), ("zh", "中文")):
        if code == reader.session.language:
            continue

        def change(chosen: str = code) -> None:
            reader.session.language = chosen
            ui.run_javascript(_CHOOSE_CHINESE if chosen == "zh" else _CHOOSE_ENGLISH)

        ui.button(name, on_click=change).props("flat dense color=white no-caps").props["lang"] = code
