"""What every page has: title, language, who is here, who leads, and the way to abort."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache

from nicegui import ui

from bench.i18n.errors import message
from bench.i18n.language import translator
from bench.panel.gate import LOGIN
from bench.panel.pages.parts import named
from bench.panel.pages.stylesheet import add_stylesheet
from bench.panel.panel import Panel
from bench.panel.sessions import Session
from drivers.interfaces.text import Text, Translate, text

_CHOOSE_ENGLISH = "document.cookie='motorbench_language=en;path=/;SameSite=Strict';location.reload()"
_CHOOSE_CHINESE = "document.cookie='motorbench_language=zh;path=/;SameSite=Strict';location.reload()"
_PAGES = (
    ("/", text("Measure")),
    ("/line", text("Line")),
    ("/statistics", text("Statistics")),
    ("/history", text("Runs")),
)


@dataclass(frozen=True)
class Reader:
    """For whom a page is built: the session, and the session's language."""

    session: Session

    @property
    def translate(self) -> Translate:
        """What gives templates in the reader's language."""
        return _translator(self.session.language)

    def say(self, words: Text) -> str:
        """Return a sentence in the reader's language."""
        return words.render(self.translate)

    def fault(self, error: Exception) -> str:
        """Return what went wrong in the reader's language."""
        return message(error, self.translate)


#: Catalogues are files; a page asks for hundreds of sentences.
_translator = lru_cache(maxsize=8)(translator)


@contextmanager
def frame(panel: Panel, session: Session, heading: Text) -> Iterator[Reader]:
    """Build a page's frame and give the reader for what stands in it."""
    reader = Reader(session)
    say = reader.say
    add_stylesheet()
    ui.page_title(f"motorbench – {say(heading)}")
    ui.link(say(text("Skip to the content")), "#main").classes("mb-skip")
    with ui.header(elevated=False).classes("items-center gap-4 px-4 py-2").style("background:#17202a;color:#fff"):
        with named(ui.element("nav").classes("flex items-center gap-4"), say(text("Pages"))):
            ui.label("motorbench").classes("text-lg font-bold")
            for target, words in _PAGES:
                ui.link(say(words), target).classes("text-white no-underline text-base")
        ui.space()
        _who(panel, reader)
        _language(reader)
        if session.logged_in:
            _log_out(panel, reader)
    with ui.element("div").props("id=main").classes("w-full max-w-page mx-auto p-4"):
        yield reader


def _who(panel: Panel, reader: Reader) -> None:
    session, say = reader.session, reader.say
    label = ui.label().classes("text-sm").props("role=status")
    button = ui.button(on_click=lambda: panel.control.take(session.token, session.person or say(text("this browser"))))
    button.props("flat dense color=white no-caps").set_text(say(text("Take the control")))

    def show() -> None:
        leader = panel.control.leader
        if panel.control.holds(session.token):
            label.set_text(say(text("You have the control")))
        elif leader is not None:
            label.set_text(say(text("{name} has the control", name=leader.name)))
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
